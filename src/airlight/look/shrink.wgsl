// The copy on which rays are found: means of a regular grid of the picture's pixels, linear, white at 1. Twin: shrink in planes.py, whose
// means are exact.
override TAPS: u32 = 1u;      // along each axis
override CODES: bool = false; // the picture holds sRGB codes

struct Shrunk {
    scale: f32,               // 1 / white
}

@group(0) @binding(0) var<uniform> shrunk: Shrunk;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var small: texture_storage_2d<rgba16float, write>;

/// The sRGB curve to within 0.0008, by a polynomial, since it is taken of every pixel: a mean asks for no more.
fn decoded(code: vec3f) -> vec3f {
    return code + code * (1.0 - code) * (-0.9634 + code * (-0.4178 + code * 0.1125));
}

@compute @workgroup_size(64)
fn shrink(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(small);
    if (any(id.xy >= size)) { return; }
    let full = textureDimensions(picture);
    let ratio = vec2f(full) / vec2f(size);
    var sum = vec3f(0.0);
    for (var j = 0u; j < TAPS; j++) {
        for (var i = 0u; i < TAPS; i++) {
            let at = (vec2f(id.xy) + (vec2f(f32(i), f32(j)) + 0.5) / f32(TAPS)) * ratio;
            let color = textureLoad(picture, min(vec2u(at), full - 1u), 0).rgb;
            if (CODES) { sum += decoded(color); } else { sum += color; }
        }
    }
    let mean = sum * (shrunk.scale / f32(TAPS * TAPS));
    textureStore(small, id.xy, vec4f(clamp(mean, vec3f(0.0), vec3f(65504.0)), 1.0));
}
