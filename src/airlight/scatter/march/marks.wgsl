// Pixels whose upsampling is unsure, gathered in lists by how much so. Whoever includes this has `marks` as a binding.

const BINS = 16u;               // of errors, each from sqrt(2) times as large ones on as the one before; the first and the last have no end
const FIRST_BIN = 6.0;          // -2 log2 of the mean radiance's share that the first begins at

struct Marks {
    mean: f32,                  // radiance of what is marched
    counts: array<atomic<u32>, 16>,
    pixels: array<u32>,         // lists, one after the other, see pack_pixel
}

/// Choose the list of an error, in units of the mean radiance. Twin: reference/refine.py:error_bin.
fn error_bin(error: f32) -> u32 {
    return u32(clamp(2.0 * log2(error) + FIRST_BIN, 0.0, f32(BINS) - 1.0));
}

/// Pack a pixel of the picture. Twin: reference/refine.py:pack_pixel.
fn pack_pixel(pixel: vec2u) -> u32 {
    return pixel.x | (pixel.y << 16u);
}
