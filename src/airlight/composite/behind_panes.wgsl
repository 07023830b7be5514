// The picture and its layer before what is seen through is drawn over both, as half floats, which can be blended onto; and the layer after that.
//! include "composite/scene.wgsl"
@group(0) @binding(0) var<uniform> view: SceneUniforms;
@group(0) @binding(7) var<storage, read> balance: array<f32>;
@group(0) @binding(9) var picture: texture_storage_2d<rgba16float, write>;
@group(0) @binding(10) var blended: texture_storage_2d<rgba16float, write>;

/// Write a pixel of the picture in its medium, and of the layer: alpha 0, which marks what nothing is blended onto.
@compute @workgroup_size(8, 8)
fn behind(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(scene))) { return; }
    let p = vec2i(id.xy);
    let result = composited(p);
    textureStore(picture, p, vec4f(min(result.rgb, vec3f(65504.0)), select(1.0, textureLoad(scene, p, 0).a, result.a == 0.0)));
    textureStore(blended, p, vec4f(min(textureLoad(aside, p, 0).rgb, vec3f(65504.0)), 0.0));
}
