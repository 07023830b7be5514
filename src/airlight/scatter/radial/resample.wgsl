// Down to half or quarter resolution by a box, and up again by the bilinear filter (GPU Gems 3, 13.3.1).
//! include "wgsl/half.wgsl"
override FACTOR: u32 = 2u;
override APRON: i32 = 0;      // texels of nothing around source and result, 0 or 1
override ADD: bool = false;   // add to what earlier lights gave

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var bilinear: sampler;
@group(0) @binding(2) var result: texture_storage_2d<rgba16float, write>;
@group(0) @binding(3) var before: texture_2d<f32>;

/// Averages the texels that one of the smaller picture covers.
@compute @workgroup_size(64)
fn down(@builtin(global_invocation_id) id: vec3u) {
    // each low texel is the mean of the full-resolution texels it covers; where the size does not divide, of those nearest
    let low = vec2f(textureDimensions(result)) - 2.0 * f32(APRON);
    let p = vec2f(vec2i(id.xy) - APRON);
    if (any(p < vec2f(0.0)) || any(p >= low)) {
        textureStore(result, id.xy, vec4f(0.0, 0.0, 0.0, 1.0));
        return;
    }
    let full = vec2f(textureDimensions(source));
    var sum = vec3f(0.0);
    for (var j = 0u; j < FACTOR; j++) {
        for (var i = 0u; i < FACTOR; i++) {
            let at = (p + (vec2f(f32(i), f32(j)) + 0.5) / f32(FACTOR)) / low;
            sum += textureSampleLevel(source, bilinear, (at * (full - 2.0 * f32(APRON)) + f32(APRON)) / full, 0.0).rgb;
        }
    }
    textureStore(result, id.xy, vec4f(nearest_half(sum / f32(FACTOR * FACTOR)), 1.0));
}

/// Interpolates a pixel of the larger picture.
@compute @workgroup_size(64)
fn up(@builtin(global_invocation_id) id: vec3u) {
    let at = (vec2f(id.xy) + 0.5) / vec2f(textureDimensions(result));
    var sum = textureSampleLevel(source, bilinear, at, 0.0).rgb;
    if (ADD) {
        sum += textureLoad(before, id.xy, 0).rgb;
    }
    textureStore(result, id.xy, vec4f(nearest_half(sum), 1.0));
}
