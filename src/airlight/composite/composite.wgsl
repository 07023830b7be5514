// The layer put on an 8-bit sRGB picture: haze taken away, added or screened in linear light, encoded, dithered. Twins: blend
// in blend.py, encode_codes in files/colour.py. Where nothing is added the codes stay as they are.
//! include "gpu/srgb.wgsl"
//! include "composite/put.wgsl"
override SCREEN: bool = true;
override VEIL: bool = true;

struct Rule {
    peak: f32,                // luminance of the brightest shafts
    veil: f32,                // veil^4
    mix: f32,
}

@group(0) @binding(0) var<uniform> rule: Rule;
@group(0) @binding(1) var codes: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_2d<f32>;
@group(0) @binding(3) var noise: texture_2d<f32>; // in (0, 1), a tile
@group(0) @binding(4) var result: texture_storage_2d<rgba8unorm, write>;

fn composited(p: vec2u) -> vec4f {
    let before = textureLoad(codes, p, 0);
    var added = textureLoad(layer, p, 0).rgb;
    if (VEIL) { added = lift_veil(added, rule.peak, rule.veil); }
    added *= rule.mix;
    let a = srgb_decode(before.rgb);
    if (SCREEN) { added = screened(a, added); }
    if (all(added == vec3f(0.0))) {
        return before;
    }
    let code = 255.0 * srgb_encode(clamp(a + added, vec3f(0.0), vec3f(1.0)));
    let grain = textureLoad(noise, p % textureDimensions(noise), 0).rgb;
    return vec4f(min(floor(code + grain), vec3f(255.0)) / 255.0, before.a);
}

@compute @workgroup_size(64)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y);
    if (all(p < textureDimensions(codes))) {
        textureStore(result, p, composited(p));
    }
}
