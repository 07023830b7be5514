// The gather as triangles. In each, the row of the sums is affine in the pixel's position and the line a ratio of affine functions,
// so that a pixel costs one division and one bilinear fetch.
//! include "scatter/epipolar/gather.wgsl"

struct Corner {
    position: vec2f,          // in pixels
    line: vec2f,              // in the sums' texture: x / y
    row: f32,
    first: f32,               // of the quadrant's lines
    last: f32,
    sector: u32,              // of close lines, else NOWHERE
}

const NOWHERE = 0xffffffffu;

@group(0) @binding(5) var<storage, read> corners: array<Corner>;
@group(0) @binding(6) var<storage, read> lit: array<f32>; // detail.wgsl

struct Varyings {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(linear) line: vec2f,
    @location(1) @interpolate(linear) row: f32,
    @location(2) @interpolate(flat) ends: vec2f,
}

/// Converts pixels to clip space. Twin: reference/raster.py:clip_position.
fn clip_position(position: vec2f) -> vec4f {
    let q = 2.0 * position / vec2f(frame.size) - 1.0;
    return vec4f(q.x, -q.y, 0.0, 1.0);
}

/// Places a corner of the triangles.
@vertex
fn corner(@builtin(vertex_index) i: u32) -> Varyings {
    let c = corners[i];
    let is_drawn = c.sector == NOWHERE || lit[min(c.sector, arrayLength(&lit) - 1u)] > 0.0;
    let position = select(vec4f(2.0, 2.0, 0.0, 1.0), clip_position(c.position), is_drawn); // a triangle without area
    return Varyings(position, c.line, c.row, vec2f(c.first, c.last));
}

/// Gathers a pixel of the layer.
@fragment
fn gather(v: Varyings) -> @location(0) vec4f {
    let line = clamp(v.line.x / max(v.line.y, 1e-9), v.ends.x, v.ends.y);
    return finished(vec2u(v.position.xy), sum_at(vec2f(line, v.row)));
}

/// Places a corner of the square around the light.
@vertex
fn around(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    let k = select(i, 6u - i, i > 2u); // two triangles of four corners
    let corner = vec2f(vec2u(k & 1u, k >> 1u) * 2u * NEAR_LIGHT_RADIUS_PX);
    return clip_position(floor(frame.light) + corner - f32(NEAR_LIGHT_RADIUS_PX));
}

/// Sums a pixel near the light.
@fragment
fn near(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let p = vec2u(position.xy);
    return finished(p, direct_sum(p));
}
