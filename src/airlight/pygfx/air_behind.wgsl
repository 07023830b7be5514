// Puts the air's layer on the picture of a scene, for methods that sum the picture's own light: they find it as it is seen through the air.
//! include "composite/medium.wgsl"
@group(0) @binding(0) var scene: texture_2d<f32>;
@group(0) @binding(1) var radiance: texture_2d<f32>;
@group(0) @binding(2) var through: texture_2d<f32>;
@group(0) @binding(3) var seen: texture_storage_2d<rgba16float, write>;

const MOST = 65504.0;           // that a half float holds

/// Compose a pixel.
@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(scene))) { return; }
    let pixel = textureLoad(scene, id.xy, 0);
    let left = textureLoad(through, id.xy, 0).rgb;
    let color = through_medium(pixel.rgb, left, textureLoad(radiance, id.xy, 0).rgb, 1.0);
    textureStore(seen, id.xy, vec4f(min(color, vec3f(MOST)), pixel.a));
}
