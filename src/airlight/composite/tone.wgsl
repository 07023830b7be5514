// View transforms of scenes: linear radiance to what a display shows, linear.

/// Map by the ACES curve and its desaturation, fitted by Stephen Hill (BakingLab, ACES.hlsl), at the exposure usual with it, 1 / 0.6.
/// Twin: reference/tone.py:filmic.
fn filmic(color: vec3f) -> vec3f {
    let into = mat3x3f(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    let back = mat3x3f(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    let v = into * (clamp(color, vec3f(0.0), vec3f(65504.0)) / 0.6);
    let fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(back * fitted, vec3f(0.0), vec3f(1.0));
}

/// Evaluate AgX's sigmoid, slope 2 at (10 / 16.5, 1 / 2), powers 3 below and 3.25 above, of a share of its range of stops (Troy Sobotka, AgX;
/// the form of the curve: Jed Smith). Twin: reference/tone.py:agx_curve.
fn agx_curve(x: f32) -> f32 {
    let off = x - 10.0 / 16.5;
    let power = select(3.25, 3.0, off < 0.0);
    let scale = select(0.5414641561781497, 0.5122773822930714, off < 0.0); // so that it ends at 1, and at 0
    let t = 2.0 * abs(off) / scale;
    return 0.5 + sign(off) * scale * t * pow(1.0 + pow(t, power), -1.0 / power);
}

/// Map by AgX's base look (Troy Sobotka): primaries drawn together, 10 stops below and 6.5 above middle grey through a sigmoid, and back.
/// Linear as a display of gamma 2.2 shows it. Twin: reference/tone.py:agx.
fn agx(color: vec3f) -> vec3f {
    let inset = mat3x3f(0.842479062, 0.042328242, 0.042375655, 0.0784336, 0.878468636, 0.0784336, 0.079223745, 0.079166127, 0.879142974);
    let outset = mat3x3f(1.196879005, -0.052896852, -0.052971636, -0.098020881, 1.15190313, -0.09804345, -0.099029744, -0.098961177, 1.151073673);
    let v = max(inset * clamp(color, vec3f(0.0), vec3f(65504.0)), vec3f(1e-10));
    let x = clamp((log2(v / 0.18) + 10.0) / 16.5, vec3f(0.0), vec3f(1.0));
    let code = outset * vec3f(agx_curve(x.r), agx_curve(x.g), agx_curve(x.b));
    return pow(clamp(code, vec3f(0.0), vec3f(1.0)), vec3f(2.2));
}

/// Find where in a view's table, 0..1 along each axis, a linear colour lies: from 0 to 1024, in stops but near 0.
/// Twin: reference/tone.py:view_coordinate.
fn view_coordinate(color: vec3f) -> vec3f {
    return (log2(clamp(color, vec3f(0.0), vec3f(1024.0)) + exp2(-10.0)) + 10.0) / (log2(1024.0 + exp2(-10.0)) + 10.0);
}

/// Evaluate a share of Reinhard's curve as a factor of a colour, from its luminance: composite/adapt.py. Twin: reference/scene.py:ramp_gain.
fn ramp_gain(luminance: f32, scale: f32, white: f32, share: f32) -> f32 {
    let y = scale * max(luminance, 0.0);
    return pow(scale * (1.0 + y / (white * white)) / (1.0 + y), share);
}
