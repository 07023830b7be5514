// Spans of rays' knots: up to four surfaces that are seen through have one each, found by their distances' extremes and sums.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/profile.wgsl"
override ALONE: bool = false;   // the march is computed at the picture's size: no ray serves others' pixels
override MOST: f32 = 1.0;       // knots
override SUMS: bool = false;    // the sums are exact enough

@group(0) @binding(6) var extremes: texture_2d<f32>; // (farthest, -nearest) of the surfaces on a ray, m
@group(0) @binding(7) var sums: texture_2d<f32>; // (sum of distances, of their squares, their number)
@group(0) @binding(8) var<storage, read_write> spans: array<PackedSpan>;

/// Place the knots of so many surfaces, from their extremes, m, and the sums of their distances and of the squares of these.
/// Twin: reference/profile.py:listed_knots.
fn listed_knots(extremes: vec2f, sums: vec2f, count: f32) -> vec4f {
    let first = extremes.x;
    let last = extremes.y;
    let middle = 0.5 * (sums.x - first - last); // of four
    let spread = sqrt(max(0.5 * (sums.y - first * first - last * last) - middle * middle, 0.0));
    let third = select(clamp(middle + spread, first, last), last, count <= 3.0);
    let second = select(clamp(middle - spread, first, last), select(clamp(2.0 * middle, first, last), last, count <= 2.0), count <= 3.0);
    return vec4f(first, second, third, last);
}

/// Write the span of a pixel's ray. Where it serves others' pixels too, it takes the knots of that ray around it with most of them.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = camera_ray(id.xy);
    let most = vec2i(frame.size) - 1;
    var at = vec2i(id.xy);
    var other = at;
    var most_found = textureLoad(sums, at, 0).z;
    var its = most_found;
    //! each k of 9: other = clamp(vec2i(id.xy) + vec2i(vec2u(k % 3u, k / 3u)) - 1, vec2i(0), most); its = textureLoad(sums, other, 0).z; if (!ALONE && its > most_found) { most_found = its; at = other; }
    let found = textureLoad(sums, at, 0);
    let ends = textureLoad(extremes, at, 0);
    let range = vec2f(-ends.y, ends.x);
    let exact = found.z <= min(select(2.0, LISTED, SUMS), MOST);
    let count = select(min(max(found.z + 1.0, LISTED + 1.0), MOST), found.z, exact);
    var knots = select(vec4f(range, 0.0, 0.0), listed_knots(range, found.xy, found.z), exact);
    if (!exact && count <= LISTED) { knots = mix(range.xxxx, range.yyyy, vec4f(0.0, 1.0, 2.0, 3.0) / max(count - 1.0, 1.0)); }
    knots = min(knots, vec4f(min(ray.reach, 65504.0)));
    let packed = vec2u(pack2x16float(knots.xy), pack2x16float(knots.zw));
    spans[id.y * frame.size.x + id.x] = PackedSpan(packed, count, ray.reach);
}
