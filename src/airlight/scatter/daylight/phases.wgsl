// The phase function of the aerosol of daylight's air, 1/sr. Source: Cornette and Shanks 1992.

/// Evaluate the phase function of the aerosol, 1/sr. cosine, sine2: of the angle between ray and sun, and its sine squared, with every digit near
/// the sun; g: the aerosol's anisotropy. Twin: reference/daylight_view.py:aerosol_phase.
fn aerosol_phase(cosine: f32, sine2: f32, g: f32) -> f32 {
    let to_peak = cosine * sign(g);
    let apart = select(1.0 - to_peak, sine2 / (1.0 + to_peak), to_peak > 0.0);
    let off = 1.0 - abs(g);
    let near = inverseSqrt(off * off + 2.0 * abs(g) * apart);
    return (3.0 / (8.0 * 3.14159265358979)) * off * (1.0 + abs(g)) / (2.0 + g * g) * (1.0 + cosine * cosine) * near * near * near;
}
