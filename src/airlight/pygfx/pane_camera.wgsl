// The camera and its medium, as the shaders of what is seen through know them. The numbers of group and bindings are put in by private_panes.py:
// they follow those of pygfx's lights.
//! include "scatter/march/profile.wgsl"
struct PaneFog {
    rays: vec4f,                // projection.py: eye_rays
    depth: vec4f,               // projection.py: depth_terms
    sigma_t: vec3f,             // 1/m
    flat: f32,                  // 1 without perspective
    size: vec2f,                // of the march
    ratio: vec2f,               // of the picture's pixels to those of the march
    shift: vec2f,               // pixels of the picture by which the march is sampled beside its pixels' middles
    mix: f32,                   // share of in-scattered radiance that is added
    extinction: f32,            // share of the dimming of surfaces by the medium
}

@group(9) @binding(90) var<uniform> pane_fog: PaneFog;
