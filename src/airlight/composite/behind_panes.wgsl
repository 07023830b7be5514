// The picture and its layer before what is seen through is drawn over both, in formats that can be blended onto.
//! include "wgsl/fullscreen.wgsl"
//! include "composite/scene.wgsl"
@group(0) @binding(0) var<uniform> view: SceneUniforms;
@group(0) @binding(7) var<storage, read> balance: array<f32>;

struct Behind {
    @location(0) picture: vec4f,
    @location(1) layer: vec4f,
}

/// Put out a pixel of the picture in its medium, and of the layer: alpha 0, which marks what nothing is blended onto.
@fragment
fn behind(@builtin(position) position: vec4f) -> Behind {
    let p = vec2i(position.xy);
    let result = composited(p);
    let alpha = select(1.0, textureLoad(scene, p, 0).a, result.a == 0.0);
    return Behind(vec4f(min(result.rgb, vec3f(65504.0)), alpha), vec4f(min(textureLoad(aside, p, 0).rgb, vec3f(65504.0)), 0.0));
}
