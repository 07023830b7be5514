/// Rises from 0 at `low` to 1 at `high` by 3t^2 - 2t^3; WGSL's own is undefined where low > high. Twin: reference/colour.py:smooth_step.
fn smooth_step(x: f32, low: f32, high: f32) -> f32 {
    let t = clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}
