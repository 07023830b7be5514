// Puts daylight on a picture: L = L0 T + (1 - D) L1 + Lms, of the table of view rays, or Eq. 1 of GPU Gems 3 in even air.
//! include "scatter/daylight/view_table.wgsl"
//! include "scatter/daylight/hoffman_preetham.wgsl"
//! include "wgsl/half.wgsl"
override EVEN_AIR: bool = false; // by Hoffman and Preetham
override SHADOWED: bool = false; // shadow holds D
override ALL: bool = false;     // D takes light of what is seen too: Eq. 2 as printed
override SKY: u32 = 1u;         // what is behind the air where nothing is seen: one of these, as SKIES of passes.py

const KEEP = 0u;                // the picture's own sky, which has its daylight
const REPLACE = 1u;             // the ground, and space with the sun in it
const MOST = 65504.0;           // that a half float holds

struct Compose {
    rays: vec4f,                // projection.py:eye_rays
    depth: vec4f,               // projection.py:depth_terms
    disc: vec3f,                // radiance of the sun's disc above the air
    flat_rays: f32,             // 1 without perspective
    ground: vec3f,              // radiance of the ground
    edge: f32,                  // radians of half a pixel
    rayleigh: vec3f,            // 1/m, of even air
    g: f32,
    mie: vec3f,
    printed: u32,               // the phase function of even air's aerosol is as printed
    irradiance: vec3f,          // of the sun, in even air
    size: vec2u,
}

@group(0) @binding(0) var<uniform> pass_: Compose;
@group(0) @binding(2) var source: texture_2d<f32>;
@group(0) @binding(3) var shadow: texture_2d<f32>; // D, the dark part of light scattered once
@group(0) @binding(4) var picture: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var radiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(6) var transmittance: texture_storage_2d<rgba32float, write>;

struct Seen {
    behind: vec3f,              // L0
    added: vec3f,
    through: vec3f,
}

/// Evaluate the part of a pixel, 0 to 1, that the sun's disc covers. direction, to_sun: unit; edge: radians of half a pixel.
/// Twin: reference/daylight_view.py:disc_part.
fn disc_part(direction: vec3f, to_sun: vec3f, edge: f32) -> f32 {
    return clamp((0.0046739918 - length(direction - to_sun)) / (2.0 * edge) + 0.5, 0.0, 1.0);
}

/// Find the way, m, to what a pixel sees along its ray, NO_END where that is the sky. direction: unit, view space.
fn way_seen(p: vec2u, direction: vec3f) -> f32 {
    let stored = stored_depth(p);
    if (IN_METRES == ALONG_RAY) { return select(stored, NO_END, !(stored < NO_END)); }
    if (IN_METRES == ALONG_AXIS) { return select(stored / -direction.z, NO_END, !(stored < NO_END)); }
    let ahead = (pass_.depth.x * stored + pass_.depth.y) / (pass_.depth.z * stored + pass_.depth.w);
    return select(ahead / -direction.z, NO_END, stored >= 1.0);
}

/// Evaluate what the air between the eye and a way of t m adds, and lets through.
fn in_the_air(direction: vec3f, t: f32) -> Gathered {
    if (!EVEN_AIR) { return daylight_at(direction, t); }
    let mu = dot(direction, daylight.up);
    let way = way_to_ground(daylight.height, mu);
    let end = select(t, select(way_in_even_air(mu), way, way > 0.0), t >= NO_END);
    let cosine = clamp(dot(direction, daylight.to_sun), -1.0, 1.0);
    let single = pass_.irradiance * hoffman_preetham_light(cosine, pass_.rayleigh, pass_.mie, pass_.g, end, pass_.printed == 1u);
    return Gathered(single, vec3f(0.0), exp(-(pass_.rayleigh + pass_.mie) * end));
}

/// Evaluate what stands behind the air, what it adds and lets through, at a pixel.
fn seen(p: vec2u) -> Seen {
    let at = pass_.rays.xy * ((vec2f(p) + 0.5) / vec2f(pass_.size)) + pass_.rays.zw;
    let direction = normalize(vec3f((1.0 - pass_.flat_rays) * at, -1.0));
    let t = way_seen(p, direction);
    let air = in_the_air(direction, t);
    var dark = vec3f(0.0);
    if (SHADOWED) { dark = clamp(textureLoad(shadow, p, 0).rgb, vec3f(0.0), vec3f(1.0)); }
    let whole = air.single + air.multiple;
    var behind = textureLoad(source, p, 0).rgb;
    if (t >= NO_END) {
        if (SKY == KEEP) {
            let missing = dark * air.single / max(whole, vec3f(1e-30));
            return Seen(behind, -missing * behind, vec3f(1.0));
        }
        if (SKY == REPLACE) {
            let below = way_to_ground(daylight.height, dot(direction, daylight.up)) > 0.0;
            behind = select(pass_.disc * disc_part(direction, daylight.to_sun, pass_.edge), pass_.ground, below);
        }
    }
    if (ALL) { return Seen(behind, whole - dark * whole, air.transmittance - dark * air.transmittance); }
    return Seen(behind, whole - dark * air.single, air.transmittance);
}

/// Write the picture in its air.
@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= pass_.size)) { return; }
    let found = seen(id.xy);
    let color = clamp(found.behind * found.through + found.added, vec3f(-MOST), vec3f(MOST));
    textureStore(picture, id.xy, vec4f(nearest_half(color), textureLoad(source, id.xy, 0).a));
}

/// Write what the air adds, with a sky that is replaced, and what it lets through: the picture is the source times that plus what is added.
@compute @workgroup_size(8, 8)
fn parts(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= pass_.size)) { return; }
    let found = seen(id.xy);
    let kept = textureLoad(source, id.xy, 0).rgb;
    let is_own = all(kept == found.behind);
    textureStore(radiance, id.xy, vec4f(select(found.behind * found.through + found.added, found.added, is_own), 1.0));
    textureStore(transmittance, id.xy, vec4f(select(vec3f(0.0), found.through, is_own), 1.0));
}
