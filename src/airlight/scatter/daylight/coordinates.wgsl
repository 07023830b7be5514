// Where the table of view rays holds them: over the way from the eye, the azimuth from the sun, and the elevation, split at the horizon.
//! include "scatter/daylight/atmosphere.wgsl"
const ELEVATIONS = 80u;         // half of them below the horizon
const AZIMUTHS = 40u;
const DISTANCES = 48u;

/// Evaluate where along the table's texture, 0 to 1, a way of t m lies. Nodes stand evenly in ln(1 + t / near); between two it goes as t does.
/// step: that logarithm from node to node. Twin: reference/daylight_view.py:way_coordinate.
fn way_coordinate(t: f32, near: f32, step: f32) -> f32 {
    let at = clamp(log(1.0 + max(t, 0.0) / near) / step, 0.0, f32(DISTANCES - 1u));
    let first = floor(at);
    return (first + (exp((at - first) * step) - 1.0) / (exp(step) - 1.0) + 0.5) / f32(DISTANCES);
}

/// Evaluate the way, m, at a number of nodes, whole or not, from the eye. Twin: reference/daylight_view.py:way_at.
fn way_at(nodes: f32, near: f32, step: f32) -> f32 {
    return near * (exp(nodes * step) - 1.0);
}

/// Evaluate which row of the table, in nodes from 0, an elevation has, in radians as the horizon. Rows crowd on both sides of the horizon, and
/// none lies between the last below and the first above it. Twin: reference/daylight_view.py:elevation_row.
fn elevation_row(elevation: f32, horizon: f32) -> f32 {
    let half = f32(ELEVATIONS / 2u);
    let is_above = elevation >= horizon;
    let away = (half - 1.0) * sqrt(min(abs(elevation - horizon) / (0.5 * HALF_TURN + select(horizon, -horizon, is_above)), 1.0));
    return select(half - 1.0 - away, half + away, is_above);
}

/// Evaluate which column of the table, in nodes from 0, a direction has: even in the sine of half its azimuth from the sun's, of which all is a
/// smooth function. mu: its cosine to the vertical; along: to the level direction towards the sun.
/// Twin: reference/daylight_view.py:azimuth_column.
fn azimuth_column(mu: f32, along: f32) -> f32 {
    let cosine = along * inverseSqrt(max(1.0 - mu * mu, 1e-12));
    return f32(AZIMUTHS - 1u) * sqrt(clamp(0.5 - 0.5 * cosine, 0.0, 1.0));
}
