// The guide of joint bilateral filters (Kopf et al. 2007) over a march: the lengths of rays, by which neighbours are told from what lies
// before or behind them.

/// Compute the difference of two lengths, relative to the shorter one. Twin: reference/march.py:relative_difference.
fn relative_difference(a: f32, b: f32) -> f32 {
    return abs(a - b) / max(min(a, b), 1e-6);
}
