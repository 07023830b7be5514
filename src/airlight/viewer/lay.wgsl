// A linear picture with the layer that the look makes of it: what is added, and the share that is taken. Twin: look/apply.py:Applied.
//! include "wgsl/half.wgsl"

struct Lay {
    white: f32,               // of the picture
}

@group(0) @binding(0) var<uniform> lay: Lay;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_2d<f32>;
@group(0) @binding(3) var result: texture_storage_2d<rgba16float, write>;

/// Changes a pixel.
@compute @workgroup_size(64)
fn put(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(picture))) { return; }
    let change = textureLoad(layer, id.xy, 0);
    let color = textureLoad(picture, id.xy, 0).rgb;
    textureStore(result, id.xy, vec4f(nearest_half(min(color * (1.0 - change.a) + change.rgb * lay.white, vec3f(65504.0))), 1.0));
}
