// Light that has passed surfaces which are seen through: maps of a light's own, beside its shadow map, that hold in each texel how far the first
// four of them are, and what is left of the light behind each. They are drawn by pygfx/glass_maps.py.
//! include "scatter/march/glass_texel.wgsl"
override GLASS: bool = false;   // there are such surfaces
override COLOURED: bool = false; // some of them colour the light

@group(0) @binding(13) var<storage, read> glass: array<vec4u>; // see GlassMaps

const MOST_DIMMED = 8.0;        // steps of a group, of which one stands for all
const MOST_COLOURED = 2.0;      // of one behind coloured glass, where a wrong one is seen

/// Find what is left of a light at a depth, behind surfaces at four depths, each nearer to the light than the next, and behind as many of them,
/// so much. Twin: reference/panes.py:left_behind.
fn left_behind(depth: f32, surfaces: vec4f, left: vec4f) -> f32 {
    var found = 1.0;
    //! each k of 4: found = select(found, left[k], surfaces[k] > depth);
    return found;
}

/// Look up what is left of view i's light at a position of its shadow map and a depth.
fn light_left(i: u32, position: vec2f, depth: f32) -> vec3f {
    let side = light.glass_side;
    let texel = floor(position * (side / light.side));
    let within = clamp(texel, vec2f(0.0), vec2f(side - 1.0));
    let at = (i * u32(side) + u32(within.y)) * u32(side) + u32(within.x);
    var left = vec3f(1.0);
    if (COLOURED) {
        let found = glass[2u * at];
        let surfaces = vec4f(unpack2x16float(found.x), unpack2x16float(found.y));
        left = unpack_left(code_behind(depth, surfaces, vec4u(found.zw, glass[2u * at + 1u].x, glass[2u * at + 1u].y)));
    } else {
        let found = glass[at];
        let surfaces = vec4f(unpack2x16float(found.x), unpack2x16float(found.y));
        left = vec3f(left_behind(depth, surfaces, vec4f(unpack2x16unorm(found.z), unpack2x16unorm(found.w))));
    }
    return select(left, vec3f(1.0), any(within != texel));
}

/// Note in a list of steps that are lit, of a group of MOST_DIMMED at most, three bits each, that the k-th is. Twin: reference/panes.py:with_lit.
fn with_lit(list: u32, k: u32) -> u32 {
    return (list << 3u) | k;
}

/// Choose one of so many steps of such a list to stand for all, each as likely; part: 0..1. Beside the glass of a window there may be a dark wall,
/// where nothing dims the light. Twin: reference/panes.py:lit_step.
fn lit_step(list: u32, count: f32, part: f32) -> f32 {
    return f32((list >> (3u * u32(part * count))) & 7u);
}
