// Where the table of view rays holds them: over the way from the eye, the azimuth from the sun, and the elevation, split at the horizon.
//! include "scatter/daylight/atmosphere.wgsl"
const ELEVATIONS = 64u;         // half of them below the horizon
const AZIMUTHS = 32u;
const DISTANCES = 48u;

/// Evaluate where along the table's texture, 0 to 1, a way of t m lies. Nodes stand evenly in ln(1 + t / near); between two it goes as t does.
/// span: ln(1 + most / near). Twin: reference/daylight_view.py:way_coordinate.
fn way_coordinate(t: f32, near: f32, span: f32) -> f32 {
    let step = span / f32(DISTANCES - 1u);
    let at = clamp(log(1.0 + max(t, 0.0) / near) / step, 0.0, f32(DISTANCES - 1u));
    let first = floor(at);
    return (first + (exp((at - first) * step) - 1.0) / (exp(step) - 1.0) + 0.5) / f32(DISTANCES);
}

/// Evaluate the way, m, that is a part x, 0 to 1, of the table's nodes away from the eye. Twin: reference/daylight_view.py:way_at.
fn way_at(x: f32, near: f32, span: f32) -> f32 {
    return near * (exp(x * span) - 1.0);
}

/// Evaluate which row of the table, in nodes from 0, an elevation has, in radians as the horizon. Rows crowd on both sides of the horizon, and
/// none lies between the last below and the first above it. Twin: reference/daylight_view.py:elevation_row.
fn elevation_row(elevation: f32, horizon: f32) -> f32 {
    let half = f32(ELEVATIONS / 2u);
    let above = sqrt(clamp((elevation - horizon) / (0.5 * HALF_TURN - horizon), 0.0, 1.0));
    let below = sqrt(clamp((horizon - elevation) / (0.5 * HALF_TURN + horizon), 0.0, 1.0));
    return select((half - 1.0) * (1.0 - below), half + (half - 1.0) * above, elevation >= horizon);
}

/// Evaluate the azimuth, radians from 0 to half a turn, of a direction from the sun's. up: the vertical; ahead: level, towards the sun.
/// Twin: reference/daylight_view.py:azimuth_from.
fn azimuth_from(direction: vec3f, up: vec3f, ahead: vec3f) -> f32 {
    let x = dot(direction, ahead);
    let y = abs(dot(direction, cross(up, ahead)));
    return atan2(max(y, 1e-12), x);
}
