// Transmittance of the rays of a march at the size of the picture: T = e^(-sigma_t l), l their optical lengths (Beer and Lambert). A pass of its
// own, since as a second store of the walk it made the whole walk a twelfth slower on software Vulkan.
//! include "scatter/march/ray.wgsl"

/// Write the transmittance of a pixel's ray into `layer`.
@compute @workgroup_size(8, 8)
fn transmit(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    let ray = camera_ray_at(id.xy);
    textureStore(layer, id.xy, vec4f(transmittance(optical_length(ray, ray.reach), frame.sigma_t), 1.0));
}
