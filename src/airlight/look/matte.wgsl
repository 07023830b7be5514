// Finds what emits, as one light sees it, on a small copy of the picture, which is made on the way. matte_codes.wgsl and
// matte_linear.wgsl read the picture. Twin: reference/look.py:matte. Twin: reference/look.py:lightness.
//! include "wgsl/luminance.wgsl"
//! include "look/rays.wgsl"
override TAPS: u32 = 1u;      // samples of the picture along each axis

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var may_emit: texture_2d<f32>;  // r: 1 for what may emit
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var matte: texture_storage_2d<rgba16float, write>; // E g, E, L

/// Writes E g, E and lightness of a pixel of the copy.
@compute @workgroup_size(64)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(matte);
    if (any(id.xy >= size)) { return; }
    let uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    let d = uv * rays.box - rays.light;
    let distance = max(length(d), 1e-9);
    let y = luminance(mean_color(id.xy, size));
    let e = emission(y, rays) * textureSampleLevel(may_emit, bilinear, uv, 0.0).r;
    let level = exp2(log2(max(y, 1e-20)) / 3.0);
    let near = nearness_weight(distance - entry_distance(d / distance, rays));
    textureStore(matte, id.xy, vec4f(e * near, e, min(level, 65504.0), 1.0)); // beyond a half some drivers store no number
}
