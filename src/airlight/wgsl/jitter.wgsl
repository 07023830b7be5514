// Offsets of a pixel's samples in their steps. Whoever includes this declares `noise`.
override JITTER: u32 = 0u;      // 0 fixed, 1 midpoint, 2 interleaved gradient, 3 blue noise

/// Computes interleaved gradient noise of a pixel, 0..1 (Jimenez 2014, "Next generation post processing in Call of Duty: Advanced
/// Warfare"). Twin: reference/jitter.py:interleaved_gradient_noise.
fn interleaved_gradient_noise(p: vec2u) -> f32 {
    return fract(52.9829189 * fract(dot(vec2f(p) + 0.5, vec2f(0.06711056, 0.00583715))));
}

/// Chooses a pixel's offset, 0..1 of a step.
fn offset(p: vec2u) -> f32 {
    switch JITTER {
        case 1u: { return 0.5; }
        case 2u: { return interleaved_gradient_noise(p); }
        case 3u: { return textureLoad(noise, p % textureDimensions(noise), 0).r; }
        default: { return 0.0; }
    }
}
