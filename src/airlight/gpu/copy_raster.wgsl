// Copies an rgba16f image by drawing, one tap a pixel, beside the kernels of copy.wgsl.
//! include "wgsl/fullscreen.wgsl"

@group(0) @binding(0) var source: texture_2d<f32>;

/// Copies a pixel.
@fragment
fn copy(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return textureLoad(source, vec2u(position.xy), 0);
}
