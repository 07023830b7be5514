// The exact walk: the integral over a ray with no error but the shadow map's own. In homogeneous map coordinates a ray is linear in t, so
// along its line in the map its depth Z / W is linear too. A hierarchical DDA visits every texel that the line crosses; in each the light's
// border is met at most once, where the depth passes the texel's. Tiles of the two-level min-max depth hierarchy that are lit or dark from
// end to end are passed over whole. Lit segments of t are collected, and their integrals are closed, or by quadrature: see lights.wgsl.
// The DDA follows Amanatides and Woo 1987; the rest is our own.
//! include "scatter/march/parts.wgsl"
//! include "scatter/march/chosen.wgsl"
//! include "scatter/march/hierarchy.wgsl"
@group(0) @binding(6) var<storage, read> tiles: array<u32>;

const GLASS_TEXELS = 4.0;       // of a map of what dims light, between two look-ups
const LEAST_LOOKS = 8.0;        // along a segment
const MOST_LOOKS = 128.0;
const SEARCH_TURNS = 12u;
const SAME = 1e-4;              // share of the light
const MAX_SEGMENTS = 5u;        // lit segments that wait, so that neighbouring rays are summed at the same time

struct Part {                   // of a lit segment, on which as much of the light is left
    end: f32,
    left: vec3f,
}

var<private> segments: array<vec2f, MAX_SEGMENTS + 3u>;
var<private> segment_views: array<u32, MAX_SEGMENTS + 3u>; // in which each is lit
var<private> segment_count: u32;
var<private> segment_view: u32; // of what is pushed

/// Push a lit range of t, if it is not empty.
fn push_segment(start: f32, end: f32) {
    segments[segment_count] = vec2f(start, end);
    if (GLASS) { segment_views[segment_count] = segment_view; }
    segment_count += select(0u, 1u, end > start);
}

/// Look up what is left of view i's light on a line at t.
fn left_on_line(i: u32, a: vec4f, b: vec4f, t: f32) -> vec3f {
    let at = b + t * a;
    return select(light_left(i, at.xy / at.w, at.z / at.w), vec3f(1.0), at.w <= 0.0);
}

/// Find the next part of a lit segment in view i, from `begin` on, that as much of the light is left on. That is looked up
/// along the segment, GLASS_TEXELS of the map apart, and where it changes the place is searched for between two look-ups.
fn next_part(i: u32, ray: Ray, segment: vec2f, begin: f32) -> Part {
    let a = light.view[i].matrix * vec4f(ray.direction, 0.0);
    let b = light.view[i].matrix * vec4f(ray.origin, 1.0);
    let ends = mat2x4f(b + segment.x * a, b + segment.y * a);
    let texels = length(ends[1].xy / max(ends[1].w, 1e-9) - ends[0].xy / max(ends[0].w, 1e-9)) * light.glass_side / light.side;
    let each = (segment.y - segment.x) / clamp(ceil(texels / GLASS_TEXELS), LEAST_LOOKS, MOST_LOOKS);
    let left = left_on_line(i, a, b, begin + 1e-3 * each);
    if (segment.y - segment.x < 1e-4 * segment.y) { return Part(segment.y, left); } // the digits of t tell no more apart
    var low = begin;
    var high = segment.x + each * (floor((begin - segment.x) / each + 1e-3) + 1.0);
    var changes = false;
    // Look for another value
    loop {
        high = min(high, segment.y - 1e-3 * each);
        changes = any(abs(left_on_line(i, a, b, high) - left) > vec3f(SAME));
        if (changes || high >= segment.y - 2e-3 * each) { break; }
        low = high;
        high += each;
    }
    // Search for where it begins
    var turn = 0u;
    loop {
        let middle = 0.5 * (low + high);
        let same = !changes || all(abs(left_on_line(i, a, b, middle) - left) <= vec3f(SAME));
        low = select(low, middle, same);
        high = select(middle, high, same);
        turn += 1u;
        continuing { break if turn >= SEARCH_TURNS; }
    }
    // Always move on, by more than the digits of t lose
    let end = max(high, begin + max(2e-3 * each, 2e-6 * begin));
    return Part(select(segment.y, end, changes && end < segment.y), left);
}

/// Integrate over the lit segments that wait, and drop them: transmittance for a directional light, else in-scattered radiance.
fn flush_segments(ray: Ray, nearest: vec2f, full: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var k = 0u;
    var begin = segments[0].x;
    loop {
        if (k >= segment_count) { break; }
        var segment = segments[k];
        var left = vec3f(1.0);
        if (GLASS) {
            let part = next_part(segment_views[k], ray, segment, begin);
            left = part.left;
            segment = vec2f(begin, part.end);
        }
        if (DIRECTIONAL) {
            sum += left * integrate_directional(ray, segment);
        } else {
            sum += left * integrate_in_fog(ray, nearest, full, segment);
        }
        begin = segment.y;
        if (!GLASS || begin >= segments[k].y) {
            k += 1u;
            begin = segments[k].x;
        }
    }
    segment_count = 0u;
    return sum;
}

/// Convert a share s of a line in the map to t, between the ends of a range of t, whose W are w. Twin: reference/march.py:line_to_t.
fn line_to_t(s: f32, range: vec2f, w: vec2f) -> f32 {
    let share = select(s * w.x / (s * w.x + (1.0 - s) * w.y), s, DIRECTIONAL);
    return range.x + (range.y - range.x) * share;
}

/// Walk the texels of view i along a line, and integrate over what is lit; segments of it may be left waiting.
fn walk(i: u32, ray: Ray, nearest: vec2f, full: vec2f, line: ProjectedRay) -> vec3f {
    // Set up the line: position p0 + s dp in texels and depth z0 + s dz, s from 0 to 1
    let first = line.b + line.range.x * line.a;
    let last = line.b + line.range.y * line.a;
    let w = vec2f(first.w, last.w);
    let p0 = first.xy / first.w;
    let dp = last.xy / last.w - p0;
    let z0 = first.z / first.w;
    let dz = last.z / last.w - z0;
    let bias = depth_bias(i);
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
            // Find where the line leaves the tile, and the least and greatest depth in it
            let tile = cell >> vec2u(level);
            let ahead = abs((vec2f((tile + up) << vec2u(level)) - p0) * inverse);
            let end = clamp(min(ahead.x, ahead.y), s, 1.0);
            let here = clamp(cell, vec2i(0), most);
            var depths = vec2f(textureLoad(shadow, here, i, 0));
            if (level > 0u) { depths = unpack2x16float(tiles[tile_index(side, i, level, vec2u(here) >> vec2u(level))]); }
            let least = biased_occluder_depth(depths.x, bias);
            let greatest = biased_occluder_depth(depths.y, bias);
            // Descend where the tile is neither lit nor dark as a whole
            let z = vec2f(z0 + s * dz, z0 + end * dz);
            let all_lit = min(z.x, z.y) >= greatest;
            if (level > 0u && !all_lit && max(z.x, z.y) >= least) {
                level -= FINE;
                continue;
            }
            // Find the border between light and shadow in it
            let edge = select(least, greatest, all_lit);
            let lit0 = z.x >= edge;
            let lit1 = z.y >= edge;
            let border = clamp((edge - z0) / select(dz, 1e-30, dz == 0.0), s, end);
            // End at most one segment: at the border to the cell before, or in this one
            let begun = select(since, s, !lit && lit0);
            if ((lit && !lit0) || (lit0 && !lit1)) {
                push_segment(line_to_t(begun, line.range, w), line_to_t(select(border, s, lit && !lit0), line.range, w));
            }
            since = select(begun, border, !lit0 && lit1);
            lit = lit1;
            s = end;
            // Step into the next cell: along one axis at its border, along the other where the ray is
            let along = clamp(vec2i(floor(p0 + end * dp)), tile << vec2u(level), ((tile + 1) << vec2u(level)) - 1);
            let beyond = ((tile + up) << vec2u(level)) - 1 + up;
            let next = select(vec2i(along.x, beyond.y), vec2i(beyond.x, along.y), ahead.x < ahead.y);
            // Ascend where that leaves the tile of the level above
            let left = any((next >> vec2u(level + FINE)) != (cell >> vec2u(level + FINE)));
            level = select(level, min(level + FINE, COARSE), left);
            cell = next;
            continuing { break if s >= 1.0 || segment_count >= MAX_SEGMENTS; }
        }
        if (s >= 1.0 && lit) { push_segment(line_to_t(since, line.range, w), line.range.y); }
        if (segment_count >= MAX_SEGMENTS) { sum += flush_segments(ray, nearest, full); }
        continuing { break if s >= 1.0; }
    }
    return sum;
}

/// Test whether view i lights a line at t.
fn is_lit(i: u32, line: ProjectedRay, t: f32) -> bool {
    let at = line.b + t * line.a;
    let texel = floor(at.xy / at.w);
    let within = clamp(texel, vec2f(0.0), vec2f(light.side - 1.0));
    let occluder = biased_occluder_depth(textureLoad(shadow, vec2i(within), i, 0), depth_bias(i));
    let nearer = !DIRECTIONAL && at.w <= 0.5 * light.view[i].depth_scale; // than anything casts
    return nearer || any(within != texel) || at.z / at.w >= occluder;
}

/// Integrate over what is lit of a range of t in view i. Outside the map of a directional light or a spot all is lit.
fn integrate_view(i: u32, ray: Ray, nearest: vec2f, full: vec2f, range: vec2f) -> vec3f {
    segment_view = i;
    var line = project_ray(i, ray, range, select(0.0, 1.0, CUBE));
    var whole = range;
    if (CUBE) { whole = vec2f(line.range.x, max(line.range.x, line.range.y)); }
    // Walk up to the last stretch
    let last = clamp(last_stretch(i, ray, line.b.w + ray.reach * line.a.w), whole.x, whole.y);
    line.range.y = min(line.range.y, last);
    if (!DIRECTIONAL) { line.range = clip_range(line.range, line.b.w - 0.5 * light.view[i].depth_scale, line.a.w); } // nearer nothing casts
    var found = vec3f(0.0);
    if (line.range.y > line.range.x) { found = walk(i, ray, nearest, full, line); } else { line.range = vec2f(last); }
    push_segment(whole.x, line.range.x);
    push_segment(line.range.y, last);
    // Light the last stretch as it begins
    if (is_lit(i, line, last)) { push_segment(last, whole.y); }
    return found;
}

/// Integrate what the light adds to a ray, or to a part of one, `around` which the whole ray ranges.
fn in_scattered(ray: Ray, pixel: vec2u, around: vec2f) -> vec3f {
    var nearest = vec2f(0.0);
    var range = vec2f(0.0, ray.reach);
    if (VARIES) { enter_shade(ray); }
    if (!DIRECTIONAL) { nearest = nearest_approach(ray); }
    if (DIRECTIONAL) { range.y = min(range.y, frame.sun_reach + around.x); }
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    if (BOUNDED) { range = clip_to_planes(ray, range); }
    range.y = max(range.x, range.y);
    enter_shape(ray);
    if (VARIES) { cone_range = range; }
    let full = full_cone_range(ray, range);
    var total = vec3f(0.0);
    segment_count = 0u;
    if (light_storage.views == 0u) { push_segment(range.x, range.y); }
    for (var i = 0u; i < light_storage.views; i++) {
        var seen = range;
        if (DIRECTIONAL) {
            let ahead = max(-ray.direction.z, 1e-6);
            let view = light.view[i];
            seen = clamp((vec2f(view.near, view.far) + ray.origin.z) / ahead, range.xx, range.yy);
        }
        total += integrate_view(i, ray, nearest, full, seen);
        if (segment_count >= MAX_SEGMENTS) { total += flush_segments(ray, nearest, full); }
    }
    total += flush_segments(ray, nearest, full);
    if (DIRECTIONAL) { total *= in_scatter_directional(ray); }
    return total;
}

/// March the ray of a pixel exactly, and write its layer.
@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light_storage.begin;
    if (!is_listed() && any(pixel >= frame.size)) { return; }
    let sampled = marched_pixel(pixel);
    let ray = camera_ray_at(sampled);
    if (PANES) {
        textureStore(layer, pixel, layer_of_parts(pixel, ray));
        return;
    }
    var sum = ambient_or_previous(pixel, ray);
    if (VARIES) { enter_field(ray); }
    if (LIT) { sum += in_scattered(ray, pixel, vec2f(0.0, ray.reach)); }
    textureStore(layer, pixel, finished(pixel, ray, sum));
}
