// Upsampling of a smaller march, which marks the pixels that are to be marched by themselves: see refine.wgsl.
//! include "scatter/march/upsampled_layer.wgsl"
//! include "scatter/march/marks.wgsl"
@group(0) @binding(7) var<storage, read_write> marks: Marks;
const MARKS = true;

/// Note how unsure a pixel is: by `error` of radiance.
fn mark(pixel: vec2u, error: f32) {
    let relative = error / max(marks.mean, 1e-30);
    if (!(relative >= frame.refine)) { return; }
    let capacity = arrayLength(&marks.pixels) / BINS;
    let bin = error_bin(relative);
    let at = atomicAdd(&marks.counts[bin], 1u);
    if (at < capacity) { marks.pixels[bin * capacity + at] = pack_pixel(pixel); }
}
