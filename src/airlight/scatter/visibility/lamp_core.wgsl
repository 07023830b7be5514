// The pixels at a lamp's own place in the picture, where each sees much of the light that the lamp scatters, and those opposite of a lamp behind
// the eye, whose rays lie in few blocks: in so many steps of even angles at the lamp, as in steps.wgsl.
//! include "scatter/visibility/lamps.wgsl"
//! include "scatter/march/ranges.wgsl"
override CORE_STEPS: f32 = 512.0;

@group(0) @binding(7) var<uniform> core: Core;
@group(0) @binding(8) var nearest_sampler: sampler;
@group(0) @binding(9) var<uniform> lamp: Lamp;

/// Tell whether the shadow map lights a ray at t.
fn is_lit(ray: Ray, t: f32) -> bool {
    let away = ray.origin + t * ray.direction - light.position;
    var map = 0u;
    if (CUBE) { map = face_towards(away); }
    let end = light.view[map].matrix * vec4f(ray.origin + ray.reach * ray.direction, 1.0);
    let looked_up = min(t, last_stretch(map, ray, end.w));
    let at = light.view[map].matrix * vec4f(ray.origin + looked_up * ray.direction, 1.0);
    let place = at.xy / at.w;
    let within = (at.w > 0.0) & (CUBE | (all(place >= vec2f(0.0)) & all(place < vec2f(light.side))));
    let held = biased_occluder_depth(textureSampleLevel(shadow, nearest_sampler, place / light.side, map, 0), depth_bias(map));
    return within & (at.z / at.w >= held);
}

/// Write a pixel's layer anew, near the lamp.
@compute @workgroup_size(8, 8)
fn step_core(@builtin(global_invocation_id) id: vec3u) {
    let pixel = min(core.begin + id.xy, frame.pixels - 1u);
    let away = distance(vec2f(core.begin + id.xy) + 0.5, core.middle);
    let ray = camera_ray_at(pixel);
    let nearest = nearest_approach(ray);
    let range = vec2f(0.0, ray.reach);
    let start = equiangular_angle(nearest, range.x);
    let each = (equiangular_angle(nearest, range.y) - start) / CORE_STEPS;
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        let at = unit_at(start + (k + 0.5) * each);
        let slope = at.y / at.x;
        let longer = 1.0 / at.x;
        let d = nearest.y * longer;
        let t = nearest.x + nearest.y * slope;
        let axis_cosine = dot(ray.origin + t * ray.direction - light.position, light.axis) / d;
        let found = in_scatter_punctual(ray, t, d, -at.y, axis_cosine);
        sum += select(vec3f(0.0), found, is_lit(ray, t));
        k += 1.0;
        continuing { break if k >= CORE_STEPS; }
    }
    sum = ambient_or_previous(pixel, ray) + sum * (each / nearest.y);
    // Store what is out of the disc nowhere, as in core.wgsl
    let is_core = away <= core.radius && all(pixel == core.begin + id.xy);
    textureStore(layer, select(frame.pixels, pixel, is_core), vec4f(sum, ray.reach));
}
