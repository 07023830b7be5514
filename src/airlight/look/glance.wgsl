// A light's bands at some pixels, for the host to measure. Twin: reference/look.py:at_points.
//! include "look/rays.wgsl"

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var bands: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var<storage, read_write> seen: array<vec4f>; // bands, distance
override COLUMNS: u32 = 1u;   // of the small copy
override ROWS: u32 = 1u;
const EVERY = 2u;             // how many-th of its pixels, along each axis; GLANCED in look/measure.py

/// Reads the bands at a pixel of the small copy, and its distance from the light.
@compute @workgroup_size(64)
fn glance(@builtin(global_invocation_id) id: vec3u) {
    let p = EVERY * id.xy;
    if (p.x >= COLUMNS || p.y >= ROWS) { return; }
    let at = polar((vec2f(p) + 0.5) / vec2f(f32(COLUMNS), f32(ROWS)) * rays.box, rays);
    seen[id.y * ((COLUMNS + EVERY - 1u) / EVERY) + id.x] = vec4f(textureSampleLevel(bands, bilinear, band_uv(at, rays), 0.0).rgb, at.x);
}
