// Attenuation of punctual lights (glTF, KHR_lights_punctual): irradiance E = I cone^2 window / d^2 at a distance d from one of intensity I.

/// Evaluate the root of a spot's angular falloff, 0..1, from the cosine to its axis. Twin: reference/lights.py:cone_ramp.
fn cone_ramp(cosine: f32, scale: f32, offset: f32) -> f32 {
    return clamp(cosine * scale + offset, 0.0, 1.0);
}

/// Evaluate the attenuation by a light's range, 0..1, d metres from it; range 0: none. Twin: reference/lights.py:range_window.
fn range_window(d: f32, range: f32) -> f32 {
    let q = d / range;
    return select(1.0, max(1.0 - q * q * q * q, 0.0), range > 0.0);
}
