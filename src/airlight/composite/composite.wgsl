// The layer put on an 8-bit sRGB picture: haze taken away, added or screened in linear light, encoded, dithered. Twins: lift_veil and
// blend in blend.py, encode_codes in files/colour.py. Where nothing is added the codes stay as they are.
//! include "gpu/srgb.wgsl"
override SCREEN: bool = true;
override VEIL: bool = true;

const WHITE = 0.9911;         // code 254

struct Rule {
    peak: f32,                // luminance of the brightest shafts
    veil: f32,                // veil^4
    mix: f32,
}

@group(0) @binding(0) var<uniform> rule: Rule;
@group(0) @binding(1) var codes: texture_2d<f32>;
@group(0) @binding(2) var layer: texture_2d<f32>;
@group(0) @binding(3) var noise: texture_2d<f32>; // in (0, 1), a tile
@group(0) @binding(4) var result: texture_storage_2d<rgba8unorm, write>;

fn lift_veil(color: vec3f) -> vec3f {
    let q = min(dot(color, vec3f(0.2126, 0.7152, 0.0722)) / rule.peak, 1e4);
    let t = q * q * q * q;
    return color * (t / max(t + rule.veil, 1e-30));
}

fn composited(p: vec2u) -> vec4f {
    let before = textureLoad(codes, p, 0);
    var added = textureLoad(layer, p, 0).rgb;
    if (VEIL) { added = lift_veil(added); }
    added *= rule.mix;
    let a = srgb_decode(before.rgb);
    if (SCREEN) { added = max(WHITE - a, vec3f(0.0)) * (added / (1.0 + added)); }
    if (all(added == vec3f(0.0))) {
        return before;
    }
    let code = 255.0 * srgb_encode(clamp(a + added, vec3f(0.0), vec3f(1.0)));
    let grain = textureLoad(noise, p % textureDimensions(noise), 0).rgb;
    return vec4f(min(floor(code + grain), vec3f(255.0)) / 255.0, before.a);
}

@compute @workgroup_size(64)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    let p = vec2u(id.x, id.y);
    if (all(p < textureDimensions(codes))) {
        textureStore(result, p, composited(p));
    }
}
