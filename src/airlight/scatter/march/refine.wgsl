// Chooses what is marched by itself after the upsampling of a smaller march. At a lamp, along the edge of a shadow that is seen edge-on, and
// where a thing stands close before what is as bright, radiance changes from pixel to pixel by more than the smaller march can hold. These
// are few: upsampling marks them (upsample_marked.wgsl), and the march is repeated for them in more steps (chosen.wgsl). The most unsure come
// first, and of equal ones all or none, so that the choice does not depend on the order in which they were marked.
//! include "scatter/march/marks.wgsl"
@group(0) @binding(0) var marched: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> marks: Marks;
@group(0) @binding(2) var<storage, read_write> chosen: array<u32>; // see chosen.wgsl
@group(0) @binding(3) var<storage, read_write> arguments: array<u32>; // counts of workgroups for the list's results, 8 x 8 each

const GRID = 128u;              // of texels along each side, whose mean is taken
const SUMS = 256u;
const COLUMNS = 16u;            // of workgroups

var<workgroup> sums: array<f32, 256>;

/// Average radiance over a grid of what was marched, and empty the lists.
@compute @workgroup_size(256)
fn measure(@builtin(local_invocation_index) i: u32) {
    var sum = 0.0;
    for (var k = i; k < GRID * GRID; k += SUMS) {
        let at = (2u * vec2u(k % GRID, k / GRID) + 1u) * textureDimensions(marched) / (2u * GRID);
        sum += dot(textureLoad(marched, at, 0).rgb, vec3f(1.0 / 3.0));
    }
    sums[i] = sum;
    if (i < BINS) { atomicStore(&marks.counts[i], 0u); }
    for (var half = SUMS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if (i < half) { sums[i] += sums[i + half]; }
    }
    if (i == 0u) { marks.mean = sums[0] / f32(GRID * GRID); }
}

/// Gather the fullest choice of lists into one, from the most unsure on, while all of a list find place.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let capacity = arrayLength(&marks.pixels) / BINS;
    var total = 0u;
    var found = 0u; // one more than where this invocation's pixel lies
    var is_full = false;
    for (var k = 0u; k < BINS; k++) {
        let bin = BINS - 1u - k;
        let count = atomicLoad(&marks.counts[bin]);
        is_full = is_full || count > capacity - total;
        if (!is_full) {
            if (id.x >= total && id.x < total + count) { found = 1u + bin * capacity + id.x - total; }
            total += count;
        }
    }
    if (id.x < capacity) { chosen[1u + id.x] = select(0u, marks.pixels[max(found, 1u) - 1u], found > 0u); }
    if (id.x == 0u) {
        chosen[0] = total;
        arguments[0] = COLUMNS;
        arguments[1] = (total + 1023u) / 1024u;
        arguments[2] = 1u;
    }
}
