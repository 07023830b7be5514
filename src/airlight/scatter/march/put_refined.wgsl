// Puts what was marched for a list of pixels on the picture.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/chosen.wgsl"

/// Write a pixel of the list: its radiance, and its ray's length.
@compute @workgroup_size(8, 8)
fn put(@builtin(global_invocation_id) id: vec3u) {
    if (id.y * LIST_COLUMNS + id.x >= chosen[0]) { return; }
    let pixel = marched_pixel(id.xy);
    textureStore(layer, pixel, vec4f(textureLoad(before, id.xy, 0).rgb, camera_ray_at(pixel).reach));
}
