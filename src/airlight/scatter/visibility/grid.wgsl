// The grid of a table of visibility. Half planes bounded by the line from the eye towards the sun are its rows: each meets the picture in a
// line away from the epipole, where that line pierces the picture's plane. A row holds rays of the eye, evenly apart in the picture from
// where it enters to where it leaves, and each ray blocks of distance, counted in texels of the shadow map that it crosses: 1 wide at first,
// then PER blocks an octave, at most WIDEST. All rays of a row lie over one line of the map. Rows are found by grid.py.
//! include "scatter/march/ray.wgsl"
override PER: f32 = 8.0;        // blocks an octave, a power of 2
override WIDEST: f32 = 32.0;    // texels, a power of 2
override DENSER: bool = false;  // rays lie closer towards where their row enters: at squares of even shares of its length

const MOST_WORDS = 4u;          // of 32 rays each, of a row
const NO_SURFACE = 1e9;         // texels
const TILE_PX = 16u;             // pixels along a tile of the greatest depths, see farthest.wgsl
const LEAST_PACE = 1e-6;        // texels a unit of the ray, at the epipole
const ROOM = 1.03;              // factor of how far a ray is needed by pixels beside it

struct MapOfGrid {              // one for each shadow view of the sun
    eye: vec3f,                 // where the eye is in the map: texels, depth
    stop: f32,                  // texels from there to the map's farthest corner: what is beyond is lit
    near: f32,                  // m along the camera's axis, from where and to where it counts
    far: f32,
    first_row: u32,
    bias: f32,                  // of depth
}

struct Grid {
    offset: vec2f,              // away(p) = slope p - offset, p in pixels
    slope: f32,                 // absolute cosine of the angle between the view's axis and the sun
    count: u32,                 // of rows, of all maps
    rate: vec2f,                // rows a pixel along the picture's left and right edges, and along the upper and lower ones
    layers: u32,                // of the atlas, side by side
    words: u32,                 // of the widest row
    first: vec4f,               // row that leaves through the left, right, upper, lower edge
    rays: vec4f,                // of a row
    middle: f32,                // 1/m, mid-range of the extinctions in red, green and blue
    spread: f32,                // 1/m, from the least to the greatest of them
    tiles_about: u32,           // on each side, that pixels between rays may lie in
    atlas_texel: vec2f,         // 1 over the atlas's size
    map: array<MapOfGrid, 4>,
}

struct Row {
    ends: vec4f,                // texels a unit of the ray and depth a unit, of its first ray, and of its last
    along: vec2f,               // unit, in the map
    begin: vec2f,               // pixels: the first ray
    end: vec2f,                 // the last ray
    rays: f32,
    map: u32,
}

struct Core {                   // pixels around the epipole, whose light is not read from the table
    middle: vec2f,              // pixels: the epipole
    begin: vec2u,               // of the pixels
    radius: f32,                // pixels
}

@group(0) @binding(6) var<uniform> grid: Grid;

/// Find the block at a distance, and the part of it. texels: of the map, from the eye. Twin: reference/visibility.py:block_at.
fn block_at(texels: f32) -> f32 {
    let lowest = bitcast<u32>(PER);
    let octaves = PER + f32(bitcast<u32>(max(texels, PER)) - lowest) * (PER / 8388608.0);
    let whole = PER + PER * log2(WIDEST);
    return select(select(octaves, whole + (texels - PER * WIDEST) / WIDEST, texels > PER * WIDEST), texels, texels < PER);
}

/// Find where a block begins, texels of the map from the eye. Twin: reference/visibility.py:block_begin.
fn block_begin(block: f32) -> f32 {
    let whole = PER + PER * log2(WIDEST);
    let octaves = bitcast<f32>(bitcast<u32>(PER) + u32(clamp(block - PER, 0.0, whole) * (8388608.0 / PER)));
    return select(select(octaves, PER * WIDEST + (block - whole) * WIDEST, block > whole), block, block < PER);
}

/// Clip a ray, whole so long, m, to what a map counts for. near, far: m along the camera's axis; ahead: m along that a metre of the ray.
/// Twin: reference/visibility.py:range_in_map.
fn range_in_map(near: f32, far: f32, ahead: f32, whole: f32) -> vec2f {
    return clamp(vec2f(near, far) / max(ahead, 1e-6), vec2f(0.0), vec2f(whole));
}

/// Integrate density times transmittance over a range of t of a ray, from the sun to the eye, m, where all of it is lit.
/// Twin: reference/visibility.py:lit_integral.
fn lit_integral(ray: Ray, range: vec2f) -> vec3f {
    if (FOG == EVEN) { return transmittance_integral(range.y, frame.sigma_t) - transmittance_integral(range.x, frame.sigma_t); }
    return directional_integral(ray, range);
}
