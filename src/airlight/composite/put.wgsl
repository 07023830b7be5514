// A layer made ready to be added to a picture, linear.
//! include "wgsl/luminance.wgsl"
const WHITE = 0.9911;         // code 254

/// Takes the even haze from a layer: color t / (t + floor), t = (luminance / peak)^4. peak: luminance of the brightest shafts; floor:
/// fourth power of the haze's share of it. Twin: reference/colour.py:subtract_haze.
fn subtract_haze(color: vec3f, peak: f32, floor: f32) -> vec3f {
    let q = min(luminance(color) / peak, 1e4);
    let t = q * q * q * q;
    return color * (t / max(t + floor, 1e-30));
}

/// Screens a layer over a picture, which stays below white: what is added. Twin: reference/colour.py:screened.
fn screened(before: vec3f, added: vec3f) -> vec3f {
    return max(WHITE - before, vec3f(0.0)) * (added / (1.0 + added));
}
