// Transmittance of a medium that is the same everywhere (Beer-Lambert), and its integral. sigma_t in 1/m, t in m.

/// Evaluate the transmittance e^(-sigma_t t) over a path of length t. Twin: reference/medium.py:transmittance.
fn transmittance(t: f32, sigma_t: vec3f) -> vec3f {
    return select(exp(-sigma_t * t), vec3f(1.0), sigma_t == vec3f(0.0));
}

/// Evaluate (1 - e^-x) / x, the mean transmittance up to an optical depth x; by its series where the difference has few digits.
/// Twin: reference/medium.py:mean_transmittance.
fn mean_transmittance(x: vec3f) -> vec3f {
    let series = 1.0 - x * (0.5 - x * (0.16666667 - x * (0.041666667 - x * 0.0083333333)));
    return select((1.0 - exp(-x)) / max(x, vec3f(1e-20)), series, x < vec3f(0.25));
}

/// Integrate the transmittance along a path of length t, in m. Twin: reference/medium.py:transmittance_integral.
fn transmittance_integral(t: f32, sigma_t: vec3f) -> vec3f {
    return t * mean_transmittance(sigma_t * t);
}
