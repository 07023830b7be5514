// Dims a light on its way through a density that varies, and integrates what of it is scattered into a ray there.
//
// A table of each light holds, along columns that run with its rays, what the optical length from the light is more than the closed form of
// the air: of a directional light over a box in its axes, of one with a position over the directions of a face, or of six, and distance.
//! include "scatter/march/field.wgsl"
//! include "scatter/march/shape.wgsl"
override TABLE: bool = false;   // there is one
override TEXTURE: bool = false; // and it is in a texture, too

@group(0) @binding(10) var<storage, read> table: array<f32>;
@group(0) @binding(17) var table_texture: texture_3d<f32>; // along a column, across, and down, face after face

const SHADE_CELLS = 2.0;        // of the table, that a panel may be long in shade
const BORDER_SHARE = 0.25;      // of a ray's way through the border of a spot's cone, that a panel may be long
const WIDEST_PIECE = 0.25;      // of v, t = t0 + h sinh v, that a panel may be long

var<private> cone_range: vec2f; // of t of the ray, in a spot's cone
var<private> shade_line: mat2x3f; // the ray's place in the table, or for its face, at t: its first column + t times the second
var<private> shaded: vec2f;     // range of t of the ray, in which a table may hold something
var<private> passed: f32;       // m, what the optical length from the light to the eye grew by over the part that was last
var<private> kept: f32;         // m, the optical length from the light to where the cursor is

/// Choose the face of a cube that a direction meets: its coordinates there, and the number of the face.
/// Twin: reference/grid.py:table_face.
fn table_face(q: vec3f) -> vec3f {
    let size = abs(q);
    if (size.z >= max(size.x, size.y)) { return vec3f(q.xy / size.z, select(1.0, 0.0, q.z > 0.0)); }
    if (size.x >= size.y) { return vec3f(q.yz / size.x, select(3.0, 2.0, q.x > 0.0)); }
    return vec3f(q.zx / size.y, select(5.0, 4.0, q.y > 0.0));
}

/// Give the direction from coordinates on a face of a cube. Twin: reference/grid.py:from_table_face.
fn from_table_face(at: vec2f, face: u32) -> vec3f {
    let away = select(1.0, -1.0, (face & 1u) == 1u);
    if (face < 2u) { return vec3f(at, away); }
    if (face < 4u) { return vec3f(away, at); }
    return vec3f(at.y, away, at.x);
}

/// Find a place in the light's table, whose rows have led to q: its index, and the face, -1 where the table holds nothing.
/// Twin: reference/grid.py:shade_cell.
fn shade_cell(q: vec3f) -> vec4f {
    let most = vec2f(light.shade_count.xy) - 1.0;
    var at = q;
    var face = 0.0;
    if (!DIRECTIONAL) {
        var seen = vec3f(q.xy / max(q.z, 1e-9), 0.0);
        if (light.shade_faces > 1u) { seen = table_face(q); } else if (q.z <= 0.0) { seen.x = 3e38; }
        at = vec3f(0.5 * most * (seen.xy / light.shade_tangent + 1.0), (length(q) - light.shade_near) / light.shade_step);
        face = seen.z;
    }
    let slack = select(0.0, 1e-3, light.shade_faces > 1u);
    let within = all(at.xy >= vec2f(-slack)) && all(at.xy <= most + slack) && at.z > 0.0;
    return vec4f(at, select(-1.0, face, within));
}

/// Look up what the optical length from the light to t of the ray is more than the air's closed form, m.
fn shade_length(t: f32) -> f32 {
    let cell = shade_cell(shade_line * vec2f(1.0, t));
    if (cell.w < 0.0) { return 0.0; }
    let count = vec3i(light.shade_count);
    let held = clamp(cell.xyz, vec3f(0.0), vec3f(count - 1));
    if (TEXTURE) {
        let size = vec3f(light.shade_count.zxy) * vec3f(1.0, 1.0, f32(light.shade_faces));
        return textureSampleLevel(table_texture, linear, (held.zxy + vec3f(0.5, 0.5, cell.w * f32(count.y) + 0.5)) / size, 0.0).r;
    }
    let low = min(vec3i(floor(held)), count - 2);
    let part = held - vec3f(low);
    let stride = i32(light.shade_stride);
    let base = ((i32(cell.w) * count.y + low.y) * count.x + low.x) * stride + low.z;
    let row = base + stride * count.x;
    let first = vec4f(table[base], table[base + stride], table[row], table[row + stride]);
    let second = vec4f(table[base + 1], table[base + stride + 1], table[row + 1], table[row + stride + 1]);
    let across = mix(first, second, part.z);
    let down = mix(across.xy, across.zw, part.y);
    return mix(down.x, down.y, part.x);
}

/// Integrate density from the light to t of the ray: m.
fn light_length(ray: Ray, t: f32) -> f32 {
    let place = place_at(ray, t);
    var found = 0.0;
    if (DIRECTIONAL) {
        if (FADES) { found = frame.air * height_column(height(place), layer_of_fog()) / max(light.climb, 1e-6); }
    } else {
        found = distance(place, light.position) * mean_even_density(place, light.position);
    }
    if (TABLE) { found += shade_length(t); }
    return max(found, 0.0);
}

/// Find the range of t in which the light's table may hold something of a ray.
fn enter_shade(ray: Ray) {
    shaded = vec2f(0.0, ray.reach);
    if (!TABLE) { return; }
    let b = grid_index(light.shade_rows, ray.origin);
    let a = grid_step(light.shade_rows, ray.direction);
    shade_line = mat2x3f(b, a);
    if (light.shade_faces > 1u) { return; }
    if (DIRECTIONAL) {
        let most = vec2f(light.shade_count.xy) - 1.0;
        shaded = clip_range(clip_range(shaded, b.x, a.x), most.x - b.x, -a.x);
        shaded = clip_range(clip_range(shaded, b.y, a.y), most.y - b.y, -a.y);
        shaded = clip_range(shaded, b.z, a.z);
    } else {
        let wide = light.shade_tangent * vec2f(b.z, a.z);
        shaded = clip_range(clip_range(shaded, wide.x + b.x, wide.y + a.x), wide.x - b.x, wide.y - a.x);
        shaded = clip_range(clip_range(shaded, wide.x + b.y, wide.y + a.y), wide.x - b.y, wide.y - a.y);
    }
}

/// Move the cursor to t, and find how much lies between the light and there.
fn enter_light(ray: Ray, t: f32, each: f32) {
    seek(ray, t, each);
    kept = light_length(ray, cursor.x);
}

/// Integrate density times transmittance from the cursor on to `end`, over what has `along` of optical length, after `before`, lit by a
/// directional light: m. Exact where what is scattered is in proportion to the change of optical depth, as in stratified fog.
fn lit_part(ray: Ray, end: f32, before: f32, along: f32) -> vec3f {
    let first = before + kept;
    kept = light_length(ray, end);
    let last = before + along + kept;
    passed = last - first;
    let near = min(first, last);
    return along * transmittance(near, frame.sigma_t) * mean_transmittance(frame.sigma_t * (max(first, last) - near));
}

/// Evaluate what a light with a position scatters into the ray at t, along a metre of it. along: density there, and the optical length from
/// there to the eye.
fn in_scatter_in_field(ray: Ray, t: f32, along: vec2f) -> vec3f {
    let place = place_at(ray, t);
    let from_light = place - light.position;
    let d = max(length(from_light), 1e-9);
    let strength = scattered_share(d, -dot(from_light, ray.direction) / d, dot(from_light, light.axis) / d);
    let power = frame.sigma_s * light.intensity * shape_colour(t, 0.0);
    return power * (strength * along.x / (d * d)) * exp(-frame.sigma_t * (along.y + light_length(ray, t)));
}

/// Choose the panel from the cursor on, up to `most`, over which the light varies little too. full: see full_cone_range.
fn next_lit_panel(ray: Ray, nearest: vec2f, full: vec2f, most: f32) -> Panel {
    var panel = next_panel(ray, most);
    let t = cursor.x;
    var long = 3e38;
    if (!DIRECTIONAL) {
        let v = asinh((t - nearest.x) / nearest.y) + WIDEST_PIECE;
        long = nearest.x + 0.5 * nearest.y * (exp(v) - exp(-v)) - t;
        // A cone's border, where the light falls from all to nothing, takes a few panels
        if (CONE && t < full.x) { long = min(long, min(full.x - t, max(BORDER_SHARE * (full.x - cone_range.x), 1e-5 * t))); }
        if (CONE && t >= full.x && t < full.y) { long = min(long, full.y - t); }
        if (CONE && t >= full.y) { long = min(long, max(BORDER_SHARE * (cone_range.y - full.y), 1e-5 * t)); }
    }
    if (SHAPE != 0u) { long = min(long, next_texel(t) - t); }
    if (TABLE && !panel.varies && t < shaded.y) {
        let cell = light.shade_cell * select(max(length(vec2f(t - nearest.x, nearest.y)), light.shade_near), 1.0, DIRECTIONAL);
        long = min(long, max(SHADE_CELLS * cell, shaded.x - t));
    }
    panel.end = max(min(panel.end, t + long), min(panel.end, t + 1e-6 * max(t, 1e-3)));
    return panel;
}

/// Integrate over a lit segment of the ray, panel by panel: of a directional light density times transmittance, m; else radiance. Panels
/// between the cursor and the segment only move the cursor.
fn integrate_in_field(ray: Ray, nearest: vec2f, full: vec2f, segment: vec2f) -> vec3f {
    move_back(segment.x);
    if (DIRECTIONAL) { kept = light_length(ray, cursor.x); }
    var sum = vec3f(0.0);
    loop {
        let start = cursor;
        let is_lit = f32(start.x >= segment.x);
        let panel = next_lit_panel(ray, nearest, full, max(select(segment.x, segment.y, start.x >= segment.x), start.x));
        let along = panel_length(ray, panel);
        if (DIRECTIONAL) {
            sum += is_lit * shape_colour(0.5 * (start.x + panel.end), 0.0) * lit_part(ray, panel.end, start.y, along.x);
        } else {
            let long = panel.end - start.x;
            sum += is_lit * 0.5 * long * (at_node(ray, start, along, long, -1.0) + at_node(ray, start, along, long, 1.0));
        }
        move_cursor(ray, panel.end, along.x);
        continuing { break if cursor.x >= segment.y; }
    }
    return sum;
}

/// Evaluate what is scattered at a node of a panel that begins at `start`: side -1 the first, 1 the second. along: see panel_length.
fn at_node(ray: Ray, start: vec2f, along: vec4f, long: f32, side: f32) -> vec3f {
    let share = 0.5 + side * GAUSS_OFF;
    let t = start.x + share * long;
    let place = place_at(ray, t);
    if (along.w == 0.0) {
        let before = share * long * mean_even_density(place_at(ray, start.x), place);
        return in_scatter_in_field(ray, t, vec2f(even_density(place), start.y + before));
    }
    // Between the nodes density is taken to be linear: its mean, and its slope over the panel
    let slope = (along.z - along.y) / (2.0 * GAUSS_OFF);
    let before = long * share * (0.5 * (along.y + along.z) + 0.5 * slope * (share - 1.0));
    return in_scatter_in_field(ray, t, vec2f(select(along.z, along.y, side < 0.0), start.y + max(before, 0.0)));
}
