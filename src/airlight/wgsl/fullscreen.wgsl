// The vertex stage of passes that draw on every pixel: one triangle, twice as wide and high as the target.

/// Places corner i of 3 in clip space. Twin: reference/raster.py:fullscreen_corner.
fn fullscreen_corner(i: u32, depth: f32) -> vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, depth, 1.0);
}

/// Covers the target.
@vertex
fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return fullscreen_corner(i, 0.0);
}
