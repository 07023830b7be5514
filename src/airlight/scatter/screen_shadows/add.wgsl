// Adds a light that is seen in the picture: what it would add if nothing hid it, in closed form or by quadrature as the exact walk has it,
// less what of that is hidden: scan.wgsl.
//! include "scatter/march/lights.wgsl"
//! include "scatter/screen_shadows/coordinate.wgsl"
override LAST: bool = false;    // writes transmittance too

@group(0) @binding(11) var shares: texture_2d<f32>;
@group(0) @binding(12) var layer_transmittance: texture_storage_2d<rgba32float, write>;

/// Read the share of the light that is hidden from a ray of the picture up to a coordinate.
fn hidden_share(pixel: vec2u, at: f32) -> f32 {
    let place = place_in_grid(vec2f(pixel) + 0.5, vec2f(frame.pixels), scan.slope, scan.offset, scan.rate, scan.first, scan.rays);
    let bin = clamp(at, 0.0, 1.0) * f32(BINS);
    let layer_index = clamp(floor(bin / STEPS), 0.0, f32(LAYERS) - 1.0);
    let texel = vec2f(layer_index * place.rays + place.ray, place.row) + 0.5;
    return clamp(between_planes(textureSampleLevel(shares, linear, texel * scan.texel, 0.0), bin - STEPS * layer_index), 0.0, 1.0);
}

/// Write a pixel's layer.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) id: vec3u) {
    let ray = camera_ray_at(id.xy);
    var sum = vec3f(0.0);
    var end = ray.reach;
    if (DIRECTIONAL) {
        end = min(end, frame.sun_reach);
        sum = integrate_evenly(ray, vec2f(0.0, end)) * in_scatter_directional(ray);
    } else {
        var range = vec2f(0.0, end);
        if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
        range.y = max(range.x, range.y);
        sum = integrate_in_fog(ray, nearest_approach(ray), full_cone_range(ray, range), range);
    }
    sum *= 1.0 - hidden_share(id.xy, coordinate(end * ray.direction));
    textureStore(layer, id.xy, vec4f(ambient_or_previous(id.xy, ray) + sum, ray.reach));
    if (LAST) { textureStore(layer_transmittance, id.xy, vec4f(transmittance(optical_length(ray, ray.reach), frame.sigma_t), 1.0)); }
}
