// Masks of bits over the rays of a row, and the bit planes that count them.
const SAMPLES = 15.0;           // of a block: as many as four planes count
const UNHIDDEN = -1e9;          // depth of what hides nothing

/// Find the first ray of a row that a sample lights where slopes rise along the row, or that it hides, else. first, last: of a linear
/// function that is 0 or more where the sample lights, at the row's first ray and at its last; rays: less 1. Twin: reference/visibility.py:lit_from.
fn lit_from(first: f32, last: f32, rays: f32, rises: bool) -> i32 {
    let change = first - last;
    let share = clamp(first / select(change, 1.0, change == 0.0), 0.0, 1.0);
    let crossing = ceil(select(share, sqrt(share), DENSER) * rays);
    let none = rays + 1.0;
    let rising = select(select(crossing, none, last < 0.0), 0.0, first >= 0.0);
    let falling = select(select(crossing, none, last >= 0.0), 0.0, first < 0.0);
    return i32(select(falling, rising, rises));
}

/// Set the bits of the rays of a word that a sample lights: from the first such ray on, or up to the first that is not.
/// Twin: reference/visibility.py:lit_mask.
fn lit_mask(first: i32, word: u32, rises: bool) -> u32 {
    let shift = clamp(first - 32 * i32(word), 0, 32);
    let begun = select(0xffffffffu << u32(shift), 0u, shift == 32);
    return select(~begun, begun, rises);
}

/// Add a mask to counters of four bits in bit planes. Twin: reference/visibility.py:counted.
fn counted(planes: vec4u, mask: u32) -> vec4u {
    let one = planes.x & mask;
    let two = planes.y & one;
    let three = planes.z & two;
    return vec4u(planes.x ^ mask, planes.y ^ one, planes.z ^ two, planes.w ^ three);
}

/// Take the counts of the rays q, q + 4, q + 8, ... of a word out of its bit planes, four bits each. Twin: reference/visibility.py:nibbles.
fn nibbles(planes: vec4u, q: u32) -> u32 {
    let one = (planes >> vec4u(q)) & vec4u(0x11111111u);
    return one.x | (one.y << 1u) | (one.z << 2u) | (one.w << 3u);
}
