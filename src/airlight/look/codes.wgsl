// The look put on an 8-bit sRGB picture: encoded, dithered where something changes. Twins: lit in reference/look.py, encode_codes in
// files/colour.py.
//! include "gpu/srgb.wgsl"
//! include "look/lit.wgsl"
const LEAST = 5e-4;           // of a code: a change that is none

@group(0) @binding(5) var picture: texture_2d<f32>; // codes
@group(0) @binding(6) var noise: texture_2d<f32>; // in (0, 1), a tile
@group(0) @binding(7) var result: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(64)
fn put(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(picture);
    if (any(id.xy >= size)) { return; }
    let before = textureLoad(picture, id.xy, 0);
    let color = srgb_decode(before.rgb);
    let change = lit(color, (vec2f(id.xy) + 0.5) / vec2f(size));
    let code = 255.0 * srgb_encode(clamp(color * (1.0 - change.a) + change.rgb, vec3f(0.0), vec3f(1.0)));
    let grain = textureLoad(noise, id.xy % textureDimensions(noise), 0).rgb;
    let kept = abs(code - 255.0 * before.rgb) < vec3f(LEAST);
    let after = select(min(floor(code + grain), vec3f(255.0)) / 255.0, before.rgb, kept);
    textureStore(result, id.xy, vec4f(after, before.a));
}
