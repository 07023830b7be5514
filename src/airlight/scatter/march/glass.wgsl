// Light that has passed surfaces which are seen through: maps of a light's own, beside its shadow map, that hold in each texel how far the first
// four of them are, and what is left of the light behind each. They are drawn by pygfx/glass_maps.py.
override GLASS: bool = false;   // there are such surfaces

@group(0) @binding(13) var<storage, read> glass: array<vec4u>; // see GlassMaps

/// Find what is left of a light at a depth, behind surfaces at four depths, each nearer to the light than the next, and behind as many of them,
/// so much. Twin: reference/panes.py:left_behind.
fn left_behind(depth: f32, surfaces: vec4f, left: vec4f) -> f32 {
    var found = 1.0;
    //! each k of 4: found = select(found, left[k], surfaces[k] > depth);
    return found;
}

/// Look up what is left of view i's light at a position of its shadow map and a depth.
fn light_left(i: u32, position: vec2f, depth: f32) -> f32 {
    let side = light.glass_side;
    let texel = floor(position * (side / light.side));
    let within = clamp(texel, vec2f(0.0), vec2f(side - 1.0));
    let found = glass[(i * u32(side) + u32(within.y)) * u32(side) + u32(within.x)];
    let surfaces = vec4f(unpack2x16float(found.x), unpack2x16float(found.y));
    let left = left_behind(depth, surfaces, vec4f(unpack2x16unorm(found.z), unpack2x16unorm(found.w)));
    return select(left, 1.0, any(within != texel));
}

/// Choose one of up to 16 steps to stand for all that are lit, each as likely: its number. lit: a bit each; part: 0..1. Beside the glass of a window
/// there may be a dark wall, where nothing dims the light. Twin: reference/panes.py:lit_step.
fn lit_step(lit: u32, part: f32) -> f32 {
    var left = u32(part * f32(countOneBits(lit)));
    var first = 0u;
    var few = 0u;
    //! each k of 4: few = countOneBits((lit >> first) & ((1u << (8u >> k)) - 1u)); first += select(0u, 8u >> k, left >= few); left -= select(0u, few, left >= few);
    return f32(min(first, 15u));
}
