// Where a pixel lies in the grid of a table of visibility.

struct PlaceInGrid {
    row: f32,
    ray: f32,                   // 0 to the row's last
    rays: f32,                  // of the row
}

/// Find where a pixel lies in the grid. p: pixels; size: of the picture; the others as of Grid.
/// Twin: reference/visibility.py:place_in_grid.
fn place_in_grid(p: vec2f, size: vec2f, slope: f32, offset: vec2f, rate: vec2f, first: vec4f, rays: vec4f) -> PlaceInGrid {
    let away = slope * p - offset;
    let inverse = 1.0 / max(abs(away), vec2f(1e-12));
    let forward = away > vec2f(0.0);
    let out = select(p, size - p, forward) * inverse;
    let back = (select(size - p, p, forward) + 2.0) * inverse;
    let t_out = min(out.x, out.y);
    let t_in = min(min(back.x, back.y), 0.999999 / max(slope, 1e-30));
    let sideways = out.x < out.y;
    let along = select(p.x + t_out * away.x, p.y + t_out * away.y, sideways) * select(rate.y, rate.x, sideways);
    let begins = select(select(first.z, first.w, forward.y), select(first.x, first.y, forward.x), sideways);
    let count = select(select(rays.z, rays.w, forward.y), select(rays.x, rays.y, forward.x), sideways);
    let share = t_in / (t_in + t_out);
    return PlaceInGrid(begins + along, select(share, sqrt(share), DENSER) * (count - 1.0), count);
}

/// Interpolate between four values in a row. part: 0 to 3. Twin: reference/visibility.py:between_planes.
fn between_planes(values: vec4f, part: f32) -> f32 {
    let steps = clamp(vec3f(part) - vec3f(0.0, 1.0, 2.0), vec3f(0.0), vec3f(1.0));
    return values.x + dot(values.yzw - values.xyz, steps);
}
