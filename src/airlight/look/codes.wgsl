// The look put on an 8-bit sRGB picture: dithered where something changes. Twin: reference/look.py:put. Twin: colour.py:encode_codes.
// The root of linear light is nearly straight in the code: a polynomial gives it to 1.5 %, and two steps of Newton's method from a
// pixel's own code find the code of another light. So a pixel that does not change keeps its code, whatever the polynomial's error.
//! include "wgsl/fullscreen.wgsl"
//! include "look/put.wgsl"
const STILL = 1e-3;           // of a code: a change that is none

@group(0) @binding(3) var picture: texture_2d<f32>; // codes
@group(0) @binding(4) var noise: texture_2d<f32>; // a tile of 256 x 256

/// Approximates the square root of the linear light of a code, t = (code + 0.055) / 1.055. Twin: reference/rays.py:linear_root.
fn linear_root(t: vec3f) -> vec3f {
    return -0.00357 + t * (0.58482 + t * (0.9226 + t * (-0.80355 + 0.2997 * t)));
}

/// Differentiates `linear_root`. Twin: reference/rays.py:linear_root_slope.
fn linear_root_slope(t: vec3f) -> vec3f {
    return 0.58482 + t * (1.8452 + t * (-2.41065 + 1.1988 * t));
}

/// Puts the look on a pixel: decodes its sRGB code, changes its light, and encodes that with dither where it has changed.
@fragment
fn put(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let p = vec2u(position.xy);
    let before = textureLoad(picture, p, 0);
    let t = (before.rgb + 0.055) / 1.055;
    let root = max(linear_root(t), vec3f(0.0));
    let color = root * root;
    let change = changed(color, position.xy / vec2f(textureDimensions(picture)));
    let wanted = sqrt(max(color * (1.0 - change.a) + change.rgb, vec3f(0.0)));
    let first_guess = clamp(t + (wanted - root) / linear_root_slope(t), vec3f(0.0521), vec3f(1.0));
    let found = first_guess + (wanted - linear_root(first_guess)) / linear_root_slope(first_guess);
    let rise = select(255.0 * 1.055 * (found - t), vec3f(0.0), wanted == root);
    let code = 255.0 * before.rgb;
    let grain = (255.0 * textureLoad(noise, p & vec2u(255u), 0).rgb + 0.5) / 256.0;
    let after = clamp(floor(code + rise + grain), vec3f(0.0), max(code, vec3f(254.0)));
    return vec4f(select(after / 255.0, before.rgb, abs(rise) < vec3f(STILL)), before.a);
}
