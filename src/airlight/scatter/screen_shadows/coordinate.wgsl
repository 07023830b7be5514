// Screen-space shadows in the air. Half planes bounded by the line through the eye and a light are seen as rows of the picture, away from the
// point where the light is seen. In such a half plane every ray of the light has one coordinate: of a sun its distance from that line, of a
// lamp its angle at the lamp. What the picture shows nearer to the light than a pixel, farther inwards on its row, hides the light of all
// rays that its dark side sweeps, and the pixel's own ray crosses them one after the other. So one walk outwards along a row gathers, in
// BINS parts of the coordinate, what is dark for all of its pixels: scan.wgsl. A sun's coordinate is divided in ratios, a lamp's evenly.
//! include "scatter/march/ray.wgsl"
//! include "scatter/visibility/place.wgsl"
override DENSER: bool = false;  // of the grid's rays, as of grid.wgsl

const BINS = 36u;               // of the coordinate
const STEPS = 3.0;              // bins of a layer of the atlas, whose texel holds the values at their four ends
const LAYERS = 12u;             // side by side in the atlas
const MOST_BODIES = 8u;

struct Scan {
    offset: vec2f,              // of the grid of rows, as of grid.wgsl's Grid
    slope: f32,
    octaves: f32,               // of a sun's coordinate
    rate: vec2f,
    nearest: f32,               // m: below this a sun's coordinate is even, above it goes by ratios
    count: u32,                 // of rows
    first: vec4f,
    rays: vec4f,
    texel: vec2f,               // 1 over the atlas's size
    bodies: u32,                // in use
    edge: array<vec4f, 37>,     // m, where a bin of a sun's coordinate begins; cosine and sine of the middle of a lamp's
    body: array<vec4f, 8>,      // spheres of bodies of light, which hide nothing: centre, view space, and radius
}

@group(0) @binding(6) var<uniform> scan: Scan;

/// Evaluate the coordinate, 0..1 at the largest, of a ray of a sun that passes the eye's line to it at a distance, m.
/// Twin: reference/screen_shadows.py:sun_coordinate.
fn sun_coordinate(distance: f32, nearest: f32, octaves: f32) -> f32 {
    return log2(1.0 + distance / nearest) / octaves;
}

/// Evaluate the coordinate of a lamp's ray to a place: the angle at the lamp between that and the eye, over pi. Both in view space.
/// Twin: reference/screen_shadows.py:lamp_coordinate.
fn lamp_coordinate(place: vec3f, lamp: vec3f) -> f32 {
    return atan2(length(cross(place, lamp)), dot(lamp - place, lamp)) / 3.14159265;
}

/// Evaluate the coordinate of the light's ray to a place, view space. Twin: reference/screen_shadows.py:coordinate.
fn coordinate(place: vec3f) -> f32 {
    if (DIRECTIONAL) { return sun_coordinate(length(cross(place, light.position)), scan.nearest, scan.octaves); }
    return lamp_coordinate(place, light.position);
}
