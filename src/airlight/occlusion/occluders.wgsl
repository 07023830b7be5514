// The mean colour of what does not emit, weighted by 1 - m: sums of columns by blocks of rows, then the sum of these. The order is
// fixed, so that the same picture gives the same mean.
//! include "occlusion/mask.wgsl"
const ROWS = 64u;             // of a block
const LANES = 256u;

@group(0) @binding(3) var<storage, read_write> sums: array<vec4f>; // RGB (1 - m), 1 - m
@group(0) @binding(4) var<storage, read_write> mean: vec4f;

/// Sums a column of a block of rows.
@compute @workgroup_size(64)
fn blocks(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(picture);
    if (id.x >= size.x) {
        return;
    }
    var sum = vec4f(0.0);
    for (var y = id.y * ROWS; y < min((id.y + 1u) * ROWS, size.y); y++) {
        let pixel = emitter_at(vec2i(vec2u(id.x, y)));
        sum += (1.0 - pixel.a) * vec4f(pixel.rgb, 1.0);
    }
    sums[id.y * size.x + id.x] = sum;
}

var<workgroup> parts: array<vec4f, LANES>;

/// Sums all blocks, and divides by the weights.
@compute @workgroup_size(LANES)
fn whole(@builtin(local_invocation_index) lane: u32) {
    var sum = vec4f(0.0);
    for (var i = lane; i < arrayLength(&sums); i += LANES) {
        sum += sums[i];
    }
    parts[lane] = sum;
    workgroupBarrier();
    if (lane == 0u) {
        var all = vec4f(0.0);
        for (var i = 0u; i < LANES; i++) {
            all += parts[i];
        }
        mean = vec4f(all.rgb / max(all.a, 1e-6), 1.0);
    }
}
