// The grid of a lamp's table of visibility. Its rows and rays are those of grid.wgsl: half planes bounded by the line from the eye through the
// lamp. Along a ray its blocks are of equal angles at the lamp, counted from the direction to the eye: 0 at the eye, and growing with the
// distance from it. All rays of a row have the same directions from the lamp, and so the same line over its shadow map.
//! include "scatter/visibility/grid.wgsl"
//! include "wgsl/unit_at.wgsl"

struct Lamp {
    towards: vec3f,             // unit, from the eye
    away: f32,                  // m from the eye
    begin: f32,                 // rad, of the first block
    end: f32,                   // of the last
    wide: f32,                  // of each
    blocks: f32,
    turn: vec2f,                // cosine and sine of the angle from one sample of a block to the next
    power: vec3f,               // candela times scattering and the transmittance of the way from the lamp to the eye
}

struct LampRow {
    ends: vec4f,                // of the ray that goes by 1 along the camera's axis: across and towards the lamp, first ray, and last
    across: vec3f,              // unit, in the row's plane, at right angles to where the lamp is
    rays: f32,
    begin: vec2f,               // pixels: the first ray
    end: vec2f,                 // the last ray
    blocks: vec2f,              // from where to where they meet the light's cone
    axis: vec2f,                // across and towards, of the unit vector in which a spot shines
}

/// Find the angle of a vector from the axis of x, 0 to pi, for y of 0 or more, to 5e-6 of it.
/// Twin: reference/visibility_lamps.py:angle_from.
fn angle_from(x: f32, y: f32) -> f32 {
    let long = max(abs(x), y);
    let t = min(abs(x), y) / max(long, 1e-30);
    let q = t * t;
    let low = t * (0.99999566 - q * (0.33299521 - q * (0.1956394 - q * (0.12124709 - q * (0.05748539 - q * 0.01348342)))));
    let steep = select(low, 1.57079633 - low, y > abs(x));
    return select(steep, 3.14159265 - steep, x < 0.0);
}

/// Measure how far a vector goes along the axis of shadow view i. Twin: reference/visibility_lamps.py:along_axis.
fn along_axis(i: u32, v: vec3f) -> f32 {
    let matrix = light.view[i].matrix;
    return dot(vec3f(matrix[0].w, matrix[1].w, matrix[2].w), v);
}

/// Choose the face of the cube around a point light that a direction from it meets: faces lie in opposite pairs.
/// Twin: reference/visibility_lamps.py:face_towards.
fn face_towards(v: vec3f) -> u32 {
    let along = vec3f(along_axis(0u, v), along_axis(2u, v), along_axis(4u, v));
    let far = abs(along);
    let one = select(u32(along.x < 0.0), 2u + u32(along.y < 0.0), far.y > far.x);
    return select(one, 4u + u32(along.z < 0.0), far.z > max(far.x, far.y));
}

/// Find the direction from a lamp at which a ray has so much of an angle there. at: cosine and sine of it; across, towards: unit, of the
/// ray's row. Twin: reference/visibility_lamps.py:from_lamp.
fn from_lamp(at: vec2f, across: vec3f, towards: vec3f) -> vec3f {
    return at.y * across - at.x * towards;
}
