// The layer put on an 8-bit sRGB picture: haze taken away, added or screened in linear light, encoded, dithered. Where nothing is added
// the codes stay as they are. Twin: composite/blend.py:blend. Twin: colour.py:encode_codes.
//! include "wgsl/srgb.wgsl"
//! include "composite/put.wgsl"
override SCREEN: bool = true;
override SUBTRACT_HAZE: bool = true;

struct Settings {
    peak: f32,                // luminance of the brightest shafts
    haze_floor: f32,          // fourth power of the haze's share of it
    mix: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var codes: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_2d<f32>;
@group(0) @binding(3) var noise: texture_2d<f32>; // in (0, 1), a tile
@group(0) @binding(4) var result: texture_storage_2d<rgba8unorm, write>;

/// Composites a pixel: its new code, or the one it had.
fn composited(p: vec2u) -> vec4f {
    let before = textureLoad(codes, p, 0);
    var added = textureLoad(layer, p, 0).rgb;
    if (SUBTRACT_HAZE) { added = subtract_haze(added, settings.peak, settings.haze_floor); }
    added *= settings.mix;
    let a = srgb_decode(before.rgb);
    if (SCREEN) { added = screened(a, added); }
    if (all(added == vec3f(0.0))) {
        return before;
    }
    let code = 255.0 * srgb_encode(clamp(a + added, vec3f(0.0), vec3f(1.0)));
    let grain = textureLoad(noise, p % textureDimensions(noise), 0).rgb;
    return vec4f(min(floor(code + grain), vec3f(255.0)) / 255.0, before.a);
}

/// Composites the picture, a pixel an invocation.
@compute @workgroup_size(64)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y);
    if (all(p < textureDimensions(codes))) {
        textureStore(result, p, composited(p));
    }
}
