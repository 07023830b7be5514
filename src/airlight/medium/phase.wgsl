// Phase functions, 1/sr, normalised over the sphere. Convention: the cosine is 1 where one looks into the light, so that g > 0 scatters
// forward. `apart` = (1 - cosine, 1 + cosine) has every digit where a peak is narrow. Sources: Henyey and Greenstein 1941; Cornette and
// Shanks 1992.
override PHASE: u32 = 0u;       // one of these, as PHASES of resolve.py

const HENYEY_GREENSTEIN = 0u;
const ISOTROPIC = 2u;
const RAYLEIGH = 3u;
const CORNETTE_SHANKS = 4u;
const PI = 3.14159265358979;

/// Evaluate the phase function of a cosine. lobes: g, g of the second lobe, its share. Twin: reference/medium.py:phase.
fn phase(cosine: f32, lobes: vec3f) -> f32 {
    return phase_apart(vec2f(1.0 - cosine, 1.0 + cosine), lobes);
}

/// Evaluate the phase function between unit vectors, with every digit where they lie close together.
/// Twin: reference/medium.py:phase_between.
fn phase_between(a: vec3f, b: vec3f, lobes: vec3f) -> f32 {
    return phase_apart(0.5 * vec2f(dot(a - b, a - b), dot(a + b, a + b)), lobes);
}

/// Evaluate the phase function of (1 - cosine, 1 + cosine). Twin: reference/medium.py:phase_apart.
fn phase_apart(apart: vec2f, lobes: vec3f) -> f32 {
    if (PHASE == ISOTROPIC) { return 1.0 / (4.0 * PI); }
    let cosine = 0.5 * (apart.y - apart.x);
    if (PHASE == RAYLEIGH) { return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine); }
    let g = lobes.x;
    let first = henyey_greenstein(apart, g);
    if (PHASE == CORNETTE_SHANKS) { return 1.5 * first * (1.0 + cosine * cosine) / (2.0 + g * g); }
    if (PHASE == HENYEY_GREENSTEIN) { return first; }
    return mix(first, henyey_greenstein(apart, lobes.y), lobes.z);
}

/// Evaluate the Henyey-Greenstein phase function of (1 - cosine, 1 + cosine). Twin: reference/medium.py:henyey_greenstein.
fn henyey_greenstein(apart: vec2f, g: f32) -> f32 {
    let off = 1.0 - abs(g);
    let under = off * off + 2.0 * abs(g) * select(apart.x, apart.y, g < 0.0); // 1 + g^2 - 2 g cosine
    return off * (1.0 + abs(g)) / (4.0 * PI * under * sqrt(under));
}

/// Evaluate the lobe of a glow around a light, 1/sr, between unit vectors: falling by e^(-kappa (1 - cosine)), its integral over the sphere 1
/// (Fisher 1953). Twin: reference/medium.py:glow_between.
fn glow_between(a: vec3f, b: vec3f, kappa: f32) -> f32 {
    return kappa * exp(-0.5 * kappa * dot(a - b, a - b)) / (2.0 * PI * (1.0 - exp(-2.0 * kappa)));
}
