// A picture of linear light, whose exact means over areas are taken. Twin: planes.py:shrink. TAPS: pixels that an area touches.
struct Scaled {
    scale: f32,               // 1 / white
}

@group(0) @binding(4) var picture: texture_2d<f32>;
@group(0) @binding(5) var<uniform> scaled: Scaled;

/// Averages the area under a pixel of the copy; pixels on its border count by their share.
fn mean_color(p: vec2u, size: vec2u) -> vec3f {
    let full = textureDimensions(picture);
    let ratio = vec2f(full) / vec2f(size);
    let first = vec2f(p) * ratio;
    let last = first + ratio;
    let corner = vec2u(first);
    var sum = vec4f(0.0);
    for (var j = 0u; j < TAPS; j++) {
        for (var i = 0u; i < TAPS; i++) {
            let at = corner + vec2u(i, j);
            let shares = max(min(vec2f(at) + 1.0, last) - max(vec2f(at), first), vec2f(0.0));
            sum += shares.x * shares.y * vec4f(clamp(textureLoad(picture, min(at, full - 1u), 0).rgb, vec3f(0.0), vec3f(1e30)), 1.0);
        }
    }
    return sum.rgb * (scaled.scale / sum.a);
}

//! include "look/matte.wgsl"
