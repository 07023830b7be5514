// Density on grids: trilinear between the centres of voxels, that of the nearest ones beyond the outermost, and nothing farther out.

struct Grid {
    rows: array<vec4f, 3>,      // of the matrix from a place to a voxel's index
    count: vec3u,               // voxels along x, y, z
    first: u32,                 // index of the first voxel's density
    factor: f32,                // of the densities
    edge: f32,                  // voxels by which the density reaches beyond the outermost centres
    blend: u32,                 // as BLENDS of field.py
    corner: vec3f,              // of the first voxel's centre in the atlas, from 0 to 1 along it
}

const MAX_GRIDS = 8u;
const PLANE_SLACK = 2e-3;       // voxels: a place so near before a plane of centres is taken to be on it

/// Find the index of a place in a grid. Twin: reference/grid.py:grid_index.
fn grid_index(rows: array<vec4f, 3>, place: vec3f) -> vec3f {
    let at = vec4f(place, 1.0);
    return vec3f(dot(rows[0], at), dot(rows[1], at), dot(rows[2], at));
}

/// Find the step between indices in a grid, of a step between places. Twin: reference/grid.py:grid_step.
fn grid_step(rows: array<vec4f, 3>, step: vec3f) -> vec3f {
    return vec3f(dot(rows[0].xyz, step), dot(rows[1].xyz, step), dot(rows[2].xyz, step));
}

/// Test whether an index lies in a grid's box. Twin: reference/grid.py:in_grid_box.
fn in_grid_box(at: vec3f, count: vec3u, edge: f32) -> bool {
    return all(at >= vec3f(-edge)) && all(at <= vec3f(count) - 1.0 + edge);
}

/// Clip a range of t of the indices b + t a to a grid's box; empty where its end is not behind its start. Twin: reference/grid.py:clip_to_grid.
fn clip_to_grid(b: vec3f, a: vec3f, range: vec2f, count: vec3u, edge: f32) -> vec2f {
    let flat = abs(a) < vec3f(1e-12);
    let slope = select(a, vec3f(1.0), flat);
    let low = (vec3f(-edge) - b) / slope;
    let high = (vec3f(count) - 1.0 + edge - b) / slope;
    let inside = (b >= vec3f(-edge)) & (b <= vec3f(count) - 1.0 + edge);
    let first = select(min(low, high), select(vec3f(3e38), vec3f(-3e38), inside), flat);
    let last = select(max(low, high), select(vec3f(-3e38), vec3f(3e38), inside), flat);
    return vec2f(max(range.x, max(first.x, max(first.y, first.z))), min(range.y, min(last.x, min(last.y, last.z))));
}

/// Find how far along a, from index b, the next plane through voxels' centres is. Twin: reference/grid.py:to_next_plane.
fn to_next_plane(b: vec3f, a: vec3f) -> f32 {
    let up = floor(b + PLANE_SLACK) + 1.0 - b;
    let down = b - ceil(b - PLANE_SLACK) + 1.0;
    let ahead = select(down, up, a > vec3f(0.0)) / max(abs(a), vec3f(1e-12));
    return min(ahead.x, min(ahead.y, ahead.z));
}

/// Join a grid's density with what lies there. Twin: reference/grid.py:blended.
fn blended(before: f32, found: f32, blend: u32) -> f32 {
    let either = select(max(before, found), min(before, found), blend == 3u);
    let joined = select(before + found, before * found, blend == 1u);
    return select(select(joined, found, blend == 2u), either, blend > 2u);
}
