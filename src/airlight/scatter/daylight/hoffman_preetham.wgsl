// Daylight in even air, by Eq. 1 of GPU Gems 3, chapter 13, as published. Source: Hoffman and Preetham 2002.
//! include "scatter/daylight/atmosphere.wgsl"

/// Evaluate the way, m, from the ground to the end of air that is as dense as there up to 8 km, and then ends.
/// Twin: reference/daylight_view.py:way_in_even_air.
fn way_in_even_air(mu: f32) -> f32 {
    let along = GROUND_RADIUS * mu;
    let above = 8000.0 * (2.0 * GROUND_RADIUS + 8000.0);
    let root = sqrt(along * along + above);
    return select(root - along, above / max(root + along, 1.0), along > 0.0);
}

/// Evaluate what an irradiance of 1 adds to a view after a way, m, in even air. cosine: 1 where one looks into the sun; rayleigh, mie: 1/m;
/// g: of the aerosol, whose phase function is as printed, with an integral of (1 - g) / (1 + g), or Henyey and Greenstein's.
/// Twin: reference/daylight_view.py:hoffman_preetham_light.
fn hoffman_preetham_light(cosine: f32, rayleigh: vec3f, mie: vec3f, g: f32, way: f32, printed: bool) -> vec3f {
    let under = max(1.0 + g * g - 2.0 * g * cosine, 1e-12);
    let aerosol = (1.0 - g) * select(1.0 + g, 1.0 - g, printed) / (4.0 * HALF_TURN * under * sqrt(under));
    let scattered = rayleigh * (3.0 / (16.0 * HALF_TURN) * (1.0 + cosine * cosine)) + mie * aerosol;
    return scattered * way * part_left(vec4f((rayleigh + mie) * way, 0.0)).xyz;
}
