// What all marches share: the eye's rays, the medium, a light and its shadow map. Records: records.py. Twins: reference/medium.py.
override KIND: u32 = 0u;        // 0 sun, 1 spot, 2 point, 3 no light
override PHASE: u32 = 0u;       // henyey-greenstein, two-lobe, isotropic, rayleigh, cornette-shanks

struct Frame {
    rays: vec4f,                // records.py: eye_rays
    depth: vec4f,               // projection.py: depth_terms
    sigma_t: vec3f,             // 1/m
    flat: f32,                  // 1 without perspective
    sigma_s: vec3f,
    max_distance: f32,
    ambient: vec3f,             // radiance
    size: vec2u,                // of what is computed
    pixels: vec2u,              // of the picture
}

struct View {
    matrix: mat4x4f,            // view space to (x w, y w, depth w, w), x, y in texels; depth falls with the distance from the light
    near: f32,                  // along the camera's axis, of a cascade
    far: f32,
    texel: f32,                 // metres; of lamps, at 1 m
    depth_scale: f32,           // metres of depth 1; near of a lamp
}

struct Light {
    intensity: vec3f,           // lux of a sun, else candela
    range: f32,                 // m, 0: none
    place: vec3f,               // of a lamp; towards a sun
    cone_scale: f32,
    axis: vec3f,                // the way a spot shines
    cone_offset: f32,
    lobes: vec3f,               // g, g of the second lobe, its share
    cosine: f32,                // of a spot's outer half angle
    views: u32,
    side: f32,                  // of the map, texels
    bias: f32,                  // m
    spread: f32,                // tangent of a sun's angular radius
    blend: f32,                 // the last part of a cascade, over which it passes into the next
    steps: u32,                 // along a ray, 0: exact
    view: array<View, 6>,
}

const PI = 3.14159265358979;

/// Phase function, 1/sr: cosine 1 where one looks into the light. lobes: g, g of the second lobe, its share.
fn phase(cosine: f32, lobes: vec3f) -> f32 {
    return phase_by(vec2f(1.0 - cosine, 1.0 + cosine), lobes);
}

/// The same for unit vectors, with every digit where they lie close together, and a peak is narrow.
fn phase_between(a: vec3f, b: vec3f, lobes: vec3f) -> f32 {
    return phase_by(0.5 * vec2f(dot(a - b, a - b), dot(a + b, a + b)), lobes);
}

/// apart: 1 - cosine, 1 + cosine
fn phase_by(apart: vec2f, lobes: vec3f) -> f32 {
    if (PHASE == 2u) { return 1.0 / (4.0 * PI); }
    let cosine = 0.5 * (apart.y - apart.x);
    if (PHASE == 3u) { return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine); }
    let g = lobes.x;
    let first = henyey_greenstein(apart, g);
    if (PHASE == 4u) { return 1.5 * first * (1.0 + cosine * cosine) / (2.0 + g * g); }
    if (PHASE == 0u) { return first; }
    return mix(first, henyey_greenstein(apart, lobes.y), lobes.z);
}

fn henyey_greenstein(apart: vec2f, g: f32) -> f32 {
    let off = 1.0 - abs(g);
    let under = off * off + 2.0 * abs(g) * select(apart.x, apart.y, g < 0.0); // 1 + g^2 - 2 g cosine
    return off * (1.0 + abs(g)) / (4.0 * PI * under * sqrt(under));
}
