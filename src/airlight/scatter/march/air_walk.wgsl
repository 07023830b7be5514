// Sunlight that is missing in the air, exactly: C(b) - C(a) of each dark segment of a ray, as the exact walk finds them in the shadow map, and
// what fog, volumes and glass take, piece by piece.
//! include "scatter/march/air.wgsl"
//! include "scatter/march/segments.wgsl"

const MOST_PIECES = 64.0;       // of a part of a segment
const PIECE_CELLS = 1.0;        // of the table of what dims the sun, that a piece is long
const FOG_DEPTHS = 0.25;        // of the fog, that a piece may rise

var<private> sky: DaylightRay;
var<private> lit_until: f32;    // m, where the last lit segment ends

/// Place the k-th piece of a segment, or a part of one, with so many before, on and after a range in it. Twin: reference/march_air.py:piece_place.
fn piece_place(k: f32, segment: vec2f, inside: vec2f, counts: vec3f) -> f32 {
    if (k <= counts.x) { return mix(segment.x, inside.x, k / max(counts.x, 1.0)); }
    if (k <= counts.x + counts.y) { return mix(inside.x, inside.y, (k - counts.x) / max(counts.y, 1.0)); }
    return mix(inside.y, segment.y, min((k - counts.x - counts.y) / max(counts.z, 1.0), 1.0));
}

/// Integrate what sunlight is missing over a segment of a ray that view i lights, or not, but for what is missing in fog alone: `left` is what
/// glass leaves of it.
fn missing_in_segment(i: u32, ray: Ray, segment: vec2f, is_lit: bool, left: vec3f) -> vec3f {
    let begin = daylight_single(sky, segment.x);
    if (!(TABLE || FADES)) { return select(vec3f(1.0), 1.0 - left, is_lit) * (daylight_single(sky, segment.y) - begin); }
    // Divide the segment at the ends of the table of what dims the sun, and into pieces there, or where fog changes
    var inside = segment.xx;
    var counts = vec3f(0.0, 0.0, 1.0);
    if (TABLE) {
        let within = clamp(shaded, segment.xx, segment.yy);
        inside = select(segment.xx, within, within.y > within.x);
        counts = vec3f(1.0, ceil((inside.y - inside.x) / (PIECE_CELLS * light.shade_cell)), 1.0);
    }
    if (FADES) {
        let lengths = vec3f(inside.x - segment.x, inside.y - inside.x, segment.y - inside.y);
        counts += ceil(lengths * abs(dot(frame.up, ray.direction)) / (FOG_DEPTHS * frame.fog_depth));
    }
    counts = min(counts, vec3f(MOST_PIECES));
    let pieces = counts.x + counts.y + counts.z;
    var sum = vec3f(0.0);
    var before = begin;
    var k = 0.0;
    loop {
        let t = piece_place(k + 0.5, segment, inside, counts);
        var found = vec3f(1.0);
        if (FADES) { found = left_by_fog(ray, t); }
        if (is_lit) { found -= left * transmittance(light_length(ray, t), frame.sigma_t); }
        let now = daylight_single(sky, piece_place(k + 1.0, segment, inside, counts));
        sum += found * (now - before);
        before = now;
        k += 1.0;
        continuing { break if k >= pieces; }
    }
    return sum;
}

/// Integrate what sunlight is missing between the lit segments that wait, and in them, and drop them.
fn flush_segments(ray: Ray, nearest: vec2f, full: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        if (k >= segment_count) { break; }
        let segment = segments[k];
        if (segment.x > lit_until) { sum += missing_in_segment(0u, ray, vec2f(lit_until, segment.x), false, vec3f(1.0)); }
        if (GLASS) {
            var begin = segment.x;
            loop {
                let part = next_part(segment_views[k], ray, segment, begin);
                sum += missing_in_segment(segment_views[k], ray, vec2f(begin, part.end), true, part.left);
                begin = part.end;
                continuing { break if begin >= segment.y; }
            }
        } else if (TABLE || FADES) {
            sum += missing_in_segment(0u, ray, segment, true, vec3f(1.0));
        }
        lit_until = segment.y;
        k += 1u;
    }
    segment_count = 0u;
    return sum;
}

/// Integrate what sunlight is missing on the ray of a pixel of what is computed, D L1; in alpha the ray's length, the guide of its upsampling.
@compute @workgroup_size(8, 8)
fn look_up(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let whole = air_ray(sampled_pixel(id.xy));
    sky = daylight_ray(whole.direction);
    let seen = select(whole.reach, sky.ground, whole.reach >= NO_END);
    let ray = Ray(whole.origin, min(seen, FARTHEST), whole.direction);
    var sum = vec3f(0.0);
    segment_count = 0u;
    lit_until = 0.0;
    if (TABLE) { enter_shade(ray); }
    if (FADES) { sum += missing_in_fog(ray, sky); }
    if (light_storage.views == 0u) { push_segment(0.0, ray.reach); }
    for (var i = 0u; i < light_storage.views; i++) {
        sum += integrate_view(i, ray, vec2f(0.0), vec2f(0.0), range_of_view(i, ray));
        if (segment_count >= MAX_SEGMENTS) { sum += flush_segments(ray, vec2f(0.0), vec2f(0.0)); }
    }
    sum += flush_segments(ray, vec2f(0.0), vec2f(0.0));
    if (ray.reach > lit_until) { sum += missing_in_segment(0u, ray, vec2f(lit_until, ray.reach), false, vec3f(1.0)); }
    textureStore(layer, id.xy, vec4f(max(sum, vec3f(0.0)), min(whole.reach, frame.max_distance)));
}
