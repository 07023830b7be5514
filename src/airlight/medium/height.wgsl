// Density of a medium that depends on height alone: 1 up to the fog's base, above it falling exponentially, or along a ramp to what is left.
// Its integrals are closed. Heights are in m above the base; layer: (depth in m, density above the ramp). In exponential fog,
//
//     integral of rho over a path of length d from height a to height b = d * mean of rho between a and b
//
// is summed from the denser end, so that nothing overflows, and a level path has no case of its own.
//! include "medium/transmittance.wgsl"
override FOG: u32 = 0u;         // one of these, as FOGS of resolve.py

const EVEN = 0u;
const EXPONENTIAL = 1u;
const LINEAR = 2u;
const FOG_BANDS = 9u;
const FAR = 1e15;               // of the fog's depth: beyond all that is seen

/// Evaluate the density at a height. Twin: reference/height.py:height_density.
fn height_density(y: f32, layer: vec2f) -> f32 {
    if (FOG == EXPONENTIAL) { return exp(-max(y, 0.0) / layer.x); }
    return mix(1.0, layer.y, clamp(y / layer.x, 0.0, 1.0));
}

/// Average the density over the heights between two. Twin: reference/height.py:mean_height_density.
fn mean_height_density(a: f32, b: f32, layer: vec2f) -> f32 {
    let low = min(a, b);
    let high = max(a, b);
    let span = max(high - low, 1e-30);
    let below = clamp(-low / span, 0.0, 1.0);
    if (FOG == EXPONENTIAL) {
        let start = max(low, 0.0);
        let thinned = exp(-start / layer.x) * mean_transmittance(vec3f((max(high, 0.0) - start) / layer.x)).x;
        return below + (1.0 - below) * thinned;
    }
    let above = clamp((high - layer.x) / span, 0.0, 1.0);
    let middle = 0.5 * (clamp(low, 0.0, layer.x) + clamp(high, 0.0, layer.x)) / layer.x;
    return below + max(1.0 - below - above, 0.0) * mix(1.0, layer.y, middle) + above * layer.y;
}

/// Integrate over all heights above one, m, what the density is more than high up. Twin: reference/height.py:height_column.
fn height_column(y: f32, layer: vec2f) -> f32 {
    let below = max(-y, 0.0);
    if (FOG == EXPONENTIAL) { return below + layer.x * exp(-max(y, 0.0) / layer.x); }
    let left = 1.0 - clamp(y / layer.x, 0.0, 1.0);
    return (1.0 - layer.y) * (below + 0.5 * layer.x * left * left);
}

/// Bound the k-th of FOG_BANDS bands of heights, in each of which the density is smooth, and varies by a factor of e^3 at most until it is
/// next to nothing. Twin: reference/height.py:height_band.
fn height_band(k: u32, layer: vec2f) -> vec2f {
    if (FOG == EXPONENTIAL) {
        var depths = array<f32, 10>(-FAR, 0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 11.0, 14.0, FAR);
        return layer.x * vec2f(depths[k], depths[k + 1u]);
    }
    var depths = array<f32, 10>(-FAR, 0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 1.0, FAR);
    return layer.x * vec2f(depths[k], depths[k + 1u]);
}

