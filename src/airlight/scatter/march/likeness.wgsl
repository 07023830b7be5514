// The guide of joint bilateral filters (Kopf et al. 2007) over a march: the lengths of rays, by which neighbours are told from what lies
// before or behind them.

/// Compute the difference of two lengths, relative to the shorter one. Twin: reference/march.py:relative_difference.
fn relative_difference(a: f32, b: f32) -> f32 {
    return abs(a - b) / max(min(a, b), 1e-6);
}

/// Find the length of the ray of a pixel of what is computed, of its layer: where density varies that holds something else.
fn length_of(q: vec2i, found: vec4f) -> f32 {
    if (!VARIES) { return found.a; }
    return camera_ray(vec2u(clamp(q, vec2i(0), vec2i(frame.size) - 1))).reach;
}
