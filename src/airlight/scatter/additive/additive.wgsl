// The fixed-function multipass of GPU Gems 3, 13.4 and Fig. 13-5: n copies of the image J, scaled about the light l, are drawn over one
// another, and the blending unit adds them in an 8-bit buffer B.
//
//     B_{i+1}(x) = min(B_i(x) + round(f_i J(x - i step)), 255),    f_i = min(decay^i weight / n, 1),    step = density / n (x - l)
//
// A blend depends on its own pixel alone, so an invocation does all of them for one pixel in turn, each rounded and saturated as the
// hardware would. J is the source in whole codes 0..255 (quantise), since what is drawn is an 8-bit image.
// Twin: reference/additive.py:additive.
//! include "wgsl/half.wgsl"
override ADD: bool = false;   // add to what earlier lights gave
const WHITE = 255.0;

struct Blends {
    size: vec2u,              // of the layer
    light: vec2f,             // normalised
    apron: f32,               // of the source, in its pixels
    samples: u32,
    step: f32,                // density / n
    decay: f32,
    gain: vec4f,              // exposure / 255 times the light's colour; w: weight / n
    row: u32,                 // first row of this dispatch
}

@group(0) @binding(0) var<storage, read> blends: Blends; // lavapipe compiles anew for each value of a uniform that ends a loop
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var result: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var before: texture_2d<f32>;

/// Writes the source as codes 0..255 of the buffer that is drawn; half floats hold them exactly.
@compute @workgroup_size(64)
fn quantise(@builtin(global_invocation_id) id: vec3u) {
    let color = clamp(textureLoad(source, id.xy, 0).rgb, vec3f(0.0), vec3f(1.0));
    textureStore(result, id.xy, vec4f(floor(color * WHITE + 0.5), 1.0));
}

/// Blends all copies on a pixel.
@compute @workgroup_size(64)
fn blend(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y + blends.row);
    if (p.x >= blends.size.x || p.y >= blends.size.y) {
        return;
    }
    let inner = vec2f(textureDimensions(source)) - 2.0 * blends.apron;
    let x = (vec2f(p) + 0.5) / vec2f(blends.size);
    let step = (x - blends.light) * blends.step;
    let samples = blends.samples;
    let decay = blends.decay;
    var factor = blends.gain.w;
    var total = vec3f(0.0);
    for (var i = 0u; i < samples; i++) {
        // Fetch the copy's pixel, and add it as the blending unit does
        let at = ((x - f32(i) * step) * inner + blends.apron) / vec2f(textureDimensions(source));
        let drawn = min(factor, 1.0) * textureSampleLevel(source, bilinear, at, 0.0).rgb;
        total = min(total + floor(drawn + 0.5), vec3f(WHITE));
        factor *= decay;
    }
    var out = blends.gain.rgb * total;
    if (ADD) {
        out += textureLoad(before, p, 0).rgb;
    }
    textureStore(result, p, vec4f(nearest_half(out), 1.0));
}
