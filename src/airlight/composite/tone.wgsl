// Tone curves of scenes: linear radiance to what a display shows, linear.

/// Map by the ACES curve and its desaturation, fitted by Stephen Hill (BakingLab, ACES.hlsl), at the exposure usual with it, 1 / 0.6.
/// Twin: reference/scene.py:filmic.
fn filmic(color: vec3f) -> vec3f {
    let into = mat3x3f(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    let back = mat3x3f(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    let v = into * (clamp(color, vec3f(0.0), vec3f(65504.0)) / 0.6);
    let fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(back * fitted, vec3f(0.0), vec3f(1.0));
}

/// Evaluate a share of Reinhard's curve as a factor of a colour, from its luminance: composite/adapt.py. Twin: reference/scene.py:ramp_gain.
fn ramp_gain(luminance: f32, scale: f32, white: f32, share: f32) -> f32 {
    let y = scale * max(luminance, 0.0);
    return pow(scale * (1.0 + y / (white * white)) / (1.0 + y), share);
}
