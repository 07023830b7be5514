// The look as a layer of a linear picture: what is added, white at 1, and the share of the picture that is taken.
// Twin: reference/look.py:put.
//! include "wgsl/half.wgsl"
//! include "look/put.wgsl"

struct Scaled {
    scale: f32,               // 1 / white
}

@group(0) @binding(3) var picture: texture_2d<f32>; // linear
@group(0) @binding(4) var<uniform> scaled: Scaled;
@group(0) @binding(5) var layer: texture_storage_2d<rgba16float, write>;

/// Writes what a pixel is given, and the share of it that is taken.
@compute @workgroup_size(64)
fn put(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(picture);
    if (any(id.xy >= size)) { return; }
    let color = clamp(textureLoad(picture, id.xy, 0).rgb * scaled.scale, vec3f(0.0), vec3f(65504.0));
    let change = changed(color, (vec2f(id.xy) + 0.5) / vec2f(size));
    textureStore(layer, id.xy, vec4f(nearest_half(change.rgb), nearest_half(change.aaa).x));
}
