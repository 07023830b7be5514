// The look put on an 8-bit sRGB picture: dithered where something changes. Twins: put in reference/look.py, encode_codes in files/colour.py.
// A pixel's code changes by the difference of two encodings, both by a curve that costs but roots: where it is wrong it is so in both,
// so that a change is right to 1 %, and a pixel that does not change keeps its code.
//! include "look/put.wgsl"
const STILL = 1e-3;           // of a code: a change that is none

struct Onto {
    @builtin(position) place: vec4f,
}

@group(0) @binding(3) var picture: texture_2d<f32>; // codes
@group(0) @binding(4) var noise: texture_2d<f32>; // in (0, 1), a tile

/// About srgb_decode, t^2.4 by two roots: to 0.3 %, and 0.0008 at black.
fn about_decoded(code: vec3f) -> vec3f {
    let t = (code + 0.055) / 1.055;
    let root = sqrt(t);
    return t * t * (0.54676 * root + 0.52013 * sqrt(root) - 0.06689);
}

/// About srgb_encode, by three roots: to 0.0012, its slope to 0.5 %.
fn about_encoded(linear: vec3f) -> vec3f {
    let root = sqrt(linear);
    let fourth = sqrt(root);
    let curved = 1.055 * (0.54277 * root + 0.78619 * fourth - 0.39682 * sqrt(fourth)) + 0.01659;
    return select(curved, 12.92 * linear, linear < vec3f(0.0031308));
}

@vertex
fn cover(@builtin(vertex_index) i: u32) -> Onto {
    return Onto(vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0));
}

@fragment
fn put(onto: Onto) -> @location(0) vec4f {
    let p = vec2u(onto.place.xy);
    let before = textureLoad(picture, p, 0);
    let color = about_decoded(before.rgb);
    let change = changed(color, onto.place.xy / vec2f(textureDimensions(picture)));
    let rise = 255.0 * (about_encoded(max(color * (1.0 - change.a) + change.rgb, vec3f(0.0))) - about_encoded(color));
    let code = 255.0 * before.rgb;
    let grain = textureLoad(noise, p & vec2u(255u), 0).rgb;
    let after = clamp(floor(code + rise + grain), vec3f(0.0), max(code, vec3f(254.0)));
    return vec4f(select(after / 255.0, before.rgb, abs(rise) < vec3f(STILL)), before.a);
}
