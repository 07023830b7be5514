// The log-n multipass, unpublished (as in Crytek's sun shafts, but exact): three passes of eight taps are a sum of 512.
//
//     S(x) = sum_p c_p int_{1-D}^1 u^p I(l + u (x - l)) du
//
// with the weight of the converged sum fitted by powers u^p of the part u of the distance from the light l to the pixel at which a sample lies (moments.py).
// In steps x -> l + gamma (x - l), u is a power of gamma, and the weight gamma^(k (p+1)) of tap k splits into factors: the first pass
// steps by gamma, the second by gamma^8 over what the first gave, the third by gamma^64. This is one of these passes, for one p. Where the
// ray ends nearer to the light than 1/128 of that distance, the rest is one more sample, in the last pass. docs/methods.md derives it.
// Twin: reference/multipass.py:multipass.
//! include "wgsl/half.wgsl"
override ADD: bool = false;   // add to what earlier powers and lights gave
override LAST: bool = false;  // the pass that writes the layer, with what lies nearest to the light
override NEAREST: bool = false; // which counts
const TAPS = 8u;

struct Taps {
    light: vec2f,             // in pixels
    size: vec2u,              // of the result
    apron: f32,               // of the source
    inset: f32,               // of the source, less that of the result
    taps: array<vec4f, TAPS>, // part of the distance to the light, weight
    gain: vec4f,              // of the sum, in the last pass
    nearest: vec4f,           // of the nearest sample; w: part of the distance to the light
}

@group(0) @binding(0) var<uniform> frame: Taps;
@group(0) @binding(1) var source: texture_2d<f32>; // what the pass before gave
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var result: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var emitted: texture_2d<f32>;

/// Sums eight taps of a pixel.
@compute @workgroup_size(64)
fn eight(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) {
        return;
    }
    let whole = vec2f(textureDimensions(source));
    let x = vec2f(id.xy) + 0.5 - (frame.apron - frame.inset);
    let from_light = x - frame.light;
    var sum = vec3f(0.0);
    for (var k = 0u; k < TAPS; k++) {
        // Fetch what the pass before gave, nearer to the light
        let at = (x - frame.taps[k].x * from_light + frame.apron) / whole;
        sum += frame.taps[k].y * textureSampleLevel(source, bilinear, at, 0.0).rgb;
    }
    if (LAST) {
        sum *= frame.gain.rgb;
        if (NEAREST) {
            sum += frame.nearest.rgb * textureSampleLevel(emitted, bilinear, (x - frame.nearest.w * from_light + frame.apron) / whole, 0.0).rgb;
        }
        if (ADD) {
            sum += textureLoad(before, id.xy, 0).rgb;
        }
    }
    textureStore(result, id.xy, vec4f(nearest_half(sum), 1.0));
}
