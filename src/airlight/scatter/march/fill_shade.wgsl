// The table of what dims a light more than the closed form of the air does, see shade.wgsl: an invocation sums along a column, away from the
// light, from value to value by Gauss's rule of two nodes on each of a few pieces.
//! include "scatter/march/shade.wgsl"
@group(0) @binding(11) var<storage, read_write> filled: array<f32>;
override ALONE: bool = false;   // grids alone dim the light, as if there were no air

/// Place the k-th value of a column: its coordinates across, and its face. Twin: reference/grid.py:column_place.
fn column_place(column: vec3u, k: f32) -> vec3f {
    if (DIRECTIONAL) { return grid_index(light.shade_into, vec3f(vec2f(column.xy), k)); }
    let on_face = (2.0 * vec2f(column.xy) / (vec2f(light.shade_count.xy) - 1.0) - 1.0) * light.shade_tangent;
    let away = normalize(from_table_face(on_face, column.z));
    return grid_index(light.shade_into, away * (light.shade_near + k * light.shade_step));
}

/// Evaluate what dims the light at a place, more than the closed form of the air. detail: m.
fn excess(place: vec3f, detail: f32) -> f32 {
    if (ALONE) { return with_grids(place, 0.0); }
    return density(place, detail) - even_density(place);
}

/// Fill a column of the table.
@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) column: vec3u) {
    let count = light.shade_count;
    if (any(column.xy >= count.xy)) { return; }
    let base = ((column.z * count.y + column.y) * count.x + column.x) * light.shade_stride;
    filled[base] = 0.0;
    let first = column_place(column, 0.0);
    let way = (column_place(column, f32(count.z - 1u)) - first) / f32(count.z - 1u);
    let piece = length(way) / f32(light.shade_pieces);
    var sum = 0.0;
    var k = 1u;
    loop {
        var i = 0u;
        loop {
            let middle = f32(k) - 1.0 + (f32(i) + 0.5) / f32(light.shade_pieces);
            let off = GAUSS_OFF / f32(light.shade_pieces);
            sum += 0.5 * piece * (excess(first + (middle - off) * way, piece) + excess(first + (middle + off) * way, piece));
            i += 1u;
            continuing { break if i >= light.shade_pieces; }
        }
        filled[base + k] = sum;
        k += 1u;
        continuing { break if k >= count.z; }
    }
}
