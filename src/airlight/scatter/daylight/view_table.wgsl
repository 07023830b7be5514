// Reads the table of view rays: what a ray gathers of daylight up to a distance. Directions are unit vectors of the space in which the record
// holds sun and vertical.
//! include "scatter/daylight/coordinates.wgsl"
//! include "scatter/daylight/phases.wgsl"

struct Daylight {
    to_sun: vec3f,
    anisotropy: f32,            // of the aerosol
    up: vec3f,
    near: f32,                  // m: way_coordinate
    ahead: vec3f,               // level, towards the sun
    height: f32,                // m, of the eye
    irradiance: vec3f,          // above the air, over what the table was scaled by
    dense: f32,                 // way_coordinate
    broad: vec3f,               // light that is no aerosol's, over the aerosol's: that of green is 1
    rows: vec4f,                // elevation_row
    horizon: vec2f,             // sine and cosine of the elevation of the ground's edge
}

@group(0) @binding(40) var<uniform> daylight: Daylight;
// Radiance over the sum of broad and of alpha times the aerosol's phase function. Alpha is chosen so that the quotient is broad, but for colours
@group(0) @binding(41) var daylight_once: texture_3d<f32>; // of sunlight scattered once
@group(0) @binding(42) var daylight_all: texture_3d<f32>; // of all light
@group(0) @binding(43) var daylight_through: texture_2d<f32>;
@group(0) @binding(44) var daylight_linear: sampler;

struct Gathered {
    single: vec3f,              // radiance of sunlight scattered once: what shadows take
    multiple: vec3f,            // radiance of light scattered more than once
    transmittance: vec3f,
}

struct DaylightRay {
    at: vec2f,                  // azimuth and elevation, in the table
    phase: f32,                 // 1/sr, of the aerosol
    ground: f32,                // m, to the ground; NO_END above the horizon
    end: f32,                   // m, at which the table holds all of the ray
}

/// Place a view ray in the table by the cosines of its angles to the vertical, the level direction towards the sun and the sun, and the squared
/// sine of the last. Twin: reference/daylight_view.py:daylight_place.
fn daylight_place(mu: f32, along: f32, cosine: f32, sine2: f32) -> DaylightRay {
    let level = sqrt(max(1.0 - mu * mu, 0.0));
    let at = vec2f(azimuth_column(level, along), elevation_row(mu, level, daylight.horizon, daylight.rows));
    let way = way_to_ground(daylight.height, mu);
    let ground = select(NO_END, way, way > 0.0);
    let phase = aerosol_phase(cosine, sine2, daylight.anisotropy);
    return DaylightRay((at + 0.5) / vec2f(f32(AZIMUTHS), f32(ELEVATIONS)), phase, ground, select(ground, NO_END, daylight.height > HIGH));
}

/// Place a view ray in the table. direction: unit. Twin: reference/daylight_view.py:daylight_ray.
fn daylight_ray(direction: vec3f) -> DaylightRay {
    let off = cross(direction, daylight.to_sun);
    return daylight_place(dot(direction, daylight.up), dot(direction, daylight.ahead), dot(direction, daylight.to_sun), dot(off, off));
}

/// Evaluate the radiance of what a texture of the table holds of a ray. Twin: reference/daylight_view.py:daylight_of.
fn daylight_of(stored: vec4f, phase: f32, broad: vec3f, irradiance: vec3f) -> vec3f {
    return irradiance * stored.rgb * (broad + stored.a * phase);
}

/// Read C(t), the radiance of sunlight scattered once up to t m: what lies lit from a to b adds C(b) - C(a).
fn daylight_single(ray: DaylightRay, t: f32) -> vec3f {
    let place = vec3f(way_coordinate(t, daylight.near, daylight.dense), ray.at);
    return daylight_of(textureSampleLevel(daylight_once, daylight_linear, place, 0.0), ray.phase, daylight.broad, daylight.irradiance);
}

/// Read the radiance of all light up to t m.
fn daylight_whole(ray: DaylightRay, t: f32) -> vec3f {
    let place = vec3f(way_coordinate(t, daylight.near, daylight.dense), ray.at);
    return daylight_of(textureSampleLevel(daylight_all, daylight_linear, place, 0.0), ray.phase, daylight.broad, daylight.irradiance);
}

/// Read the radiance of light scattered more than once up to t m.
fn daylight_multiple(ray: DaylightRay, t: f32) -> vec3f {
    return daylight_whole(ray, t) - daylight_single(ray, t);
}

/// Read the transmittance of t m.
fn daylight_transmittance(ray: DaylightRay, t: f32) -> vec3f {
    return textureSampleLevel(daylight_through, daylight_linear, vec2f(way_coordinate(t, daylight.near, daylight.dense), ray.at.y), 0.0).rgb;
}

/// Read all that a ray of a direction gathers up to t m; NO_END for one that ends at the ground, or not.
fn daylight_at(direction: vec3f, t: f32) -> Gathered {
    let ray = daylight_ray(direction);
    let end = select(t, ray.end, t >= NO_END);
    return Gathered(daylight_single(ray, end), daylight_multiple(ray, end), daylight_transmittance(ray, end));
}
