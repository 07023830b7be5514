// Look-ups of shadow maps at a sample of a ray, and their filters: the nearest texel; percentage-closer filtering (Reeves et al. 1987);
// percentage-closer soft shadows (Fernando 2005); or variance shadow maps (Donnelly and Lauritzen 2006).
//! include "scatter/march/ranges.wgsl"
//! include "scatter/march/variance.wgsl"
//! include "wgsl/unit_at.wgsl"
override FILTER: u32 = 0u;      // one of these, as FILTERS of march.py
override SNAP: bool = false;    // look-ups at the centres of texels

const NEAREST = 0u;
const PCF = 1u;
const VARIANCE = 3u;
const PCSS_TAPS = 12.0;         // of a soft look-up, and of its search for occluders
const MAX_FILTER_RADIUS = 24.0; // texels
const GOLDEN_ANGLE = 2.3999632; // radians

/// Test a depth against view i's texel: 1 where that hides nothing from it; outside the map everything is lit.
fn shadow_test(i: u32, texel: vec2f, depth: f32) -> f32 {
    let within = clamp(texel, vec2f(0.0), vec2f(light.side - 1.0));
    return f32(depth >= shadow_depth(i, within) || any(within != texel));
}

/// Read the depth from which on a texel of view i is lit.
fn shadow_depth(i: u32, texel: vec2f) -> f32 {
    return biased_occluder_depth(textureLoad(shadow, vec2i(texel), i, 0), depth_bias(i));
}

/// Filter the tests of 2 x 2 texels by their nearness to a position (Reeves et al. 1987).
fn pcf(i: u32, position: vec2f, depth: f32) -> f32 {
    let base = floor(position - 0.5);
    let part = position - 0.5 - base;
    let top = mix(shadow_test(i, base, depth), shadow_test(i, base + vec2f(1.0, 0.0), depth), part.x);
    let bottom = mix(shadow_test(i, base + vec2f(0.0, 1.0), depth), shadow_test(i, base + 1.0, depth), part.x);
    return mix(top, bottom, part.y);
}

/// Place the k-th of PCSS_TAPS points on the unit disc, turned by a part of a full turn (Vogel 1979). Twin: reference/march.py:vogel_disc.
fn vogel_disc(k: f32, turn: f32) -> vec2f {
    return sqrt((k + 0.5) / PCSS_TAPS) * unit_at(GOLDEN_ANGLE * k + 2.0 * PI * turn);
}

/// Estimate the share of a directional light's disc that is seen past occluders as far away as they are on the mean (Fernando 2005).
fn pcss(i: u32, position: vec2f, depth: f32, turn: f32) -> f32 {
    // Search for occluders where the disc's cone may meet any
    let metres = light.view[i].depth_scale;
    let widest = clamp(light.disc_tangent * (1.0 - depth) * metres / light.view[i].texel, 1.0, MAX_FILTER_RADIUS);
    var hidden = vec2f(0.0); // sum of distances to occluders, their number
    for (var k = 0.0; k < PCSS_TAPS; k += 1.0) {
        let occluder = shadow_depth(i, clamp(position + widest * vogel_disc(k, turn), vec2f(0.0), vec2f(light.side - 1.0)));
        hidden += select(vec2f(0.0), vec2f(occluder - depth, 1.0), occluder > depth);
    }
    // Filter over the penumbra of their mean distance
    let radius = clamp(light.disc_tangent * hidden.x / max(hidden.y, 1.0) * metres / light.view[i].texel, 0.0, MAX_FILTER_RADIUS);
    var sum = 0.0;
    for (var k = 0.0; k < PCSS_TAPS; k += 1.0) { sum += shadow_test(i, position + radius * vogel_disc(k, turn), depth); }
    return sum / PCSS_TAPS;
}

/// Look up the share of the light that view i lets through to a position of its map.
fn visibility(i: u32, position: vec2f, depth: f32, turn: f32) -> f32 {
    if (FILTER == NEAREST) { return shadow_test(i, floor(position), depth); }
    let at = select(position, floor(position) + 0.5, SNAP);
    if (FILTER == VARIANCE) { return variance_visibility(i, at, depth); }
    if (FILTER == PCF || !DIRECTIONAL) { return pcf(i, at, depth); }
    return pcss(i, at, depth, turn);
}

/// Weigh the cascade after one from near to far, at `ahead` metres along the camera's axis: 0 before the part over which they blend.
/// Twin: reference/march.py:cascade_weight.
fn cascade_weight(ahead: f32, near: f32, far: f32, blend: f32) -> f32 {
    return clamp(1.0 - (far - ahead) / max(blend * (far - near), 1e-20), 0.0, 1.0);
}
