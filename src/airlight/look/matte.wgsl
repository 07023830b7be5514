// Finds what emits, as one light sees it, on a small copy of the picture, which is made on the way. Twins: matte, lightness in reference/look.py.
// matte_codes.wgsl and matte_linear.wgsl say how a picture's colours are read.
//! include "look/rays.wgsl"
override TAPS: u32 = 1u;      // samples of the picture along each axis

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var lets: texture_2d<f32>;  // r: 1 for what may emit
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var matte: texture_storage_2d<rgba16float, write>; // E g, E, L

@compute @workgroup_size(64)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(matte);
    if (any(id.xy >= size)) { return; }
    let place = (vec2f(id.xy) + 0.5) / vec2f(size);
    let d = place * rays.box - rays.light;
    let distance = max(length(d), 1e-9);
    let y = dot(mean_color(id.xy, size), vec3f(0.2126, 0.7152, 0.0722));
    let e = emission(y, rays) * textureSampleLevel(lets, bilinear, place, 0.0).r;
    let level = exp2(log2(max(y, 1e-20)) / 3.0);
    textureStore(matte, id.xy, vec4f(e * nearness_weight(distance - entry(d / distance, rays)), e, level, 1.0));
}
