// The volume that a light fills, and planes at right angles to the view through it.
//! include "scatter/march/filters.wgsl"
//! include "scatter/march/shape.wgsl"

struct Slicing {
    low: vec3f,                 // a corner of the box around the volume: right and up in view space, m, and m ahead
    count: f32,                 // planes in it
    high: vec3f,                // the corner across
    views: u32,                 // of the light's shadow map
    rows: array<vec4f, 3>,      // from view space to the light's right, up and ahead, m
    cell: u32,                  // pixels along a cell, whose planes lie between each other's
    tangents: vec2f,            // of the half angles that a cookie fills; of a directional light half its size, m
    printed: vec3f,             // factors of 1 / d^2, 1 / d and 1 of the article's falloff
    gain: f32,                  // the article's scale
    span: vec2f,                // m from a light along its axis where its volume begins and ends
    scroll: vec4f,              // how far two noise maps have moved, in maps
    tint: vec3f,                // of what a light adds
    unit: f32,                  // in a metre, of lengths in the falloff
}

@group(0) @binding(6) var<storage, read> slicing: Slicing;

/// Transform a place to the light's right, up and ahead, m. Twin: reference/slices.py:in_light.
fn in_light(place: vec3f) -> vec3f {
    let p = vec4f(place, 1.0);
    return vec3f(dot(slicing.rows[0], p), dot(slicing.rows[1], p), dot(slicing.rows[2], p));
}

/// Find where in a light's picture its light to a place along its axes lies, 0..1 from the left and from the top.
/// Twin: reference/slices.py:picture_place.
fn picture_place(q: vec3f) -> vec2f {
    return 0.5 + vec2f(0.5, -0.5) * q.xy / (select(q.z, 1.0, DIRECTIONAL) * slicing.tangents);
}

/// Clip a range of t to a ball around the light, from the ray's nearest approach to it. Twin: reference/slices.py:clip_to_ball.
fn clip_to_ball(near: vec2f, range: vec2f, radius: f32) -> vec2f {
    let half = sqrt(max(radius * radius - near.y * near.y, 0.0));
    return vec2f(max(range.x, near.x - half), min(range.y, near.x + half));
}
