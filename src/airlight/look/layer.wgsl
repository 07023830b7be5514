// The look as a layer of a linear picture: what is added, white at 1, and the share of the picture that is taken. Twin: lit in
// reference/look.py.
//! include "gpu/half.wgsl"
//! include "look/lit.wgsl"

@group(0) @binding(5) var picture: texture_2d<f32>; // linear
@group(0) @binding(6) var layer: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(64)
fn put(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(picture);
    if (any(id.xy >= size)) { return; }
    let color = max(textureLoad(picture, id.xy, 0).rgb, vec3f(0.0)) * look.scale;
    let change = lit(min(color, vec3f(65504.0)), (vec2f(id.xy) + 0.5) / vec2f(size));
    textureStore(layer, id.xy, vec4f(nearest_half(change.rgb), nearest_half(change.aaa).x));
}
