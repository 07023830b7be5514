// Upsampling of a smaller march, and of nothing else.
//! include "scatter/march/upsampling.wgsl"
const MARKS = false;

/// Note how unsure a pixel is: not here.
fn mark(pixel: vec2u, error: f32) {}
