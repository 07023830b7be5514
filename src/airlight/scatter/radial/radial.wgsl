// The direct sum: Eq. 4 of GPU Gems 3, chapter 13, or its Listing 13-1.
//! include "gpu/half.wgsl"
//! include "scatter/jitter.wgsl"
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
    let way = (x - rays.light) * rays.step;
    let first = offset(p);
    var at = (x - way * (first + select(0.0, 1.0, LISTING))) * scale + shift;
    let stride = way * scale;
    var weight = select(pow(rays.decay, first), 1.0, LISTING);
    var sum = vec3f(0.0);
    let samples = rays.samples;
    let decay = rays.decay;
    for (var i = 0u; i < samples; i++) {
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
