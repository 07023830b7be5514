// A picture on the canvas, without and with its shafts, side by side or one of them. What a pipeline need not do is left out of it by
// constants: software adapters carry out both sides of a branch.
//! include "wgsl/fullscreen.wgsl"
//! include "wgsl/luminance.wgsl"
//! include "wgsl/srgb.wgsl"
override SIDES: u32 = 3u;             // 1: only `before` is shown, 2: only `after`, 3: both
override EXACT: bool = false;         // a pixel of the picture is one of the canvas
override BEFORE_LINEAR: bool = false; // linear light, else code values
override AFTER_LINEAR: bool = false;
override TARGET_LINEAR: bool = false; // what is written is encoded by the target
override ADAPTS: bool = false;        // `after` is adapted by the ramp
override GREY: bool = false;          // of `after` the green channel is shown

struct Show {
    area: vec4f,              // x, y, width, height of the picture on the canvas, px
    split: f32,               // px; left of it `before` is shown
    apron: i32,               // of `after`, px
    gain: f32,                // of `after`
    scale: f32,               // of the ramp
    white: f32,
    strength: f32,
}

@group(0) @binding(0) var<uniform> show: Show;
@group(0) @binding(1) var before: texture_2d<f32>;
@group(0) @binding(2) var after: texture_2d<f32>;

/// Adapts a colour by Reinhard's curve, which keeps its hue. Twin: reference/colour.py:adapted.
fn adapted(color: vec3f) -> vec3f {
    let y = show.scale * max(luminance(color), 0.0);
    let gain = show.scale * (1.0 + y / (show.white * show.white)) / (1.0 + y);
    return color * pow(gain, show.strength);
}

/// Reads a pixel of the picture without shafts, as sRGB codes.
fn texel_before(p: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(before));
    let color = textureLoad(before, clamp(p, vec2i(0), size - 1), 0).rgb;
    if (BEFORE_LINEAR) { return srgb_encode(clamp(color, vec3f(0.0), vec3f(1.0))); }
    return color;
}

/// Reads a pixel of the picture with shafts, as sRGB codes.
fn texel_after(p: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(after)) - 2 * show.apron;
    var color = textureLoad(after, clamp(p, vec2i(0), size - 1) + show.apron, 0).rgb * show.gain;
    if (GREY) { color = vec3f(color.g); }
    if (ADAPTS) { color = adapted(color); }
    if (AFTER_LINEAR) { return srgb_encode(clamp(color, vec3f(0.0), vec3f(1.0))); }
    return color;
}

/// Reads a pixel of one of the two.
fn texel(p: vec2i, is_before: bool) -> vec3f {
    if (SIDES == 1u) { return texel_before(p); }
    if (SIDES == 2u) { return texel_after(p); }
    if (is_before) { return texel_before(p); }
    return texel_after(p);
}

/// Interpolates between four pixels; q in pixels of the picture, which `after` may have fewer of.
fn between(q: vec2f, is_before: bool) -> vec3f {
    let size = select(vec2f(textureDimensions(after) - vec2u(2u * u32(show.apron))), vec2f(textureDimensions(before)), is_before);
    let p = q * (size / vec2f(textureDimensions(before))) - 0.5;
    let low = vec2i(floor(p));
    let f = p - floor(p);
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let d = vec2i(i & 1, i >> 1u);
        let w = mix(1.0 - f, f, vec2f(d));
        sum += w.x * w.y * texel(low + d, is_before);
    }
    return sum;
}

/// Shows a pixel of the canvas: the mean of the picture under it.
@fragment
fn show_picture(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let is_before = position.x < show.split;
    let at = position.xy - show.area.xy;
    var color = vec3f(0.0);
    if (EXACT) {
        color = texel(vec2i(at), is_before);
    } else {
        let size = vec2f(textureDimensions(before));
        let step = size / show.area.zw; // picture px a canvas px
        let taps = clamp(i32(ceil(max(step.x, step.y) - 1e-3)), 1, 4);
        for (var i = 0; i < taps * taps; i++) {
            let off = (vec2f(f32(i % taps), f32(i / taps)) + 0.5) / f32(taps) - 0.5;
            color += between((at + off) * step, is_before);
        }
        color /= f32(taps * taps);
    }
    if (TARGET_LINEAR) { color = srgb_decode(color); }
    return vec4f(color, 1.0);
}
