// The mean of interleaved slices over a cell of m x m pixels, not over edges of depth (Keller and Heidrich 2001): around each pixel every place of
// planes counts once, an even m's outermost pixels by halves.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/likeness.wgsl"

@group(0) @binding(6) var<storage, read> cell: array<u32>; // pixels along one

/// Weigh the neighbours at an offset by how often their place of planes is met around a pixel. Twin: reference/slices.py:cell_weight.
fn cell_weight(offset: vec2i, m: i32) -> f32 {
    let at_end = (m % 2 == 0) && any(abs(offset) == vec2i(m / 2));
    let at_corner = (m % 2 == 0) && all(abs(offset) == vec2i(m / 2));
    return select(select(1.0, 0.5, at_end), 0.25, at_corner);
}

/// Average a pixel's cell. Twin: reference/slices.py:averaged.
@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let m = i32(cell[0]);
    let own = textureLoad(before, id.xy, 0);
    var sum = vec4f(0.0);
    for (var y = -(m / 2); y <= m / 2; y++) {
        for (var x = -(m / 2); x <= m / 2; x++) {
            let at = vec2i(id.xy) + vec2i(x, y);
            // Mirror what lies beyond the border, where a cell is as whole
            let last = vec2i(frame.size) - 1;
            let found = textureLoad(before, clamp(select(at, 2 * last - at, at > last), vec2i(0), last), 0);
            let likeness = exp(-frame.depth_sharpness * relative_difference(found.a, own.a));
            sum += cell_weight(vec2i(x, y), m) * likeness * vec4f(found.rgb, 1.0);
        }
    }
    textureStore(layer, id.xy, vec4f(sum.rgb / sum.a, own.a));
}
