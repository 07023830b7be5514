// The gather, a pixel an invocation.
//! include "scatter/epipolar/gather.wgsl"

@group(0) @binding(5) var<storage, read> rows: array<vec4f>; // at a pixel of the major axis: row of the sums; line = y n + z
@group(0) @binding(6) var layer: texture_storage_2d<rgba16float, write>;

/// Gathers a pixel of the layer.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy;
    if (any(p >= frame.size)) {
        return;
    }
    let q = vec2f(p) + 0.5;
    let down = (q.x - q.y - frame.diagonal.x) * (q.x + q.y - frame.diagonal.y) < 0.0;
    let positive = select(q.x >= frame.light.x, q.y >= frame.light.y, down);
    let row = rows[frame.first[select(0u, 2u, down) + select(1u, 0u, positive)] + select(p.x, p.y, down)];
    let line = row.y * select(q.y, q.x, down) + row.z;
    textureStore(layer, p, finished(p, sum_at((vec2f(line, row.x) + 0.5) * frame.scale)));
}

/// Sums a pixel near the light.
@compute @workgroup_size(2 * NEAR_LIGHT_RADIUS_PX, 1)
fn near(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = vec2i(floor(frame.light)) - i32(NEAR_LIGHT_RADIUS_PX) + vec2i(i32(lane), i32(group.x));
    if (all(p >= vec2i(0)) && all(p < vec2i(frame.size))) {
        textureStore(layer, p, finished(vec2u(p), direct_sum(vec2u(p))));
    }
}
