// The phase functions of daylight's air, 1/sr, both at once. Source: Cornette and Shanks 1992.

/// Evaluate the phase functions of Rayleigh's air and of the aerosol, 1/sr, between unit vectors. g: the aerosol's anisotropy.
/// Twin: reference/daylight_view.py:air_phases.
fn air_phases(a: vec3f, b: vec3f, g: f32) -> vec2f {
    let apart = 0.5 * vec2f(dot(a - b, a - b), dot(a + b, a + b)); // 1 - cosine, 1 + cosine, with every digit
    let cosine = 0.5 * (apart.y - apart.x);
    let off = 1.0 - abs(g);
    let under = off * off + 2.0 * abs(g) * select(apart.x, apart.y, g < 0.0);
    let turned = 1.0 + cosine * cosine;
    let near = inverseSqrt(under);
    return vec2f(1.0, 2.0 * off * (1.0 + abs(g)) / (2.0 + g * g) * near * near * near) * turned * (3.0 / (16.0 * 3.14159265358979));
}
