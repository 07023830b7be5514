// Sums what all lights together add to and take from the pixels of the small copy. Each light adds to the sums of those before it; the last
// makes of them the light that comes in, RGB, and the share of a pixel that is taken.
//! include "wgsl/half.wgsl"
//! include "wgsl/luminance.wgsl"
//! include "look/rays.wgsl"
//! include "wgsl/around.wgsl"
override ADD: bool = false;   // to what earlier lights gave
override LAST: bool = true;
override COOKIE: bool = false; // the light has one
const EMITTER = 0.97;
const MOST = 0.35;
const EXTINCTION = 0.20;
const SURFACE = vec3f(0.6, 0.15, 0.40);
const SKY = vec3f(0.42, 0.80, 0.5);
const BRIGHT = vec3f(0.45, 0.80, 0.85);
const SHADE_MOST = 0.30;

struct Look {
    strength: f32,            // solved
    shade: f32,
    dark: vec2f,              // L before which no light is seen, and before which all is
}

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var<uniform> look: Look;
@group(0) @binding(2) var amounts: texture_2d<f32>;
@group(0) @binding(3) var matte: texture_2d<f32>;  // E g, E, L
@group(0) @binding(4) var guide: texture_2d<f32>; // slope and offset from L to its smoothed B; how near
@group(0) @binding(5) var bilinear: sampler;
@group(0) @binding(6) var before: texture_2d<f32>;
@group(0) @binding(7) var field: texture_storage_2d<rgba16float, write>;
@group(0) @binding(8) var<storage, read> around: array<vec4f>;

/// Finds the light that comes in, and the share that is taken, below 0 given, of the sums of added and missing light.
/// base: smoothed lightness. Twin: reference/look.py:change.
fn change(base: f32, sums: vec4f) -> vec4f {
    let light = luminance(sums.rgb);
    let shown = look.strength * smooth_step(base, look.dark.x, look.dark.y) * (1.0 - SKY.z * smooth_step(base, SKY.x, SKY.y));
    let rise = MOST * (1.0 - exp(-shown * light / MOST));
    let hidden = EXTINCTION * look.shade * rise / MOST;
    let risen = base + rise;
    let cube = base * base * base;
    let amount = risen * risen * risen - cube;
    let on_surface = SURFACE.x * smooth_step(base, SURFACE.y, SURFACE.z);
    let gain = on_surface * amount / max(cube, SURFACE.y * SURFACE.y * SURFACE.y);
    let in_air = (1.0 - on_surface) * amount + cube * hidden;
    let less = look.shade * (1.0 - BRIGHT.z * smooth_step(base, BRIGHT.x, BRIGHT.y)) * shown * sums.a;
    let root = 1.0 - SHADE_MOST * (1.0 - exp(-less / max(base, 0.12) / SHADE_MOST));
    return vec4f(in_air / max(light, 1e-9) * sums.rgb, 1.0 - root * root * root * (1.0 - hidden) - gain);
}

/// Adds one light to the field, and finishes it after the last.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(field);
    if (any(id.xy >= size)) { return; }
    let uv = (vec2f(id.xy) + 0.5) / vec2f(size);
    let at = band_uv(polar(uv * rays.box, rays), rays);
    let own = textureLoad(matte, id.xy, 0);
    let amount = textureSampleLevel(amounts, bilinear, at, 0.0).r * (1.0 - EMITTER * own.g);
    var color = rays.color;
    if (COOKIE) { color *= around_factor(around_span((uv * rays.box - rays.light) * length(vec2f(size)))); }
    var sums = vec4f(max(amount, 0.0) * color, max(-amount, 0.0) * luminance(color));
    if (ADD) { sums += textureLoad(before, id.xy, 0); }
    if (LAST) {
        let smoothing = textureSampleLevel(guide, bilinear, uv, 0.0);
        sums = change(smoothing.r * own.b + smoothing.g, sums) * (1.0 - smoothing.b);
    }
    textureStore(field, id.xy, vec4f(nearest_half(sums.rgb), nearest_half(sums.aaa).x));
}
