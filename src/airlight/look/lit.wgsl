// A pixel with the light that its place in the field adds and lacks. Twins: lit, split, visible in reference/look.py.
override NEAR_GIVEN: bool = false; // how near things are is known at every pixel
const WHITE = 0.9911;
const MOST = 0.35;
const EXTINCTION = 0.375;
const DARK = vec2f(0.10, 0.28);
const BRIGHT = vec3f(0.45, 0.80, 0.85);
const SHADE_MOST = 0.3;
const REC709 = vec3f(0.2126, 0.7152, 0.0722);

struct Look {
    strength: f32,            // solved
    shade: f32,
    scale: f32,               // 1 / white
}

@group(0) @binding(0) var<uniform> look: Look;
@group(0) @binding(1) var field: texture_2d<f32>;  // RGB added, missing
@group(0) @binding(2) var guide: texture_2d<f32>;  // slope and offset from L to its smoothed B; how near
@group(0) @binding(3) var near: texture_2d<f32>;
@group(0) @binding(4) var bilinear: sampler;

fn smooth_step(x: f32, low: f32, high: f32) -> f32 {
    let t = clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// What the light adds to a colour, and the share of it that air and missing light take.
fn lit(color: vec3f, place: vec2f) -> vec4f {
    let sums = textureSampleLevel(field, bilinear, place, 0.0);
    let smoothing = textureSampleLevel(guide, bilinear, place, 0.0);
    var hidden_by = smoothing.b;
    if (NEAR_GIVEN) { hidden_by = textureSampleLevel(near, bilinear, place, 0.0).r; }
    let level = pow(max(dot(color, REC709), 1e-20), 1.0 / 3.0);
    let base = smoothing.r * level + smoothing.g;
    let shown = smooth_step(base, DARK.x, DARK.y) * (1.0 - hidden_by);
    let light = dot(sums.rgb, REC709);
    let rise = MOST * (1.0 - exp(-look.strength * light * shown / MOST));
    let hidden = EXTINCTION * look.shade * rise / MOST;
    let risen = base + rise;
    let amount = risen * risen * risen - base * base * base * (1.0 - hidden);
    let less = look.shade * (1.0 - BRIGHT.z * smooth_step(base, BRIGHT.x, BRIGHT.y)) * look.strength * sums.a * shown;
    let root = 1.0 - SHADE_MOST * (1.0 - exp(-less / max(base, 0.12) / SHADE_MOST));
    let dim = root * root * root * (1.0 - hidden);
    let added = amount / max(light, 1e-9) * sums.rgb;
    let room = WHITE - color * dim;
    let fits = select(vec3f(0.0), 1.0 / (1.0 + added / max(room, vec3f(1e-6))), room > vec3f(0.0));
    return vec4f(added * min(fits.r, min(fits.g, fits.b)), 1.0 - dim);
}
