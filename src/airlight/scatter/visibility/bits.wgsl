// Counts, for each ray of a row of a table of visibility and each block of distance, the samples of the shadow map that light it. Along a
// row the rays are ordered by the slope at which they rise towards the sun, so that a texel of the map lights all rays on one side of a place
// among them: a sample is a mask of bits, one a ray. Masks are added in bit planes: bit i of the planes x, y, z, w together is the count of
// ray i.
//! include "scatter/visibility/grid.wgsl"
//! include "scatter/visibility/counters.wgsl"
override WORDS: u32 = 4u;       // of 32 rays, of each row that is counted
override STEP: u32 = 3u;        // blocks of a layer of the atlas
override RISES: bool = false;   // the slope rises along rows: rays from a place on are lit, and not those before it

struct Part {                   // of the rows: those of one edge of the picture, which have as many rays
    first: u32,
    count: u32,
    rows: u32,                  // of a map
}

@group(0) @binding(7) var<storage, read> rows: array<Row>;
@group(0) @binding(8) var<storage, read> word_ends: array<f32>;
@group(0) @binding(9) var<storage, read_write> planes: array<vec4u>; // all rows' first words of the first block first
@group(0) @binding(10) var<uniform> part: Part;
@group(0) @binding(11) var nearest: sampler;

/// Count a block of a row.
@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3u) {
    let i = part.first + id.z * part.rows + min(id.x, part.count - 1u);
    let row = rows[i];
    let map = grid.map[id.z];
    // Leave out what no ray of this row reaches
    var farthest = 0.0;
    //! each k of 4: if (WORDS > k) { farthest = max(farthest, word_ends[k * grid.count + i]); }
    if (block_begin(f32(id.y - id.y % STEP)) > ROOM * farthest) { return; }
    let begin = block_begin(f32(id.y));
    // Look up samples, each at the middle of its part of the block
    let wide = block_begin(f32(id.y) + 1.0) - begin;
    let texel = 1.0 / light.side;
    let last = row.rays - 1.0;
    var c0 = vec4u(0u);
    var c1 = vec4u(0u);
    var c2 = vec4u(0u);
    var c3 = vec4u(0u);
    for (var j = 0u; j < 15u; j++) {
        let r = begin + (f32(j) + 0.5) * wide / SAMPLES;
        let at = (map.eye.xy + row.along * r) * texel;
        let held = textureSampleLevel(shadow, nearest, at, id.z, 0);
        let casts = held > 0.0 && all(at >= vec2f(0.0)) && all(at < vec2f(1.0));
        let h = select(UNHIDDEN, held - map.bias - map.eye.z, casts);
        let x = lit_from(row.ends.y * r - h * row.ends.x, row.ends.w * r - h * row.ends.z, last, RISES);
        let m0 = lit_mask(x, 0u, RISES);
        c0 = counted(c0, m0);
        if (WORDS > 1u) { c1 = counted(c1, lit_mask(x, 1u, RISES)); }
        if (WORDS > 2u) { c2 = counted(c2, lit_mask(x, 2u, RISES)); }
        if (WORDS > 3u) { c3 = counted(c3, lit_mask(x, 3u, RISES)); }
    }
    if (id.x >= part.count) { return; }
    let to = id.y * grid.words * grid.count + i;
    planes[to] = c0;
    if (WORDS > 1u) { planes[to + grid.count] = c1; }
    if (WORDS > 2u) { planes[to + 2u * grid.count] = c2; }
    if (WORDS > 3u) { planes[to + 3u * grid.count] = c3; }
}
