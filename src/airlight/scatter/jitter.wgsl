// Where in its step a pixel's samples lie. Whoever includes this declares `noise`.
override JITTER: u32 = 0u;      // 0 fixed, 1 midpoint, 2 interleaved gradient, 3 blue noise

/// 0..1
fn offset(p: vec2u) -> f32 {
    switch JITTER {
        case 1u: { return 0.5; }
        // Jimenez 2014, "Next generation post processing in Call of Duty: Advanced Warfare"
        case 2u: { return fract(52.9829189 * fract(dot(vec2f(p) + 0.5, vec2f(0.06711056, 0.00583715)))); }
        case 3u: { return textureLoad(noise, p % textureDimensions(noise), 0).r; }
        default: { return 0.0; }
    }
}
