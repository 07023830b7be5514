// The fixed-function multipass of Fig. 13-5: scaled copies of the image added in an 8-bit buffer. A blend depends on its own pixel
// alone, so all of them are done here in turn, each rounded and saturated as the hardware would. Twin: reference/additive.py.
//! include "gpu/half.wgsl"
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

/// The source as codes 0..255 of the buffer that is drawn; half floats hold them exactly.
@compute @workgroup_size(64)
fn quantise(@builtin(global_invocation_id) id: vec3u) {
    let color = clamp(textureLoad(source, id.xy, 0).rgb, vec3f(0.0), vec3f(1.0));
    textureStore(result, id.xy, vec4f(floor(color * WHITE + 0.5), 1.0));
}

@compute @workgroup_size(64)
fn blend(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y + blends.row);
    if (p.x >= blends.size.x || p.y >= blends.size.y) {
        return;
    }
    let inner = vec2f(textureDimensions(source)) - 2.0 * blends.apron;
    let x = (vec2f(p) + 0.5) / vec2f(blends.size);
    let way = (x - blends.light) * blends.step;
    let samples = blends.samples;
    let decay = blends.decay;
    var factor = blends.gain.w;
    var total = vec3f(0.0);
    for (var i = 0u; i < samples; i++) {
        let at = ((x - f32(i) * way) * inner + blends.apron) / vec2f(textureDimensions(source));
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
