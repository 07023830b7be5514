// A picture on the canvas, without and with its shafts, side by side or one of them. Twins: srgb_decode, srgb_encode in files/colour.py,
// Ramp.gain in composite/adapt.py.
//! include "gpu/srgb.wgsl"

struct Show {
    area: vec4f,              // x, y, width, height of the picture on the canvas, px
    ground: vec4f,            // colour around it, code values
    split: f32,               // px; left of it `before` is shown
    before_linear: u32,       // 1: linear light, 0: code values
    after_linear: u32,
    target_linear: u32,       // 1: what is written is encoded by the target
    apron: i32,               // of `after`, px
    gain: f32,                // of `after`
    scale: f32,               // of the ramp that adapts `after`
    white: f32,
    strength: f32,            // 0: none of it
}

@group(0) @binding(0) var<uniform> show: Show;
@group(0) @binding(1) var before: texture_2d<f32>;
@group(0) @binding(2) var after: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

fn adapted(color: vec3f) -> vec3f {
    let y = show.scale * max(dot(color, vec3f(0.2126, 0.7152, 0.0722)), 0.0);
    let gain = show.scale * (1.0 + y / (show.white * show.white)) / (1.0 + y);
    return select(color, color * pow(gain, show.strength), show.strength > 0.0);
}

fn code(color: vec3f, linear: u32) -> vec3f {
    return select(color, srgb_encode(clamp(color, vec3f(0.0), vec3f(1.0))), linear == 1u);
}

fn texel_before(p: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(before));
    return code(textureLoad(before, clamp(p, vec2i(0), size - 1), 0).rgb, show.before_linear);
}

fn texel_after(p: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(after)) - 2 * show.apron;
    let color = textureLoad(after, clamp(p, vec2i(0), size - 1) + show.apron, 0).rgb * show.gain;
    return code(adapted(color), show.after_linear);
}

/// Between four pixels; q in pixels of the picture.
fn between(q: vec2f, is_before: bool) -> vec3f {
    let p = q - 0.5;
    let low = vec2i(floor(p));
    let f = p - floor(p);
    if (all(f < vec2f(1e-3))) { // pixel on pixel: its very code
        if (is_before) { return texel_before(low); }
        return texel_after(low);
    }
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let d = vec2i(i & 1, i >> 1u);
        let w = mix(1.0 - f, f, vec2f(d));
        var texel = vec3f(0.0);
        if (is_before) { texel = texel_before(low + d); } else { texel = texel_after(low + d); }
        sum += w.x * w.y * texel;
    }
    return sum;
}

@fragment
fn show_picture(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let at = (place.xy - show.area.xy) / show.area.zw;
    var color = show.ground.rgb;
    if (all(at >= vec2f(0.0)) && all(at < vec2f(1.0))) {
        let size = vec2f(textureDimensions(before));
        let step = size / show.area.zw; // picture px a canvas px
        let taps = clamp(i32(ceil(max(step.x, step.y) - 1e-3)), 1, 4);
        let is_before = place.x < show.split;
        color = vec3f(0.0);
        for (var i = 0; i < taps * taps; i++) {
            let off = (vec2f(f32(i % taps), f32(i / taps)) + 0.5) / f32(taps) - 0.5;
            color += between(at * size + off * step, is_before);
        }
        color /= f32(taps * taps);
    }
    return vec4f(select(color, srgb_decode(color), show.target_linear == 1u), 1.0);
}
