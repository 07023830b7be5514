// The exact texel walk.
//! include "scatter/march/ray.wgsl"
override BIASED: bool = false;  // shadows begin farther behind what hides the light

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
}
