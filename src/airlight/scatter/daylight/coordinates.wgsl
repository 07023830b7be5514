// Coordinates of view rays in their table: over the way from the eye, the azimuth from the sun, and the elevation, split at the horizon.
//! include "scatter/daylight/atmosphere.wgsl"
const ELEVATIONS = 104u;
const BELOW = 32u;              // of them, below the horizon
const AZIMUTHS = 32u;
const DISTANCES = 62u;          // the last is the end of the ray
const NO_END = 1e9;             // m: of a ray that meets nothing
const HIGH = 4000.0;            // m, of the eye, beyond which sky below the horizon is read at the last node

/// Evaluate the octave, from 0, that x lies in, and where in it: the logarithm to base 2 at powers of 2, straight between. x: 1 and more.
/// Twin: reference/daylight_view.py:octaves.
fn octaves(x: f32) -> f32 {
    return f32(bitcast<i32>(x) - 0x3f800000) * 0x1p-23;
}

/// Evaluate the number that has so many octaves. Twin: reference/daylight_view.py:of_octaves.
fn of_octaves(y: f32) -> f32 {
    return bitcast<f32>(i32(y * 0x1p23) + 0x3f800000);
}

/// Evaluate where along the table's texture, 0 to 1, a way of t m lies. Nodes stand evenly in the octaves of 1 + t / near, as many in each, so
/// that between two it goes as t does. dense: nodes in an octave. Twin: reference/daylight_view.py:way_coordinate.
fn way_coordinate(t: f32, near: f32, dense: f32) -> f32 {
    return (min(dense * octaves(1.0 + max(t, 0.0) / near), f32(DISTANCES - 1u)) + 0.5) / f32(DISTANCES);
}

/// Evaluate the way, m, at a number of nodes, whole or not, from the eye. Twin: reference/daylight_view.py:way_at.
fn way_at(nodes: f32, near: f32, dense: f32) -> f32 {
    return near * (of_octaves(nodes / dense) - 1.0);
}

/// Evaluate which row of the table, in nodes from 0, a direction has; beyond the table's ends too. Rows stand evenly in the octaves of
/// 1 + tan(e / 2) / warp, e the angle from the horizon, and none lies between the last below and the first above it. mu, level: sine and cosine
/// of the elevation; horizon: those of the horizon's; rows: 1 / warp and rows in an octave, below, then above.
/// Twin: reference/daylight_view.py:elevation_row.
fn elevation_row(mu: f32, level: f32, horizon: vec2f, rows: vec4f) -> f32 {
    let sine = mu * horizon.y - level * horizon.x;
    let tangent = abs(sine) / (1.0 + level * horizon.y + mu * horizon.x);
    let is_above = sine >= 0.0;
    let away = octaves(1.0 + tangent * select(rows.x, rows.z, is_above));
    return select(f32(BELOW - 1u) - rows.y * away, f32(BELOW) + rows.w * away, is_above);
}

/// Evaluate which column of the table, in nodes from 0, a direction has: even in the sine of half its azimuth from the sun's, of which all is a
/// smooth function. level: its cosine to the ground; along: to the level direction towards the sun.
/// Twin: reference/daylight_view.py:azimuth_column.
fn azimuth_column(level: f32, along: f32) -> f32 {
    return f32(AZIMUTHS - 1u) * sqrt(clamp(0.5 - 0.5 * along / max(level, 1e-6), 0.0, 1.0));
}
