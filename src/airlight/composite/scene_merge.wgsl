// The last pass over a rendered scene: the picture with its layer, exposed, light adaptation (13.8), then a view transform; or a debug view
// of what is behind.
//! include "wgsl/fullscreen.wgsl"
//! include "wgsl/luminance.wgsl"
//! include "composite/scene.wgsl"
//! include "composite/tone.wgsl"
//! include "wgsl/srgb.wgsl"
override ADAPT: bool = false;
override EXPOSE: bool = false;
override VIEW: u32 = 0u;        // one of these, as VIEWS of view.py
override SHOW: u32 = 0u;        // one of these, as DEBUG_VIEWS of scene.py

const FILMIC = 1u;              // else the picture is linear
const AGX = 2u;
const TABLE = 3u;

const PICTURE = 0u;
const OCCLUSION = 1u;           // of a medium: its transmittance
const LINES = 3u;               // else the source; of a medium: its in-scattered radiance
const MOST = 65504.0;           // that a half float holds: beyond it drivers write infinity, or no number

@group(0) @binding(0) var<uniform> view: SceneUniforms;
@group(0) @binding(7) var<storage, read> balance: array<f32>; // balance.wgsl: scale, white
@group(0) @binding(9) var source: texture_2d<f32>;
@group(0) @binding(10) var view_table: texture_3d<f32>; // of codes, over view_coordinate: view.py

/// Draw every five degrees a line through each light, over the picture dimmed. Twin: reference/scene.py:lines.
fn lines(uv: vec2f, color: vec3f) -> vec3f {
    var shown = 0.25 * color;
    for (var i = 0u; i < 8u; i++) {
        let ray = view_ray(uv);
        let to_light = view.aim[i].direction;
        let at = vec2f(to_light.xy / max(-to_light.z, 1e-3) - ray.xy) / abs(view.rays.xy) * view.pixels; // pixels
        let turn = atan2(at.y, at.x) * (72.0 / 6.2831853);
        let off = abs(fract(turn) - 0.5) * length(at) * (6.2831853 / 72.0);
        shown = select(shown, vec3f(0.05, 0.25, 0.6), off < 0.7 && view.aim[i].fade > 0.0);
    }
    return shown;
}

/// Show what SHOW asks for instead of the picture. pixel: as composited gives it.
fn debug_view(p: vec2i, pixel: vec4f) -> vec4f {
    let uv = (vec2f(p) + 0.5) * view.pixel;
    if (SHOW == LINES) { return vec4f(lines(uv, pixel.rgb), 1.0); }
    if (MEDIUM) { return vec4f(select(textureLoad(aside, p, 0).rgb, transmitted(p), SHOW == OCCLUSION), 1.0); }
    if (!LIT) { return vec4f(0.0, 0.0, 0.0, 1.0); } // the source is that of an earlier frame
    let emitted = textureSampleLevel(source, linear, view.region.xy + view.region.zw * uv, 0.0).rgb;
    return vec4f(select(emitted, vec3f(f32(any(emitted > vec3f(0.0)))), SHOW == OCCLUSION), 1.0);
}

/// Look a linear colour up in the table of a view: linear as its display shows it.
fn looked_up(color: vec3f) -> vec3f {
    let side = vec3f(textureDimensions(view_table));
    return srgb_decode(textureSampleLevel(view_table, linear, (view_coordinate(color) * (side - 1.0) + 0.5) / side, 0.0).rgb);
}

/// Map linear radiance by the view transform.
fn displayed(color: vec3f) -> vec3f {
    if (VIEW == FILMIC) { return filmic(color); }
    if (VIEW == AGX) { return agx(color); }
    if (VIEW == TABLE) { return looked_up(color); }
    return color;
}

/// Merge a pixel: composite, expose, adapt, map its tones.
@fragment
fn merge(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let p = vec2i(position.xy);
    let result = composited(p);
    if (SHOW != PICTURE) { return min(debug_view(p, result), vec4f(MOST)); }
    if (!ADAPT && !EXPOSE && VIEW == 0u && result.a == 0.0) { return textureLoad(scene, p, 0); }
    var color = result.rgb;
    if (EXPOSE) { color *= view.exposure; }
    if (ADAPT) { color *= ramp_gain(luminance(color), balance[0], balance[1], view.adapt); }
    return vec4f(min(displayed(color), vec3f(MOST)), 1.0);
}
