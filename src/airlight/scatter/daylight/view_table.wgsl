// Reads the table of view rays: what a ray gathers of daylight up to a distance. Directions are unit vectors of the space in which the record
// holds sun and vertical.
//! include "scatter/daylight/coordinates.wgsl"
//! include "scatter/daylight/phases.wgsl"

struct Daylight {
    to_sun: vec3f,
    anisotropy: f32,            // of the aerosol
    up: vec3f,
    horizon: f32,               // radians, elevation of the ground's edge
    ahead: vec3f,               // level, towards the sun
    height: f32,                // m, of the eye
    irradiance: vec3f,          // above the air, over what the table was scaled by
    near: f32,                  // m: way_coordinate
    step: f32,
    warp: f32,                  // radians: elevation_row
    rows: vec2f,
}

@group(0) @binding(40) var<uniform> daylight: Daylight;
@group(0) @binding(41) var daylight_rayleigh: texture_3d<f32>; // sunlight that Rayleigh's air scatters, without its phase function
@group(0) @binding(42) var daylight_aerosol: texture_3d<f32>;
@group(0) @binding(43) var daylight_together: texture_3d<f32>; // what Rayleigh's air scatters, with its phase function, and light scattered before
@group(0) @binding(44) var daylight_through: texture_2d<f32>;
@group(0) @binding(45) var daylight_linear: sampler;

struct Gathered {
    single: vec3f,              // radiance of sunlight scattered once: what shadows take
    multiple: vec3f,            // radiance of light scattered more than once
    transmittance: vec3f,
}

struct DaylightRay {
    at: vec2f,                  // azimuth and elevation, in the table
    phases: vec2f,              // 1/sr, of Rayleigh's air and the aerosol
    ground: f32,                // m, to the ground; NO_END above the horizon
    end: f32,                   // m, at which the table holds all of the ray
}

/// Place a view ray in the table. direction: unit. Twin: reference/daylight_view.py:daylight_ray.
fn daylight_ray(direction: vec3f) -> DaylightRay {
    let mu = dot(direction, daylight.up);
    let row = elevation_row(arc_sine(mu), daylight.horizon, daylight.warp, daylight.rows);
    let column = azimuth_column(mu, dot(direction, daylight.ahead));
    let way = way_to_ground(daylight.height, mu);
    let ground = select(NO_END, way, way > 0.0);
    return DaylightRay(
        (vec2f(column, row) + 0.5) / vec2f(f32(AZIMUTHS), f32(ELEVATIONS)),
        air_phases(direction, daylight.to_sun, daylight.anisotropy),
        ground,
        select(ground, NO_END, daylight.height > HIGH),
    );
}

/// Read the sunlight that Rayleigh's air scatters once at a place of the table. Sums of parts give the same to the bit wherever they are made.
fn daylight_by_rayleigh(ray: DaylightRay, place: vec3f) -> vec3f {
    return ray.phases.x * textureSampleLevel(daylight_rayleigh, daylight_linear, place, 0.0).rgb;
}

/// Read the sunlight that the aerosol scatters once at a place of the table.
fn daylight_by_aerosol(ray: DaylightRay, place: vec3f) -> vec3f {
    return ray.phases.y * textureSampleLevel(daylight_aerosol, daylight_linear, place, 0.0).rgb;
}

/// Read what Rayleigh's air scatters once, and all light scattered before, at a place of the table.
fn daylight_with_before(place: vec3f) -> vec3f {
    return textureSampleLevel(daylight_together, daylight_linear, place, 0.0).rgb;
}

/// Read C(t), the radiance of sunlight scattered once up to t m: what lies lit from a to b adds C(b) - C(a).
fn daylight_single(ray: DaylightRay, t: f32) -> vec3f {
    let place = vec3f(way_coordinate(t, daylight.near, daylight.step), ray.at);
    return daylight.irradiance * (daylight_by_rayleigh(ray, place) + daylight_by_aerosol(ray, place));
}

/// Read the radiance of all light up to t m.
fn daylight_whole(ray: DaylightRay, t: f32) -> vec3f {
    let place = vec3f(way_coordinate(t, daylight.near, daylight.step), ray.at);
    return daylight.irradiance * (daylight_with_before(place) + daylight_by_aerosol(ray, place));
}

/// Read the radiance of light scattered more than once up to t m.
fn daylight_multiple(ray: DaylightRay, t: f32) -> vec3f {
    let place = vec3f(way_coordinate(t, daylight.near, daylight.step), ray.at);
    return daylight.irradiance * (daylight_with_before(place) - daylight_by_rayleigh(ray, place));
}

/// Read the transmittance of t m.
fn daylight_transmittance(ray: DaylightRay, t: f32) -> vec3f {
    return textureSampleLevel(daylight_through, daylight_linear, vec2f(way_coordinate(t, daylight.near, daylight.step), ray.at.y), 0.0).rgb;
}

/// Read all that a ray of a direction gathers up to t m; NO_END for one that ends at the ground, or not.
fn daylight_at(direction: vec3f, t: f32) -> Gathered {
    let ray = daylight_ray(direction);
    let end = select(t, ray.end, t >= NO_END);
    return Gathered(daylight_single(ray, end), daylight_multiple(ray, end), daylight_transmittance(ray, end));
}
