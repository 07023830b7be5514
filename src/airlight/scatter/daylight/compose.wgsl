// Puts daylight on a picture: L = L0 T + (1 - D) L1 + Lms, of the table of view rays, or Eq. 1 of GPU Gems 3 in even air.
//! include "scatter/daylight/view_table.wgsl"
//! include "scatter/daylight/hoffman_preetham.wgsl"
//! include "wgsl/fullscreen.wgsl"
//! include "wgsl/half.wgsl"
override EVEN_AIR: bool = false; // by Hoffman and Preetham
override SHADOWED: bool = false; // shadow holds D
override ALL: bool = false;     // D takes light of what is seen too: Eq. 2 as printed
override SKY: u32 = 1u;         // what is behind the air where nothing is seen: one of these, as SKIES of passes.py

const KEEP = 0u;                // the picture's own sky, which has its daylight
const REPLACE = 1u;             // the ground, and space with the sun in it

struct Compose {
    rays: vec4f,                // projection.py:eye_rays
    depth: vec4f,               // projection.py:depth_terms
    disc: vec3f,                // radiance of the sun's disc above the air, as it is drawn
    flat_rays: f32,             // 1 without perspective
    ground: vec3f,              // radiance of the ground
    edge: f32,                  // radians of half a pixel
    rayleigh: vec3f,            // 1/m, of even air
    g: f32,
    mie: vec3f,
    printed: u32,               // the phase function of even air's aerosol is as printed
    irradiance: vec3f,          // of the sun, in even air
    disc_radius: f32,           // radians
}

@group(0) @binding(0) var<uniform> composing: Compose;
@group(0) @binding(2) var source: texture_2d<f32>;
@group(0) @binding(3) var shadow: texture_2d<f32>; // D, the dark part of light scattered once
struct Angles {                 // of a view ray, cosines
    mu: f32,                    // to the vertical
    along: f32,                 // to the level direction towards the sun
    cosine: f32,                // to the sun
    sine2: f32,                 // squared sine of that, with every digit near the sun
    axial: f32,                 // to the view's axis
}

struct Corner {                 // what is straight over the picture: its corners say it all
    @builtin(position) position: vec4f,
    @location(0) @interpolate(linear) off: vec2f,     // of a ray, 1 along the view's axis: how far it leaves the sun's direction, sideways and up
    @location(1) @interpolate(linear) toward: vec3f,  // how far it goes to the sun, up, and along the level direction towards the sun
}

struct Air {
    single: vec3f,              // nothing where no shadow asks for it
    whole: vec3f,
    through: vec3f,
    ground: f32,                // m, to the ground; NO_END above the horizon
}

struct Seen {
    behind: vec3f,              // L0
    added: vec3f,
    through: vec3f,
}

/// Evaluate the part of a pixel, 0 to 1, that a disc covers whose edge is as soft as the pixel is wide. apart: 1 - cosine to its centre; radius,
/// edge: radians, of the disc and half a pixel. Twin: reference/daylight_view.py:disc_part.
fn disc_part(apart: f32, radius: f32, edge: f32) -> f32 {
    return clamp((radius - sqrt(2.0 * apart)) / (2.0 * edge) + 0.5, 0.0, 1.0);
}

/// Evaluate the angles of a pixel's ray from what is straight over the picture. Twin: reference/daylight_view.py:angles_of.
fn angles_of(off: vec2f, toward: vec3f) -> Angles {
    let away = dot(off, off);
    let shorter = inverseSqrt(away + toward.x * toward.x);
    return Angles(toward.y * shorter, toward.z * shorter, toward.x * shorter, away * shorter * shorter, shorter);
}

/// Find the way, m, to what a pixel sees, NO_END where that is the sky. axial: cosine of its ray to the view's axis.
fn way_seen(p: vec2u, axial: f32) -> f32 {
    let stored = stored_depth(p);
    if (IN_METRES == ALONG_RAY) { return select(stored, NO_END, !(stored < NO_END)); }
    if (IN_METRES == ALONG_AXIS) { return select(stored / axial, NO_END, !(stored < NO_END)); }
    let ahead = (composing.depth.x * stored + composing.depth.y) / (composing.depth.z * stored + composing.depth.w);
    return select(ahead / axial, NO_END, stored >= 1.0);
}

/// Evaluate what the air between the eye and a way of t m adds, of sunlight scattered once and in all, and lets through.
fn in_the_air(angles: Angles, t: f32) -> Air {
    if (!EVEN_AIR) {
        let ray = daylight_place(angles.mu, angles.along, angles.cosine, angles.sine2);
        let end = select(t, ray.end, t >= NO_END);
        let through = daylight_transmittance(ray, end);
        if (!SHADOWED) { return Air(vec3f(0.0), daylight_whole(ray, end), through, ray.ground); }
        return Air(daylight_single(ray, end), daylight_whole(ray, end), through, ray.ground);
    }
    let mu = angles.mu;
    let way = way_to_ground(daylight.height, mu);
    let ground = select(NO_END, way, way > 0.0);
    let end = select(t, min(way_in_even_air(mu), ground), t >= NO_END);
    let cosine = clamp(angles.cosine, -1.0, 1.0);
    let single = composing.irradiance * hoffman_preetham_light(cosine, composing.rayleigh, composing.mie, composing.g, end, composing.printed == 1u);
    return Air(single, single, exp(-(composing.rayleigh + composing.mie) * end), ground);
}

/// Evaluate what stands behind the air, what it adds and lets through, at a pixel. source: the picture there.
fn seen(p: vec2u, corner: Corner, source: vec3f) -> Seen {
    let angles = angles_of(corner.off, corner.toward);
    let t = way_seen(p, angles.axial);
    let air = in_the_air(angles, t);
    var dark = vec3f(0.0);
    if (SHADOWED) { dark = clamp(textureLoad(shadow, p, 0).rgb, vec3f(0.0), vec3f(1.0)); }
    let is_sky = t >= NO_END;
    if (SKY == KEEP && is_sky) { return Seen(source, -(dark * air.single / max(air.whole, vec3f(1e-30))) * source, vec3f(1.0)); }
    var behind = source;
    if (SKY == REPLACE) {
        let apart = select(1.0 - angles.cosine, angles.sine2 / (1.0 + angles.cosine), angles.cosine > 0.0);
        let space = select(composing.ground, composing.disc * disc_part(apart, composing.disc_radius, composing.edge), air.ground >= NO_END);
        behind = select(source, space, is_sky);
    }
    if (ALL) { return Seen(behind, air.whole - dark * air.whole, air.through - dark * air.through); }
    return Seen(behind, air.whole - dark * air.single, air.through);
}

/// Cover the picture, and say of its corners what is straight between them.
@vertex
fn cover_rays(@builtin(vertex_index) i: u32) -> Corner {
    let corner = fullscreen_corner(i, 0.0);
    let at = composing.rays.xy * (vec2f(0.5, -0.5) * corner.xy + 0.5) + composing.rays.zw;
    let ray = vec3f((1.0 - composing.flat_rays) * at, -1.0);
    let side = cross(daylight.up, daylight.ahead);
    let off = vec2f(dot(ray, side), dot(ray, cross(daylight.to_sun, side)));
    return Corner(corner, off, vec3f(dot(ray, daylight.to_sun), dot(ray, daylight.up), dot(ray, daylight.ahead)));
}

/// Draw the picture in its air.
@fragment
fn compose(corner: Corner) -> @location(0) vec4f {
    let p = vec2u(corner.position.xy);
    let own = textureLoad(source, p, 0);
    let found = seen(p, corner, own.rgb);
    return vec4f(nearest_half(found.behind * found.through + found.added), own.a);
}

struct Parts {
    @location(0) radiance: vec4f,
    @location(1) transmittance: vec4f,
}

/// Draw what is added, with a sky that is replaced, and what is let through: the picture in its air is itself times that plus what is added.
@fragment
fn parts(corner: Corner) -> Parts {
    let p = vec2u(corner.position.xy);
    let own = textureLoad(source, p, 0).rgb;
    let found = seen(p, corner, own);
    let is_own = all(own == found.behind);
    let added = select(found.behind * found.through + found.added, found.added, is_own);
    return Parts(vec4f(added, 1.0), vec4f(select(vec3f(0.0), found.through, is_own), 1.0));
}
