// The volume that a light fills, and planes at right angles to the view through it.
//! include "scatter/march/filters.wgsl"
override COOKIE: bool = false;  // the light has one

struct Slicing {
    low: vec3f,                 // a corner of the box around the volume: right and up in view space, m, and m ahead
    count: f32,                 // planes in it
    high: vec3f,                // the corner across
    views: u32,                 // of the light's shadow map
    rows: array<vec4f, 3>,      // from view space to the light's right, up and ahead, m
    sides: array<vec4f, 16>,    // n p + d >= 0 in the volume, view space
    side_count: u32,
    cell: u32,                  // pixels along a cell, whose planes lie between each other's
    tangents: vec2f,            // of the half angles that a cookie fills; of a directional light half its size, m
    falloff: vec3f,             // factors of 1 / d^2, 1 / d and 1
    gain: f32,                  // of all of a light that is printed: article's scale
    scroll: vec4f,              // how far two noise maps have moved, in maps
    tint: vec3f,                // of what a light adds
    unit: f32,                  // in a metre, of lengths in the falloff
}

@group(0) @binding(6) var<storage, read> slicing: Slicing;
@group(0) @binding(7) var cookie: texture_2d<f32>;

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

/// Clip a range of t to the sides of the volume. Twin: reference/slices.py:clip_to_sides.
fn clip_to_sides(ray: Ray, range: vec2f) -> vec2f {
    var within = range;
    for (var i = 0u; i < slicing.side_count; i++) {
        let side = slicing.sides[i];
        within = clip_range(within, dot(side.xyz, ray.origin) + side.w, dot(side.xyz, ray.direction));
    }
    return within;
}

/// Interpolate a map between the centres of its texels, at a place of it; it repeats, or goes on as at its border.
fn interpolated(map: texture_2d<f32>, at: vec2f, repeats: bool) -> vec3f {
    let size = vec2i(textureDimensions(map));
    let place = at * vec2f(size) - 0.5;
    let low = floor(place);
    let part = place - low;
    let first = vec2i(low);
    let a = select(clamp(first, vec2i(0), size - 1), ((first % size) + size) % size, repeats);
    let b = select(clamp(first + 1, vec2i(0), size - 1), (((first + 1) % size) + size) % size, repeats);
    let top = mix(textureLoad(map, a, 0), textureLoad(map, vec2i(b.x, a.y), 0), part.x);
    let bottom = mix(textureLoad(map, vec2i(a.x, b.y), 0), textureLoad(map, b, 0), part.x);
    return mix(top, bottom, part.y).rgb;
}

/// Look up the colour of the light's cookie towards a place along its axes; white without one.
fn cookie_towards(q: vec3f) -> vec3f {
    if (!COOKIE) { return vec3f(1.0); }
    return interpolated(cookie, picture_place(q), DIRECTIONAL);
}
