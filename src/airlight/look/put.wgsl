// Fits the change at a pixel to what the pixel has: what is given, and what is taken.
//! include "wgsl/luminance.wgsl"
override NEAR_GIVEN: bool = false; // how near things are is known at every pixel
const WHITE = 0.9911;
const TINT = 0.5;

@group(0) @binding(0) var field: texture_2d<f32>;  // the light that comes in, RGB; the share that is taken, below 0 given
@group(0) @binding(1) var near: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;

/// Reads the change of the field at texture coordinates, and bounds it so that no channel of the pixel passes WHITE.
/// Twin: reference/look.py:put.
fn changed(color: vec3f, uv: vec2f) -> vec4f {
    var change = textureSampleLevel(field, bilinear, uv, 0.0);
    if (NEAR_GIVEN) { change *= 1.0 - textureSampleLevel(near, bilinear, uv, 0.0).r; }
    let taken = max(change.a, 0.0);
    let tint = change.rgb / max(luminance(change.rgb), 1e-9);
    let given = change.rgb + max(-change.a, 0.0) * color * (1.0 - TINT + TINT * tint);
    let room = WHITE - color * (1.0 - taken);
    let fits = room / max(room + given, vec3f(1e-6));
    return vec4f(given * max(min(fits.r, min(fits.g, fits.b)), 0.0), taken);
}
