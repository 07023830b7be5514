// The picture and its layer before what is seen through is drawn over both, in formats that can be blended onto.
//! include "wgsl/fullscreen.wgsl"
//! include "composite/scene.wgsl"
@group(0) @binding(0) var<uniform> view: SceneUniforms;
@group(0) @binding(7) var<storage, read> balance: array<f32>;

struct Behind {
    @location(0) picture: vec4f,
    @location(1) layer: vec4f,
}

/// Composite a pixel of the picture in its medium.
fn picture_of(p: vec2i) -> vec4f {
    let result = composited(p);
    return vec4f(min(result.rgb, vec3f(65504.0)), select(1.0, textureLoad(scene, p, 0).a, result.a == 0.0));
}

/// Put out a pixel of the picture in its medium, and of the layer: alpha 0, which marks what nothing is blended onto.
@fragment
fn behind(@builtin(position) position: vec4f) -> Behind {
    let p = vec2i(position.xy);
    return Behind(picture_of(p), vec4f(min(textureLoad(aside, p, 0).rgb, vec3f(65504.0)), 0.0));
}

/// Put out a pixel of the picture alone, where the layer is blended onto as it is.
@fragment
fn picture_behind(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return picture_of(vec2i(position.xy));
}
