// The composite of printed slices: the mean of several samples around a pixel, each interpolated.
struct Blur {
    count: u32,                 // samples
    radius: f32,                // pixels
}

@group(0) @binding(0) var<storage, read> blur: Blur;
@group(0) @binding(1) var before: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_storage_2d<rgba32float, write>;

//! include "wgsl/unit_at.wgsl"

/// Place the k-th of so many samples of a blur, in radii from its middle: one there, the others evenly on a circle.
/// Twin: reference/slices.py:blur_place.
fn blur_place(k: u32, count: u32) -> vec2f {
    return select(unit_at(6.2831853 * f32(k - 1u) / max(f32(count) - 1.0, 1.0)), vec2f(0.0), k == 0u);
}

/// Read what was sliced between pixels.
fn sliced(at: vec2f) -> vec3f {
    let most = vec2i(textureDimensions(before)) - 1;
    let low = floor(at - 0.5);
    let part = at - 0.5 - low;
    let a = clamp(vec2i(low), vec2i(0), most);
    let b = clamp(vec2i(low) + 1, vec2i(0), most);
    let top = mix(textureLoad(before, a, 0), textureLoad(before, vec2i(b.x, a.y), 0), part.x);
    let bottom = mix(textureLoad(before, vec2i(a.x, b.y), 0), textureLoad(before, b, 0), part.x);
    return mix(top, bottom, part.y).rgb;
}

/// Blur a pixel. Twin: reference/slices.py:blurred.
@compute @workgroup_size(8, 8)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    let pixels = textureDimensions(layer);
    if (any(id.xy >= pixels)) { return; }
    let ratio = vec2f(textureDimensions(before)) / vec2f(pixels);
    var sum = vec3f(0.0);
    for (var k = 0u; k < blur.count; k++) {
        sum += sliced((vec2f(id.xy) + 0.5 + blur.radius * blur_place(k, blur.count)) * ratio);
    }
    textureStore(layer, id.xy, vec4f(sum / f32(blur.count), 0.0));
}
