// The direct sum of n samples between a pixel x and the light l (Mitchell, GPU Gems 3, chapter 13).
//
//     mean, Eq. 4:            L(x) = exposure weight / n sum_{i < n} decay^(i + o) I(x - (i + o) step)
//     listing, Listing 13-1:  L(x) = exposure (I(x) + weight sum_{i < n} decay^i I(x - (i + 1 + o) step)),    step = density / n (x - l)
//
// An invocation sums one pixel of the layer. o, 0..1, is the pixel's offset in its step (wgsl/jitter.wgsl). The sum may be taken at half
// or a quarter of the resolution (13.3.1): resample.wgsl makes the smaller source, and the full layer. Rows are dispatched in parts, so
// that an interrupt is answered between them.
// Twin: reference/radial.py:direct_sum.
//! include "wgsl/half.wgsl"
//! include "wgsl/jitter.wgsl"
override LISTING: bool = false;
override BASE: bool = false;  // the pixel itself, unweighted
override ADD: bool = false;   // add to what earlier lights gave

struct Rays {
    size: vec2u,              // of the layer
    light: vec2f,             // normalised
    apron: f32,               // of the source, in its pixels
    samples: u32,
    step: f32,                // density / n
    decay: f32,
    gain: vec4f,              // exposure weight / n (mean), or exposure weight (listing); times the light's colour
    base: vec4f,              // exposure (listing); times the light's colour
    row: u32,                 // first row of this dispatch
}

@group(0) @binding(0) var<storage, read> rays: Rays; // lavapipe compiles a shader anew for each value of a uniform that ends a loop
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var layer: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var noise: texture_2d<f32>;

/// Sums a pixel of the layer.
@compute @workgroup_size(64)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y + rays.row);
    if (p.x >= rays.size.x || p.y >= rays.size.y) {
        return;
    }
    let inner = vec2f(textureDimensions(source)) - 2.0 * rays.apron;
    let scale = inner / vec2f(textureDimensions(source));
    let shift = rays.apron / vec2f(textureDimensions(source));
    let x = (vec2f(p) + 0.5) / vec2f(rays.size);
    // Begin at the first sample, and step towards the light
    let step = (x - rays.light) * rays.step;
    let first = offset(p);
    var at = (x - step * (first + select(0.0, 1.0, LISTING))) * scale + shift;
    let stride = step * scale;
    var weight = select(pow(rays.decay, first), 1.0, LISTING);
    var sum = vec3f(0.0);
    let samples = rays.samples;
    let decay = rays.decay;
    for (var i = 0u; i < samples; i++) {
        // Add the sample by its weight, and go on to the next
        sum += weight * textureSampleLevel(source, bilinear, at, 0.0).rgb;
        weight *= decay;
        at -= stride;
    }
    var out = rays.gain.rgb * sum;
    if (BASE) {
        out += rays.base.rgb * textureSampleLevel(source, bilinear, x * scale + shift, 0.0).rgb;
    }
    if (ADD) {
        out += textureLoad(before, p, 0).rgb;
    }
    textureStore(layer, p, vec4f(nearest_half(out), 1.0));
}
