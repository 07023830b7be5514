// The way back as triangles. In each, the row of the sums is affine in the pixel's place and the line a ratio of affine functions,
// so that a pixel costs one division and one bilinear fetch.
//! include "scatter/epipolar/gather.wgsl"

struct Corner {
    place: vec2f,             // in pixels
    line: vec2f,              // in the sums' texture: x / y
    row: f32,
    first: f32,               // of the quadrant's lines
    last: f32,
}

@group(0) @binding(5) var<storage, read> corners: array<Corner>;

struct Ways {
    @builtin(position) place: vec4f,
    @location(0) @interpolate(linear) line: vec2f,
    @location(1) @interpolate(linear) row: f32,
    @location(2) @interpolate(flat) ends: vec2f,
}

fn at(place: vec2f) -> vec4f {
    let q = 2.0 * place / vec2f(frame.size) - 1.0;
    return vec4f(q.x, -q.y, 0.0, 1.0);
}

@vertex
fn corner(@builtin(vertex_index) i: u32) -> Ways {
    let c = corners[i];
    return Ways(at(c.place), c.line, c.row, vec2f(c.first, c.last));
}

@fragment
fn gather(v: Ways) -> @location(0) vec4f {
    let line = clamp(v.line.x / max(v.line.y, 1e-9), v.ends.x, v.ends.y);
    return finished(vec2u(v.place.xy), sum_at(vec2f(line, v.row)));
}

@vertex
fn around(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    let k = select(i, 6u - i, i > 2u); // two triangles of four corners
    let corner = vec2f(vec2u(k & 1u, k >> 1u) * 2u * NEAR);
    return at(floor(frame.light) + corner - f32(NEAR));
}

@fragment
fn near(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let p = vec2u(place.xy);
    return finished(p, direct_sum(p));
}
