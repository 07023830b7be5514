// The exact walk: every texel of the shadow map that a ray crosses, in each at most one border between light and shadow. Tiles of texels
// that are lit or dark from end to end of the ray in them are passed over whole.
// Along a ray X, Y, Z and W of View.matrix are linear in t; along its line in the map so is the depth Z / W, for lamps too.
//! include "scatter/march/lights.wgsl"
//! include "scatter/march/tile.wgsl"
@group(0) @binding(6) var<storage, read> tiles: array<u32>;

const MANY = 5u;                // lit stretches that wait, so that neighbouring rays are summed at the same time

var<private> stretches: array<vec2f, MANY + 3u>;
var<private> waiting: u32;

/// Have a range of t lit.
fn keep(start: f32, end: f32) {
    stretches[waiting] = vec2f(start, end);
    waiting += select(0u, 1u, end > start);
}

/// What the stretches that wait scatter, of a sun without what all its ray has in common.
fn gathered(ray: Ray, near: vec2f, full: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        if (k >= waiting) { break; }
        let range = stretches[k];
        if (KIND == 0u) { sum += until(range.y) - until(range.x); } else { sum += lamp_stretch(ray, near, full, range); }
        k += 1u;
    }
    waiting = 0u;
    return sum;
}

/// t of the place a share s of the way along a line in the map, between the ends of a range of t, whose W are w.
fn way(s: f32, range: vec2f, w: vec2f) -> f32 {
    let share = select(s * w.x / (s * w.x + (1.0 - s) * w.y), s, KIND == 0u);
    return range.x + (range.y - range.x) * share;
}

/// What view i lights of a line; stretches of it may be left waiting.
fn walk(i: u32, ray: Ray, near: vec2f, full: vec2f, line: Line) -> vec3f {
    let first = line.b + line.range.x * line.a;
    let last = line.b + line.range.y * line.a;
    let w = vec2f(first.w, last.w);
    let p0 = first.xy / first.w;
    let dp = last.xy / last.w - p0;
    let z0 = first.z / first.w;
    let dz = last.z / last.w - z0;
    let bias = bias_in(i);
    let inverse = 1.0 / select(dp, vec2f(1e-20), abs(dp) < vec2f(1e-20));
    let up = vec2i(dp > vec2f(0.0));
    let side = u32(light.side);
    let most = vec2i(i32(side) - 1);
    var cell = clamp(vec2i(floor(p0)), vec2i(0), most);
    var level = COARSE;
    var s = 0.0;
    var lit = false;
    var since = 0.0;
    var sum = vec3f(0.0);
    loop {
        loop {
            let tile = cell >> vec2u(level);
            let ahead = abs((vec2f((tile + up) << vec2u(level)) - p0) * inverse);
            let end = clamp(min(ahead.x, ahead.y), s, 1.0);
            let here = clamp(cell, vec2i(0), most);
            var held = vec2f(textureLoad(shadow, here, i, 0));
            if (level > 0u) { held = unpack2x16float(tiles[tile_at(side, i, level, vec2u(here) >> vec2u(level))]); }
            let least = threshold(held.x, bias);
            let greatest = threshold(held.y, bias);
            let z = vec2f(z0 + s * dz, z0 + end * dz);
            let open = min(z.x, z.y) >= greatest;
            if (level > 0u && !open && max(z.x, z.y) >= least) {
                level -= FINE;
                continue;
            }
            let edge = select(least, greatest, open);
            let lit0 = z.x >= edge;
            let lit1 = z.y >= edge;
            let border = clamp((edge - z0) / select(dz, 1e-30, dz == 0.0), s, end);
            // at most one stretch ends here: at the border to the cell before, or in it
            let begun = select(since, s, !lit && lit0);
            if ((lit && !lit0) || (lit0 && !lit1)) {
                keep(way(begun, line.range, w), way(select(border, s, lit && !lit0), line.range, w));
            }
            since = select(begun, border, !lit0 && lit1);
            lit = lit1;
            s = end;
            // into the next cell: along one axis at its border, along the other where the ray is
            let along = clamp(vec2i(floor(p0 + end * dp)), tile << vec2u(level), ((tile + 1) << vec2u(level)) - 1);
            let beyond = ((tile + up) << vec2u(level)) - 1 + up;
            let next = select(vec2i(along.x, beyond.y), vec2i(beyond.x, along.y), ahead.x < ahead.y);
            let left = any((next >> vec2u(level + FINE)) != (cell >> vec2u(level + FINE)));
            level = select(level, min(level + FINE, COARSE), left);
            cell = next;
            continuing { break if s >= 1.0 || waiting >= MANY; }
        }
        if (s >= 1.0 && lit) { keep(way(since, line.range, w), line.range.y); }
        if (waiting >= MANY) { sum += gathered(ray, near, full); }
        continuing { break if s >= 1.0; }
    }
    return sum;
}

/// What view i lights of a range of t. Outside the map of a sun or a spot all is lit.
fn part(i: u32, ray: Ray, near: vec2f, full: vec2f, range: vec2f) -> vec3f {
    var line = line_of(i, ray, range, select(0.0, 1.0, KIND == 2u));
    var whole = range;
    if (KIND == 2u) { whole = vec2f(line.range.x, max(line.range.x, line.range.y)); }
    if (KIND != 0u) { line.range = cut(line.range, line.b.w - 0.5 * light.view[i].depth_scale, line.a.w); } // nearer nothing casts
    var found = vec3f(0.0);
    if (line.range.y > line.range.x) { found = walk(i, ray, near, full, line); } else { line.range = whole.yy; }
    keep(whole.x, line.range.x);
    keep(line.range.y, whole.y);
    return found;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    if (KIND < 3u) {
        var near = vec2f(0.0);
        var range = vec2f(0.0, ray.reach);
        if (KIND != 0u) { near = approach(ray); }
        if (KIND == 1u) { range = in_cone(ray, range, light.cosine); }
        range.y = max(range.x, range.y);
        let full = in_full(ray, range);
        var total = vec3f(0.0);
        waiting = 0u;
        if (counted.views == 0u) { keep(range.x, range.y); }
        for (var i = 0u; i < counted.views; i++) {
            var seen = range;
            if (KIND == 0u) {
                let ahead = max(-ray.direction.z, 1e-6);
                let view = light.view[i];
                seen = min(vec2f(view.near, view.far) / ahead, range.yy);
            }
            total += part(i, ray, near, full, seen);
            if (waiting >= MANY) { total += gathered(ray, near, full); }
        }
        total += gathered(ray, near, full);
        if (KIND == 0u) { total *= sunlight(ray); }
        sum += total;
    }
    store_layer(id.xy, ray, sum);
}
