// One pass of the log-n multipass: eight taps towards the light. Twin: reference/multipass.py.
//! include "gpu/half.wgsl"
override ADD: bool = false;   // add to what earlier powers and lights gave
override LAST: bool = false;  // the pass that writes the layer, with what lies nearest to the light
override NEAREST: bool = false; // which counts
const TAPS = 8u;

struct Taps {
    light: vec2f,             // in pixels
    size: vec2u,              // of the result
    apron: f32,               // of the source
    inset: f32,               // of the source, less that of the result
    taps: array<vec4f, TAPS>, // part of the way to the light, weight
    gain: vec4f,              // of the sum, in the last pass
    nearest: vec4f,           // of the nearest sample; w: part of the way to the light
}

@group(0) @binding(0) var<uniform> frame: Taps;
@group(0) @binding(1) var source: texture_2d<f32>; // what the pass before gave
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var result: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var emitted: texture_2d<f32>;

@compute @workgroup_size(64)
fn eight(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) {
        return;
    }
    let whole = vec2f(textureDimensions(source));
    let x = vec2f(id.xy) + 0.5 - (frame.apron - frame.inset);
    let way = x - frame.light;
    var sum = vec3f(0.0);
    for (var k = 0u; k < TAPS; k++) {
        let at = (x - frame.taps[k].x * way + frame.apron) / whole;
        sum += frame.taps[k].y * textureSampleLevel(source, bilinear, at, 0.0).rgb;
    }
    if (LAST) {
        sum *= frame.gain.rgb;
        if (NEAREST) {
            sum += frame.nearest.rgb * textureSampleLevel(emitted, bilinear, (x - frame.nearest.w * way + frame.apron) / whole, 0.0).rgb;
        }
        if (ADD) {
            sum += textureLoad(before, id.xy, 0).rgb;
        }
    }
    textureStore(result, id.xy, vec4f(nearest_half(sum), 1.0));
}
