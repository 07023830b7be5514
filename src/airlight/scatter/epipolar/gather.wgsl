// The gather from epipolar lines to pixels, shared by its two forms: gather_raster.wgsl for adapters that run on a CPU,
// gather_compute.wgsl for GPUs.
//! include "wgsl/half.wgsl"
override ADD: bool = false;   // add to what earlier lights gave
override BASE: bool = false;  // Listing 13-1: the pixel itself, unweighted
const NEAR_LIGHT_RADIUS_PX = 20u; // half the side of the square around the light that takes the direct sum

struct Frame {
    size: vec2u,
    light: vec2f,             // in pixels
    diagonal: vec2f,          // x - y and x + y of the light
    scale: vec2f,             // 1 / size of the sums' texture
    base: vec4f,              // gain of the pixel itself; w: the source's apron in pixels
    ray: vec4f,               // density, lambda; z: weight of a tap that makes the sum of all exact for constant light; w: taps
    gain: vec4f,
    first: vec4u,             // of the rows of the quadrants right, left, down, up
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var sums: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var before: texture_2d<f32>;
@group(0) @binding(4) var source: texture_2d<f32>;

/// Interpolates the sums at texture coordinates.
fn sum_at(uv: vec2f) -> vec3f {
    return textureSampleLevel(sums, bilinear, uv, 0.0).rgb;
}

/// Adds to a pixel's sum what the listing and earlier lights have there.
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

/// Sums the rays of a pixel near the light directly: there S varies faster than any grid.
fn direct_sum(p: vec2u) -> vec3f {
    let x = vec2f(p) + 0.5;
    let ray = frame.ray.x * (x - frame.light);
    var sum = vec3f(0.0);
    for (var i = 0u; i < u32(frame.ray.w); i++) {
        let s = (f32(i) + 0.5) / frame.ray.w;
        let at = (x - s * ray + frame.base.w) / vec2f(textureDimensions(source));
        sum += exp(-frame.ray.y * s) * textureSampleLevel(source, bilinear, at, 0.0).rgb;
    }
    return frame.gain.rgb * frame.ray.z * sum;
}
