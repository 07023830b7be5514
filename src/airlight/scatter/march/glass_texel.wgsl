// Colours of light behind surfaces, as maps of what dims lights hold them: the roots of their parts, so that dark ones have as many digits, in 11,
// 11 and 10 bits.
const COLOUR_CODES = vec3f(2047.0, 2047.0, 1023.0);

/// Pack what is left of a light, each part 0..1. Twin: reference/panes.py:pack_left.
fn pack_left(left: vec3f) -> u32 {
    let codes = vec3u(round(sqrt(clamp(left, vec3f(0.0), vec3f(1.0))) * COLOUR_CODES));
    return codes.x | (codes.y << 11u) | (codes.z << 22u);
}

/// Unpack what pack_left gives. Twin: reference/panes.py:unpack_left.
fn unpack_left(code: u32) -> vec3f {
    let roots = vec3f(vec3u(code & 2047u, (code >> 11u) & 2047u, code >> 22u)) / COLOUR_CODES;
    return roots * roots;
}

/// Choose the code of what is left of a light at a depth, behind surfaces at four depths, each nearer to the light than the next, and behind as
/// many of them, so much. Twin: reference/panes.py:code_behind.
fn code_behind(depth: f32, surfaces: vec4f, codes: vec4u) -> u32 {
    var found = 4294967295u; // white
    //! each k of 4: found = select(found, codes[k], surfaces[k] > depth);
    return found;
}
