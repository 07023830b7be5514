// Upsampling of a smaller march, and of nothing else: see upsampling.wgsl.
const MARKS = false;
var<private> largest_error: f32; // of radiance, of the pixels that were noted

/// Note how unsure a pixel is: by `error` of radiance. It is marched no more.
fn mark(pixel: vec2u, error: f32) {
    largest_error = max(largest_error, error);
}
