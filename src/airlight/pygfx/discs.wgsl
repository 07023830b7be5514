// The discs of lights without a body, drawn into the source at the far plane. Twin: in tests/test_prepass.py.
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

@vertex
fn far(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 1.0, 1.0);
}

/// Radiance 1 in the discs, over a rim of a texel.
@fragment
fn disc(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let ray = normalize(vec3f(discs.rays.xy * place.xy / discs.size + discs.rays.zw, -1.0));
    var cover = 0.0;
    for (var i = 0u; i < discs.count; i++) {
        let disc = discs.disc[i];
        cover = max(cover, clamp((dot(ray, disc.direction) - disc.cosine) / disc.soft + 0.5, 0.0, 1.0));
    }
    return vec4f(vec3f(cover), 1.0);
}
