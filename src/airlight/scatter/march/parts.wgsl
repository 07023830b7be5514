// Marches a ray in parts, where surfaces are seen through: from knot to knot of its profile, each part as a ray of its own behind the medium
// before it. Whoever includes this has in_scattered(ray, around): what the light adds to a part.
//! include "scatter/march/lights.wgsl"
//! include "scatter/march/glass.wgsl"
//! include "scatter/march/profile.wgsl"
override PANES: bool = false;   // surfaces are seen through

@group(0) @binding(8) var<storage, read> spans: array<PackedSpan>;
@group(0) @binding(9) var<storage, read_write> profile: array<vec2u>; // see pack_knot

/// March a ray in parts: sum what its light adds, and write the profile.
fn march_parts(pixel: vec2u, ray: Ray) -> vec3f {
    let at = pixel.y * frame.size.x + pixel.x;
    let rays = frame.size.x * frame.size.y;
    let span = unpack_span(spans[at]);
    var sum = vec3f(0.0);
    var passed = 0.0; // optical length
    var begin = 0.0;
    var k = 0.0;
    loop {
        // March the part up to the k-th knot
        let end = clamp(knot(span, k), begin, ray.reach);
        let part = Ray(ray.origin + begin * ray.direction, end - begin, ray.direction);
        ends_midway = k < span.count || ray.reach >= frame.max_distance;
        if (LIT) { sum += transmittance(passed, frame.sigma_t) * in_scattered(part, pixel, vec2f(-begin, ray.reach - begin)); }
        passed += optical_length(part, part.reach);
        // Write the knot
        var before = frame.sigma_s * frame.ambient * transmittance_integral(passed, frame.sigma_t);
        let knot = u32(k) * rays + at;
        if (!FIRST) { before = unpack_knot(profile[knot]).rgb; }
        profile[knot] = pack_knot(vec4f(before + sum, passed));
        begin = end;
        k += 1.0;
        continuing { break if k > span.count; }
    }
    return sum;
}
