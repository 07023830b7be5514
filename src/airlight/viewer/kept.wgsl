// The last picture, laid on the canvas below the panel; of another size only until there is one of the canvas's.
//! include "wgsl/fullscreen.wgsl"
@group(0) @binding(0) var kept: texture_2d<f32>;
@group(0) @binding(1) var<uniform> ratio: vec4f; // of its pixels to those of the canvas

@fragment
fn lay(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(kept, vec2i(at.xy * ratio.xy), 0);
}
