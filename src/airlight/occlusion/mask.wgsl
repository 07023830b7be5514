// The light that a pixel emits: its colour, and m in [0, 1] from luminance, alpha or depth (GPU Gems 3, 13.5), times a mask.
//! include "wgsl/srgb.wgsl"
//! include "wgsl/smooth_step.wgsl"
override MODE: u32 = 0u;      // 0 none, 1 luminance, 2 alpha, 3 depth, 4 contrast
override CODES: bool = false; // the picture holds sRGB codes

struct Knee {
    low: f32,                 // m rises smoothly from low to high
    high: f32,
    scale: f32,               // power of two that keeps the source in half floats
    apron: i32,               // texels of nothing around the source
    masked: u32,
    luminance: vec3f,         // weights of the luminance of the picture's RGB
}

@group(0) @binding(0) var<uniform> knee: Knee;
@group(0) @binding(1) var picture: texture_2d<f32>; // RGB, alpha
@group(0) @binding(2) var aside: texture_2d<f32>;   // r: mask, g: depth

/// Rises from 0 to 1 over the knee; a step where it has no width. Twin: reference/radial.py:soft_threshold.
fn soft_threshold(x: f32) -> f32 {
    if (knee.high <= knee.low) {
        return select(0.0, 1.0, x >= knee.low);
    }
    return smooth_step(x, knee.low, knee.high);
}

/// Weighs the picture's RGB to luminance. Twin: reference/radial.py:picture_luminance.
fn picture_luminance(c: vec3f) -> f32 {
    return dot(c, knee.luminance);
}

/// Reads a pixel of the picture: its linear RGB, and m.
fn emitter_at(p: vec2i) -> vec4f {
    let pixel = textureLoad(picture, p, 0);
    var color = clamp(pixel.rgb, vec3f(0.0), vec3f(65504.0));
    if (CODES) { color = srgb_decode(color); }
    var m = 1.0;
    if (MODE == 1u || MODE == 4u) { m = soft_threshold(picture_luminance(color)); }
    if (MODE == 2u) { m = 1.0 - clamp(pixel.a, 0.0, 1.0); color = vec3f(1.0); }
    if (MODE == 3u) { m = soft_threshold(textureLoad(aside, p, 0).g); }
    if (knee.masked == 1u) { m *= textureLoad(aside, p, 0).r; }
    return vec4f(color, m);
}
