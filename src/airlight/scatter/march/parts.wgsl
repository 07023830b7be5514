// Marches a ray in parts, where surfaces are seen through: from knot to knot of its profile, each part as a ray of its own behind the medium
// before it. Whoever includes this has in_scattered(part, pixel, around): what the light adds to a part of a ray that ranges `around` it.
//! include "scatter/march/lights.wgsl"
//! include "scatter/march/glass.wgsl"
//! include "scatter/march/profile.wgsl"
override PANES: bool = false;   // surfaces are seen through

@group(0) @binding(11) var<storage, read> spans: array<PackedSpan>;
@group(0) @binding(12) var<storage, read_write> profile: array<vec2u>; // see pack_knot

/// March a ray in parts, and write the profile: what its light adds, and the optical length.
fn march_parts(pixel: vec2u, ray: Ray) -> vec4f {
    let at = pixel.y * frame.size.x + pixel.x;
    let rays = frame.size.x * frame.size.y;
    let span = unpack_span(spans[at]);
    var sum = vec3f(0.0);
    var length = 0.0;
    var begin = 0.0;
    var k = 0.0;
    loop {
        // March the part up to the k-th knot
        let end = clamp(knot_place(span, k), begin, ray.reach);
        let part = Ray(ray.origin + begin * ray.direction, end - begin, ray.direction);
        ends_midway = k < span.count || ray.reach >= frame.max_distance;
        if (VARIES) { enter_field(part); }
        if (LIT) { sum += transmittance(length, frame.sigma_t) * in_scattered(part, pixel, vec2f(-begin, ray.reach - begin)); }
        if (VARIES) {
            seek(part, part.reach, part.reach / max(f32(light.steps), 1.0));
            length += cursor.y;
        } else {
            length += optical_length(part, part.reach);
        }
        // Write the knot
        let index = u32(k) * rays + at;
        var before = frame.sigma_s * frame.ambient * transmittance_integral(length, frame.sigma_t);
        if (!FIRST) { before = unpack_knot(profile[index]).rgb; }
        profile[index] = pack_knot(vec4f(before + sum, length));
        begin = end;
        k += 1.0;
        continuing { break if k > span.count; }
    }
    return vec4f(sum, length);
}

/// Find a pixel's layer, marched in parts.
fn layer_of_parts(pixel: vec2u, ray: Ray) -> vec4f {
    let found = march_parts(pixel, ray);
    var sum = ambient_or_previous(pixel, ray) + found.rgb;
    if (!VARIES) { return vec4f(sum, ray.reach); }
    if (!FIRST) { return vec4f(sum, textureLoad(before, pixel, 0).a); }
    sum += frame.sigma_s * frame.ambient * transmittance_integral(found.a, frame.sigma_t);
    return vec4f(sum, found.a - ray.reach * mean_even_density(ray.origin, place_at(ray, ray.reach)));
}
