// A picture of sRGB codes, averaged as such: within the few pixels of a mean that is linear light to less than what emission notices.
@group(0) @binding(4) var picture_codes: texture_2d<f32>;

/// Approximates linear light of sRGB codes, t^2.4 by two roots: to 0.3 %, and 0.0008 at black.
/// Twin: reference/rays.py:approximate_srgb_decode.
fn approximate_srgb_decode(code: vec3f) -> vec3f {
    let t = (code + 0.055) / 1.055;
    let root = sqrt(t);
    return t * t * (0.54676 * root + 0.52013 * sqrt(root) - 0.06689);
}

/// Averages the codes about a pixel of the copy, and decodes the mean.
fn mean_color(p: vec2u, size: vec2u) -> vec3f {
    var sum = vec3f(0.0);
    for (var j = 0u; j < TAPS; j++) {
        for (var i = 0u; i < TAPS; i++) {
            let at = vec2f(p) + (vec2f(f32(i), f32(j)) + 0.5) / f32(TAPS);
            sum += textureSampleLevel(picture_codes, bilinear, at / vec2f(size), 0.0).rgb;
        }
    }
    return approximate_srgb_decode(sum / f32(TAPS * TAPS));
}

//! include "look/matte.wgsl"
