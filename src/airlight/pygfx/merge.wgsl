// The picture of a scene with its shafts on it: light adaptation (13.8), then a tone curve. Twins: filmic, ramp in reference/scene.py.
//! include "wgsl/fullscreen.wgsl"
//! include "wgsl/luminance.wgsl"
//! include "pygfx/merged.wgsl"
override ADAPT: bool = false;
override FILMIC: bool = false;
override SHOW: u32 = 0u;        // 0 the picture, 1 occlusion, 2 source, 3 lines

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(7) var<storage, read> balance: array<f32>; // balance.wgsl: scale, white
@group(0) @binding(9) var source: texture_2d<f32>;

/// The ACES curve and its desaturation, fitted by Stephen Hill (BakingLab, ACES.hlsl), at the exposure usual with it, 1 / 0.6.
fn filmic(color: vec3f) -> vec3f {
    let into = mat3x3f(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    let back = mat3x3f(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    let v = into * (clamp(color, vec3f(0.0), vec3f(65504.0)) / 0.6);
    let fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(back * fitted, vec3f(0.0), vec3f(1.0));
}

/// Reinhard's curve as a factor of a colour: composite/adapt.py.
fn ramp(color: vec3f) -> f32 {
    let y = balance[0] * max(luminance(color), 0.0);
    return pow(balance[0] * (1.0 + y / (balance[1] * balance[1])) / (1.0 + y), view.adapt);
}

/// Every so many degrees a line through each light, over the picture dimmed.
fn lines(uv: vec2f, color: vec3f) -> vec3f {
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

fn shown(p: vec2i, pixel: vec4f) -> vec4f {
    let uv = (vec2f(p) + 0.5) * view.pixel;
    if (SHOW == 3u) { return vec4f(lines(uv, pixel.rgb), 1.0); }
    if (WORLD) { return vec4f(select(textureLoad(aside, p, 0).rgb, transmitted(p), SHOW == 1u), 1.0); }
    if (!LIT) { return vec4f(0.0, 0.0, 0.0, 1.0); } // the source is that of an earlier frame
    let emitted = textureSampleLevel(source, linear, view.region.xy + view.region.zw * uv, 0.0).rgb;
    return vec4f(select(emitted, vec3f(f32(any(emitted > vec3f(0.0)))), SHOW == 1u), 1.0);
}

@fragment
fn merge(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let p = vec2i(place.xy);
    let result = merged(p);
    if (SHOW != 0u) { return shown(p, result); }
    if (!ADAPT && !FILMIC && result.a == 0.0) { return textureLoad(scene, p, 0); }
    var color = result.rgb;
    if (ADAPT) { color *= ramp(color); }
    if (FILMIC) { color = filmic(color); }
    return vec4f(color, 1.0);
}
