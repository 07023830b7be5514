// Visibility by mean and variance of the depths around a place of a shadow map: Chebyshev's inequality bounds the share of them behind which
// a receiver does not lie (Donnelly and Lauritzen 2006). Depths fall with the distance from the light.
@group(0) @binding(14) var moments: texture_2d_array<f32>; // mean, variance: moments.wgsl

/// Move the depth of a receiver towards the light by the bias. Twin: reference/variance.py:biased_receiver_depth.
fn biased_receiver_depth(depth: f32, bias: f32) -> f32 {
    if (DIRECTIONAL) { return depth + bias; }
    return depth / max(1.0 - bias * depth, 1e-6);
}

/// Mix two distributions, each a mean and a variance, by a part of the second. Twin: reference/variance.py:mix_moments.
fn mix_moments(a: vec2f, b: vec2f, part: f32) -> vec2f {
    return mix(a, b, part) + vec2f(0.0, part * (1.0 - part) * (a.x - b.x) * (a.x - b.x));
}

/// Bound the share of a distribution of depths at or behind a receiver: 1 before the mean. Twin: reference/variance.py:chebyshev_bound.
fn chebyshev_bound(found: vec2f, depth: f32) -> f32 {
    let off = found.x - depth;
    return select(found.y / max(found.y + off * off, 1e-30), 1.0, off <= 0.0);
}

/// Cut the lowest visibilities off, and stretch the others over 0 to 1 (Lauritzen, GPU Gems 3, ch. 8).
/// Twin: reference/variance.py:cut_leaks.
fn cut_leaks(share: f32, cut: f32) -> f32 {
    return clamp((share - cut) / (1.0 - cut), 0.0, 1.0);
}

/// Read the moments of view i around a texel.
fn moments_at(i: u32, texel: vec2f) -> vec2f {
    return textureLoad(moments, vec2i(clamp(texel, vec2f(0.0), vec2f(light.side - 1.0))), i, 0).rg;
}

/// Look up the share of the light that the distribution of depths around a position lets through; outside the map everything is lit.
fn variance_visibility(i: u32, position: vec2f, depth: f32) -> f32 {
    let base = floor(position - 0.5);
    let part = position - 0.5 - base;
    let top = mix_moments(moments_at(i, base), moments_at(i, base + vec2f(1.0, 0.0)), part.x);
    let bottom = mix_moments(moments_at(i, base + vec2f(0.0, 1.0)), moments_at(i, base + 1.0), part.x);
    let bound = chebyshev_bound(mix_moments(top, bottom, part.y), biased_receiver_depth(max(depth, 0.0), depth_bias(i)));
    let inside = all(position >= vec2f(0.0)) && all(position <= vec2f(light.side));
    return select(1.0, cut_leaks(bound, frame.variance_cut), inside);
}
