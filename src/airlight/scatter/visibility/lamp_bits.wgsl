// Counts, for each ray of a row of a lamp's table of visibility and each block of angles, the samples of the shadow map that light it, as
// bits.wgsl does for suns. In the direction o from the lamp at the angle b there is light up to a distance of D along the axis of the shadow
// view, near / (what the map holds). With the unnormalised ray's r across and w towards the lamp, d m away, its point at that angle is
// lit where
//
//     w sin b + r (cos b - d o_axis / D) >= 0,
//
// which is linear along the row.
//! include "scatter/visibility/lamps.wgsl"
//! include "scatter/visibility/counters.wgsl"
override WORDS: u32 = 4u;       // of 32 rays, of each row that is counted
override STEP: u32 = 3u;        // blocks of a layer of the atlas
override RISES: bool = false;   // see bits.wgsl
override BIASED: bool = false;  // see ranges.wgsl

struct Part {                   // of the rows: those of one edge of the picture, which have as many rays
    first: u32,
    count: u32,
}

@group(0) @binding(7) var<storage, read> rows: array<LampRow>;
@group(0) @binding(8) var<storage, read> word_ends: array<f32>;
@group(0) @binding(9) var<storage, read_write> planes: array<vec4u>; // all rows' first words of the first block first
@group(0) @binding(10) var<uniform> part: Part;
@group(0) @binding(11) var nearest: sampler;
@group(0) @binding(12) var<uniform> lamp: Lamp;

/// Project a vector by a view's matrix: x w, y w, w, in texels. Twin: reference/visibility_lamps.py:projected.
fn projected(matrix: mat4x4f, v: vec3f) -> vec3f {
    return (matrix * vec4f(v, 0.0)).xyw;
}

/// Count a block of a row.
@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3u) {
    let i = part.first + min(id.x, part.count - 1u);
    let row = rows[i];
    // Leave out what no ray of this row reaches, and where there is no light
    var farthest = 0.0;
    //! each k of 4: if (WORDS > k) { farthest = max(farthest, word_ends[k * grid.count + i]); }
    let block = f32(id.y);
    if (f32(id.y - id.y % STEP) > farthest || block + 1.0 <= row.blocks.x || block >= row.blocks.y) { return; }
    // Project onto the view, or the cube's faces at both ends of the block
    var at = unit_at(lamp.begin + (block + 0.5 / SAMPLES) * lamp.wide);
    var layer_a = 0u;
    var layer_b = 0u;
    if (CUBE) {
        let end = unit_at(lamp.begin + (block + 1.0 - 0.5 / SAMPLES) * lamp.wide);
        layer_a = face_towards(from_lamp(at, row.across, lamp.towards));
        layer_b = face_towards(from_lamp(end, row.across, lamp.towards));
    }
    let across_a = projected(light.view[layer_a].matrix, row.across);
    let towards_a = projected(light.view[layer_a].matrix, lamp.towards);
    let across_b = projected(light.view[layer_b].matrix, row.across);
    let towards_b = projected(light.view[layer_b].matrix, lamp.towards);
    let near = vec2f(light.view[layer_a].depth_scale, light.view[layer_b].depth_scale);
    // Look up samples, each at the middle of its part of the block
    let texel = 1.0 / light.side;
    let last = row.rays - 1.0;
    var c0 = vec4u(0u);
    var c1 = vec4u(0u);
    var c2 = vec4u(0u);
    var c3 = vec4u(0u);
    for (var j = 0u; j < 15u; j++) {
        var q = at.y * across_a - at.x * towards_a;
        var map = layer_a;
        var begins = near.x;
        if (CUBE) {
            let other = at.y * across_b - at.x * towards_b;
            let is_other = other.z > q.z;
            q = select(q, other, is_other);
            map = select(layer_a, layer_b, is_other);
            begins = select(near.x, near.y, is_other);
        }
        let place = q.xy * (texel / max(q.z, 1e-6));
        let held = textureSampleLevel(shadow, nearest, place, map, 0);
        var casts = lamp.away * q.z * held / begins;
        if (BIASED) { casts /= 1.0 + held * light.bias / begins; }
        let within = CUBE || (q.z > 0.0 && all(place >= vec2f(0.0)) && all(place < vec2f(1.0)));
        let h = select(-UNHIDDEN, casts, within);
        let x = lit_from(row.ends.y * at.y + row.ends.x * (at.x - h), row.ends.w * at.y + row.ends.z * (at.x - h), last, RISES);
        let m0 = lit_mask(x, 0u, RISES);
        c0 = counted(c0, m0);
        if (WORDS > 1u) { c1 = counted(c1, lit_mask(x, 1u, RISES)); }
        if (WORDS > 2u) { c2 = counted(c2, lit_mask(x, 2u, RISES)); }
        if (WORDS > 3u) { c3 = counted(c3, lit_mask(x, 3u, RISES)); }
        at = vec2f(at.x * lamp.turn.x - at.y * lamp.turn.y, at.y * lamp.turn.x + at.x * lamp.turn.y);
    }
    if (id.x >= part.count) { return; }
    let to = id.y * grid.words * grid.count + i;
    planes[to] = c0;
    if (WORDS > 1u) { planes[to + grid.count] = c1; }
    if (WORDS > 2u) { planes[to + 2u * grid.count] = c2; }
    if (WORDS > 3u) { planes[to + 3u * grid.count] = c3; }
}
