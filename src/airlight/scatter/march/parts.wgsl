// Marches a ray in parts, where surfaces are seen through: from knot to knot of its profile, each part as a ray of its own behind the medium
// before it. Whoever includes this has in_scattered(ray, around): what the light adds to a part.
//! include "scatter/march/lights.wgsl"
//! include "scatter/march/profile.wgsl"
override PANES: bool = false;   // surfaces are seen through

@group(0) @binding(8) var spans: texture_2d<f32>;
@group(0) @binding(9) var profile_before: texture_2d_array<f32>;
@group(0) @binding(10) var profile: texture_storage_2d_array<rgba16float, write>;

/// March a ray in parts: sum what its light adds, and write the profile.
fn march_parts(pixel: vec2u, ray: Ray) -> vec3f {
    let texel = textureLoad(spans, pixel, 0);
    let span = Span(texel.x, texel.y, texel.z, texel.w);
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
        if (!FIRST) { before = textureLoad(profile_before, pixel, u32(k), 0).rgb; }
        textureStore(profile, pixel, u32(k), vec4f(before + sum, passed));
        begin = end;
        k += 1.0;
        continuing { break if k > span.count; }
    }
    return sum;
}
