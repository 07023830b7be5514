// The copy on which rays are found: means over areas of the picture, linear, white at 1. Twin: shrink in planes.py.
override TAPS: u32 = 1u;      // pixels that an area touches along an axis, at most
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
    let first = vec2f(id.xy) * ratio;
    let last = first + ratio;
    let corner = vec2u(first);
    var sum = vec4f(0.0);
    for (var j = 0u; j < TAPS; j++) {
        for (var i = 0u; i < TAPS; i++) {
            let at = corner + vec2u(i, j);
            let shares = max(min(vec2f(at) + 1.0, last) - max(vec2f(at), first), vec2f(0.0));
            var color = textureLoad(picture, min(at, full - 1u), 0).rgb;
            if (CODES) { color = decoded(color); }
            sum += shares.x * shares.y * vec4f(color, 1.0);
        }
    }
    let mean = sum.rgb * (shrunk.scale / sum.a);
    textureStore(small, id.xy, vec4f(clamp(mean, vec3f(0.0), vec3f(65504.0)), 1.0));
}
