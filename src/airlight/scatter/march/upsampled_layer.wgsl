// The layer and the transmittance of the picture, from a march at a part of its size. Whoever includes this says what upsampling.wgsl asks for.
//! include "scatter/march/upsampling.wgsl"
@group(0) @binding(6) var layer_transmittance: texture_storage_2d<rgba32float, write>;

/// Write a pixel of the layer, and its transmittance.
fn put_upsampled(pixel: vec2u, ray: Ray, own: f32, color: vec4f) {
    textureStore(layer, pixel, vec4f(color.rgb, ray.reach));
    let whole = max(own + select(0.0, color.a, VARIES), 0.0);
    textureStore(layer_transmittance, pixel, vec4f(transmittance(whole, frame.sigma_t), 1.0));
}

/// Upsample the pixels between four of what was marched.
@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy > frame.size)) { return; }
    upsample_between(id.xy);
}

/// Settle a pixel of a march of the picture's own size through a density that varies: its ray's length, and its transmittance.
@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    let ray = camera_ray_at(id.xy);
    let found = textureLoad(before, id.xy, 0);
    textureStore(layer, id.xy, vec4f(found.rgb, ray.reach));
    let whole = max(optical_length(ray, ray.reach) + found.a, 0.0);
    textureStore(layer_transmittance, id.xy, vec4f(transmittance(whole, frame.sigma_t), 1.0));
}
