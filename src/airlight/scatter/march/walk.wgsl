// The exact texel walk: every texel of the shadow map that a ray crosses, in each at most one border between light and shadow.
// Along a ray X, Y, Z and W of View.matrix are linear in t; along its line in the map so is the depth Z / W, for lamps too.
//! include "scatter/march/lights.wgsl"

/// t of the place a share s of the way along the line in the map, between the ends of a range of t, whose W are w.
fn way(s: f32, range: vec2f, w: vec2f) -> f32 {
    return range.x + (range.y - range.x) * s * w.x / (s * w.x + (1.0 - s) * w.y);
}

/// The lit part of a range of t in view i, without what all of it has in common.
fn walk(i: u32, ray: Ray, near: vec2f, line: Line) -> vec3f {
    let t0 = line.range.x;
    let span = line.range.y - t0;
    let first = line.b + t0 * line.a;
    let last = line.b + line.range.y * line.a;
    let w = vec2f(first.w, last.w);
    let p0 = first.xy / first.w;
    let dp = last.xy / last.w - p0;
    let z0 = first.z / first.w;
    let dz = last.z / last.w - z0;
    let bias = bias_in(i);
    let inverse = 1.0 / select(dp, vec2f(1e-20), abs(dp) < vec2f(1e-20));
    let up = vec2f(select(0.0, 1.0, dp.x > 0.0), select(0.0, 1.0, dp.y > 0.0));
    let step = vec2i(select(-1, 1, dp.x > 0.0), select(-1, 1, dp.y > 0.0));
    let most = i32(light.side) - 1;
    var cell = clamp(vec2i(floor(p0)), vec2i(0), vec2i(most));
    let texels = clamp(vec2i(floor(p0 + dp)), vec2i(0), vec2i(most)) - cell;
    var left = abs(texels.x) + abs(texels.y) + 2; // more than there are, should rounding miss the end
    var s = 0.0;
    var end = 0.0;
    var lit = false;
    var since = 0.0;
    var sum = vec3f(0.0);
    loop {
        // on to the next border between light and shadow, or to the end
        var held = 0.0;
        var lit0 = lit;
        var lit1 = lit;
        loop {
            s = end;
            let ahead = abs((vec2f(cell) + up - p0) * inverse);
            end = min(min(ahead.x, ahead.y), 1.0);
            held = threshold(textureLoad(shadow, clamp(cell, vec2i(0), vec2i(most)), i, 0), bias);
            lit0 = z0 + s * dz >= held;
            lit1 = z0 + end * dz >= held;
            cell += select(vec2i(0, step.y), vec2i(step.x, 0), ahead.x < ahead.y);
            left -= 1;
            continuing { break if lit0 != lit || lit1 != lit || end >= 1.0 || left <= 0; }
        }
        let border = clamp((held - z0) / select(dz, 1e-30, dz == 0.0), s, end);
        let crossed = lit0 != lit1;
        if (KIND == 0u) {
            // each border adds or takes away what the way to it gives
            let here = select(0.0, select(-1.0, 1.0, lit), lit0 != lit);
            let there = select(0.0, select(-1.0, 1.0, lit0), crossed);
            sum += here * until(t0 + s * span) + there * until(t0 + border * span);
        } else {
            // at most one stretch ends here: at the texel's own border, or in it
            let begun = select(since, s, !lit && lit0);
            let over = select(border, s, lit && !lit0);
            let ends = (lit && !lit0) || (lit0 && !lit1);
            let start = way(begun, line.range, w);
            sum += lamp_stretch(ray, near, start, select(start, way(over, line.range, w), ends));
            since = select(begun, border, !lit0 && lit1);
        }
        lit = lit1;
        continuing { break if end >= 1.0 || left <= 0; }
    }
    if (KIND == 0u) { return sum + select(vec3f(0.0), until(line.range.y), lit); }
    let start = way(since, line.range, w);
    return sum + lamp_stretch(ray, near, start, select(start, line.range.y, lit));
}

fn sun_part(i: u32, ray: Ray) -> vec3f {
    let view = light.view[i];
    let ahead = max(-ray.direction.z, 1e-6);
    let whole = vec2f(min(view.near / ahead, ray.reach), select(min(view.far / ahead, ray.reach), ray.reach, view.far > 1e38));
    let line = line_of(i, ray, whole, 0.0);
    let all = until(whole.y) - until(whole.x);
    let within = line.range.y > line.range.x;
    let outside = all - select(vec3f(0.0), until(line.range.y) - until(line.range.x), within);
    var found = vec3f(0.0);
    if (within) { found = walk(i, ray, vec2f(0.0), line); }
    return max(outside, vec3f(0.0)) + found;
}

fn lamp_part(i: u32, ray: Ray, near: vec2f, range: vec2f) -> vec3f {
    let face = line_of(i, ray, range, select(0.0, 1.0, KIND == 2u));
    let closest = 0.5 * light.view[i].depth_scale; // nearer nothing casts
    var line = face;
    line.range = cut(face.range, face.b.w - closest, face.a.w);
    var found = vec3f(0.0);
    if (face.range.y > face.range.x) {
        if (line.range.y > line.range.x) { found = walk(i, ray, near, line); } else { line.range = face.range.xx; }
        found += lamp_stretch(ray, near, face.range.x, line.range.x) + lamp_stretch(ray, near, line.range.y, face.range.y);
    }
    return found;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    if (KIND == 0u) {
        var lit = vec3f(0.0);
        if (light.views == 0u) { lit = until(ray.reach); }
        for (var i = 0u; i < light.views; i++) { lit += sun_part(i, ray); }
        sum += sunlight(ray) * lit;
    } else if (KIND < 3u) {
        let near = approach(ray);
        var range = vec2f(0.0, ray.reach);
        if (KIND == 1u) { range = in_cone(ray, range, light.cosine); }
        if (light.views == 0u) { sum += lamp_stretch(ray, near, range.x, max(range.x, range.y)); }
        for (var i = 0u; i < light.views; i++) { sum += lamp_part(i, ray, near, range); }
    }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
}
