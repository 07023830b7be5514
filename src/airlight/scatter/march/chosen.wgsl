// The pixels that a pass of a march is for: all of what is computed, or those of a list, whose results are put beside each other as they are
// in it.
@group(0) @binding(20) var<storage, read> chosen: array<u32>; // their number, and each one packed, see pack_pixel; one element: no list

const LIST_COLUMNS = 128u;      // of the texture of a list's results

/// Unpack a pixel of the picture. Twin: reference/refine.py:unpack_pixel.
fn unpack_pixel(packed: u32) -> vec2u {
    return vec2u(packed & 0xffffu, packed >> 16u);
}

/// Tell whether the pass is for a list.
fn is_listed() -> bool {
    return arrayLength(&chosen) > 1u;
}

/// Find the pixel of the picture whose ray is marched for a pixel of what is computed.
fn marched_pixel(p: vec2u) -> vec2u {
    if (is_listed()) { return unpack_pixel(chosen[1u + p.y * LIST_COLUMNS + p.x]); }
    return sampled_pixel(p);
}
