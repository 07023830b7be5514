// Spans of rays' knots, from where surfaces that are seen through lie on them. At the picture's size a ray has its own; smaller, also those
// of the rays around it, since what lies between is interpolated.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/profile.wgsl"
override ALONE: bool = false;   // the march is computed at the picture's size
override MOST: f32 = 2.0;       // knots

@group(0) @binding(6) var reaches: texture_2d<f32>; // (farthest, -nearest, 0, count) of the surfaces on a ray, m
@group(0) @binding(7) var<storage, read_write> spans: array<Span>;

/// Write the span of a pixel's ray.
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = camera_ray(id.xy);
    var found = vec4f(-3e38, -3e38, 0.0, 0.0);
    let most = vec2i(frame.size) - 1;
    //! each k of 9: if (!ALONE || k == 4u) { found = max(found, textureLoad(reaches, clamp(vec2i(id.xy) + vec2i(vec2u(k % 3u, k / 3u)) - 1, vec2i(0), most), 0)); }
    let last = min(found.x, ray.reach);
    let first = min(-found.y, last);
    // One or two surfaces have a knot each; more, or those of several rays, have knots between
    let exact = ALONE && found.a <= 2.0;
    let count = select(0.0, select(clamp(found.a + 1.0, 2.0, MOST), found.a, exact), found.a > 0.0);
    spans[id.y * frame.size.x + id.x] = Span(first, last, count, ray.reach);
}
