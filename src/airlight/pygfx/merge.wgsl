// The picture of a scene with its shafts on it: light adaptation (13.8), then a tone curve. Twin: composite/adapt.py:adapt.
//! include "wgsl/fullscreen.wgsl"
//! include "wgsl/luminance.wgsl"
//! include "pygfx/merged.wgsl"
override ADAPT: bool = false;
override FILMIC: bool = false;
override SHOW: u32 = 0u;        // 0 the picture, 1 occlusion, 2 source, 3 lines

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(7) var<storage, read> balance: array<f32>; // balance.wgsl: scale, white
@group(0) @binding(9) var source: texture_2d<f32>;

/// Maps to display-linear 0..1 by the ACES curve and its desaturation, fitted by Stephen Hill (BakingLab, ACES.hlsl), at the exposure usual
/// with it, 1 / 0.6. Twin: reference/scene.py:filmic.
fn filmic(color: vec3f) -> vec3f {
    let into = mat3x3f(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    let back = mat3x3f(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    let v = into * (clamp(color, vec3f(0.0), vec3f(65504.0)) / 0.6);
    let fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(back * fitted, vec3f(0.0), vec3f(1.0));
}

/// Computes the factor of a colour by Reinhard's curve.
fn ramp(color: vec3f) -> f32 {
    let y = balance[0] * max(luminance(color), 0.0);
    return pow(balance[0] * (1.0 + y / (balance[1] * balance[1])) / (1.0 + y), view.adapt);
}

/// Draws every five degrees a line through each light, over the picture dimmed. Twin: reference/scene.py:light_lines.
fn light_lines(uv: vec2f, color: vec3f) -> vec3f {
    var shown = 0.25 * color;
    for (var i = 0u; i < 8u; i++) {
        let ray = view_ray(uv);
        let to = view.aim[i].direction;
        let at = vec2f(to.xy / max(-to.z, 1e-3) - ray.xy) / abs(view.rays.xy) * view.pixels; // pixels
        let turn = atan2(at.y, at.x) * (72.0 / 6.2831853);
        let off = abs(fract(turn) - 0.5) * length(at) * (6.2831853 / 72.0);
        shown = select(shown, vec3f(0.05, 0.25, 0.6), off < 0.7 && view.aim[i].fade > 0.0);
    }
    return shown;
}

/// Shows what `debug` asks for instead of the picture. pixel: `merged`.
fn debug_view(p: vec2i, pixel: vec4f) -> vec4f {
    let uv = (vec2f(p) + 0.5) * view.pixel;
    if (SHOW == 3u) { return vec4f(light_lines(uv, pixel.rgb), 1.0); }
    if (WORLD) { return vec4f(select(textureLoad(aside, p, 0).rgb, transmitted(p), SHOW == 1u), 1.0); }
    if (!LIT) { return vec4f(0.0, 0.0, 0.0, 1.0); } // the source is that of an earlier frame
    let emitted = textureSampleLevel(source, linear, view.region.xy + view.region.zw * uv, 0.0).rgb;
    return vec4f(select(emitted, vec3f(f32(any(emitted > vec3f(0.0)))), SHOW == 1u), 1.0);
}

/// Merges a pixel.
@fragment
fn merge(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let p = vec2i(position.xy);
    let result = merged(p);
    if (SHOW != 0u) { return debug_view(p, result); }
    if (!ADAPT && !FILMIC && result.a == 0.0) { return textureLoad(scene, p, 0); }
    var color = result.rgb;
    if (ADAPT) { color *= ramp(color); }
    if (FILMIC) { color = filmic(color); }
    return vec4f(color, 1.0);
}
