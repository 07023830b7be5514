// The discs of lights without a body, drawn into the source at the far plane.
//! include "wgsl/fullscreen.wgsl"

struct Disc {
    direction: vec3f,           // unit, view space
    cosine: f32,                // of its half angle
    soft: f32,                  // cosines of a texel at its rim
}

struct Discs {
    rays: vec4f,                // projection.py: pixel_rays of the whole source
    size: vec2f,                // of the source, texels
    count: u32,
    disc: array<Disc, 8>,
}

@group(0) @binding(0) var<uniform> discs: Discs;

/// Covers the target at the far plane.
@vertex
fn cover_far(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return fullscreen_corner(i, 1.0);
}

/// Draws radiance 1 in the discs, over a rim of a texel.
@fragment
fn disc(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let ray = normalize(vec3f(discs.rays.xy * position.xy / discs.size + discs.rays.zw, -1.0));
    var cover = 0.0;
    for (var i = 0u; i < discs.count; i++) {
        let disc = discs.disc[i];
        cover = max(cover, clamp((dot(ray, disc.direction) - disc.cosine) / disc.soft + 0.5, 0.0, 1.0));
    }
    return vec4f(vec3f(cover), 1.0);
}
