// The layer put on a picture in linear light, for pictures that are shown as they are computed. Twin: composite/blend.py:blend.
//! include "wgsl/srgb.wgsl"
//! include "wgsl/half.wgsl"
//! include "composite/put.wgsl"
override SCREEN: bool = false;
override SUBTRACT_HAZE: bool = false;
override CODES: bool = false;  // the picture holds sRGB codes

struct Settings {
    peak: f32,                // luminance of the brightest shafts
    haze_floor: f32,          // fourth power of the haze's share of it
    mix: f32,
    scale: f32,               // the factor in the layer
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_2d<f32>;
@group(0) @binding(3) var result: texture_storage_2d<rgba16float, write>;

/// Composites a pixel.
@compute @workgroup_size(64)
fn put(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy;
    if (any(p >= textureDimensions(picture))) { return; }
    var a = textureLoad(picture, p, 0).rgb;
    if (CODES) { a = srgb_decode(a); }
    var added = textureLoad(layer, p, 0).rgb / settings.scale;
    if (SUBTRACT_HAZE) { added = subtract_haze(added, settings.peak, settings.haze_floor); }
    added *= settings.mix;
    if (SCREEN) { added = screened(a, added); }
    textureStore(result, p, vec4f(nearest_half(a + added), 1.0));
}
