// The way back, what its two forms share: gather_raster.wgsl for adapters that run on a CPU, gather_compute.wgsl for GPUs.
//! include "gpu/half.wgsl"
override ADD: bool = false;   // add to what earlier lights gave
override BASE: bool = false;  // Listing 13-1: the pixel itself, unweighted
const NEAR = 20u;             // pixels around the light that take the direct sum

struct Frame {
    size: vec2u,
    light: vec2f,             // in pixels
    diagonal: vec2f,          // x - y and x + y of the light
    scale: vec2f,             // 1 / size of the sums' texture
    base: vec4f,              // gain of the pixel itself; w: the source's apron in pixels
    ray: vec4f,               // density, lambda; z: weight of a tap that makes the sum of all exact for constant light; w: taps
    gain: vec4f,
    first: vec4u,             // of the ways of the quadrants right, left, down, up
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var sums: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var before: texture_2d<f32>;
@group(0) @binding(4) var source: texture_2d<f32>;

fn sum_at(place: vec2f) -> vec3f {
    return textureSampleLevel(sums, bilinear, place, 0.0).rgb;
}

fn finished(p: vec2u, sum: vec3f) -> vec4f {
    var out = sum;
    if (BASE) {
        out += frame.base.rgb * textureLoad(source, p + u32(frame.base.w), 0).rgb;
    }
    if (ADD) {
        out += textureLoad(before, p, 0).rgb;
    }
    return vec4f(nearest_half(out), 1.0);
}

/// The few pixels around the light by the direct sum: there S varies faster than any grid.
fn direct_sum(p: vec2u) -> vec3f {
    let x = vec2f(p) + 0.5;
    let way = frame.ray.x * (x - frame.light);
    var sum = vec3f(0.0);
    for (var i = 0u; i < u32(frame.ray.w); i++) {
        let s = (f32(i) + 0.5) / frame.ray.w;
        let at = (x - s * way + frame.base.w) / vec2f(textureDimensions(source));
        sum += exp(-frame.ray.y * s) * textureSampleLevel(source, bilinear, at, 0.0).rgb;
    }
    return frame.gain.rgb * frame.ray.z * sum;
}
