// Coordinates of view rays in their table: over the way from the eye, the azimuth from the sun, and the elevation, split at the horizon.
//! include "scatter/daylight/atmosphere.wgsl"
const ELEVATIONS = 96u;
const BELOW = 32u;              // of them, below the horizon
const AZIMUTHS = 32u;
const DISTANCES = 48u;          // the last is the end of the ray
const NO_END = 1e9;             // m: of a ray that meets nothing
const HIGH = 4000.0;            // m, of the eye, beyond which sky below the horizon is read at the last node

/// Evaluate where along the table's texture, 0 to 1, a way of t m lies. Nodes stand evenly in ln(1 + t / near); between two it goes as t does.
/// step: that logarithm from node to node. Twin: reference/daylight_view.py:way_coordinate.
fn way_coordinate(t: f32, near: f32, step: f32) -> f32 {
    let at = clamp(log(1.0 + max(t, 0.0) / near) / step, 0.0, f32(DISTANCES - 1u));
    let part = fract(at);
    let even = part + 0.5 * step * part * (part - 1.0) * (1.0 + step * (2.0 * part - 1.0) / 6.0); // of the way, not of its logarithm
    return (floor(at) + even + 0.5) / f32(DISTANCES);
}

/// Evaluate the way, m, at a number of nodes, whole or not, from the eye. Twin: reference/daylight_view.py:way_at.
fn way_at(nodes: f32, near: f32, step: f32) -> f32 {
    return near * (exp(nodes * step) - 1.0);
}

/// Evaluate which row of the table, in nodes from 0, an elevation has, in radians as the horizon. Rows stand evenly in ln(1 + e / warp), e the
/// angle from the horizon, and none lies between the last below and the first above it. rows: a unit of that logarithm, below and above.
/// Twin: reference/daylight_view.py:elevation_row.
fn elevation_row(elevation: f32, horizon: f32, warp: f32, rows: vec2f) -> f32 {
    let away = log(1.0 + abs(elevation - horizon) / warp);
    let below = max(f32(BELOW - 1u) - rows.x * away, 0.0);
    return select(below, min(f32(BELOW) + rows.y * away, f32(ELEVATIONS - 1u)), elevation >= horizon);
}

/// Evaluate which column of the table, in nodes from 0, a direction has: even in the sine of half its azimuth from the sun's, of which all is a
/// smooth function. mu: its cosine to the vertical; along: to the level direction towards the sun.
/// Twin: reference/daylight_view.py:azimuth_column.
fn azimuth_column(mu: f32, along: f32) -> f32 {
    let cosine = along * inverseSqrt(max(1.0 - mu * mu, 1e-12));
    return f32(AZIMUTHS - 1u) * sqrt(clamp(0.5 - 0.5 * cosine, 0.0, 1.0));
}
