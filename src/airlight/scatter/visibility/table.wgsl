// Sums the table of visibility along the blocks of its rays. V(t) is the mean share of a sun's light that reaches a ray up to t, each metre
// weighted as it adds to what is seen in full light:
//
//     V(t) = C(t) / U(t),   U(t) = integral of rho e^(-sigma s),   C(t) = the same, times the lit share,
//
// s the optical length by which the light comes, for the mid-range sigma of the three colours; where they differ, dV / d sigma goes with it.
// V is smooth where C is not, so that pixels between rays interpolate it.
//! include "scatter/visibility/grid.wgsl"
//! include "scatter/visibility/counters.wgsl"
//! include "scatter/visibility/sums.wgsl"
override MAPS: u32 = 1u;

struct Part {                   // as in bits.wgsl
    first: u32,
    count: u32,
    rows: u32,
}

struct Rays {                   // four rays, along which the blocks are summed
    metres: vec4f,              // of a texel
    climb: vec4f,               // m of height of a texel
    near: vec4f,                // texels from where it counts
    seen: vec4f,                // transmittance to where the block begins
    dense: vec4f,               // optical length to there, m
    way: vec4f,                 // and with that from the sun
    sums: Sums,
}

@group(0) @binding(7) var<storage, read> rows: array<Row>;
@group(0) @binding(8) var<storage, read> word_ends: array<f32>;
@group(0) @binding(9) var<storage, read> planes: array<vec4u>;
@group(0) @binding(10) var<uniform> part: Part;
@group(0) @binding(11) var<storage, read> ray_ends: array<f32>;
@group(0) @binding(12) var atlas: texture_storage_2d<rgba16float, write>;

/// Begin the sums of four rays of a row: `first`, and each fourth after it.
fn begin_rays(i: u32, first: u32, row: Row) -> Rays {
    let numbers = vec4u(first, first + 4u, first + 8u, first + 12u);
    let s = vec4f(numbers) / (row.rays - 1.0);
    let x = mix(vec4f(row.begin.x), vec4f(row.end.x), s) * (frame.rays.x / f32(frame.pixels.x)) + frame.rays.z;
    let y = mix(vec4f(row.begin.y), vec4f(row.end.y), s) * (frame.rays.y / f32(frame.pixels.y)) + frame.rays.w;
    let pace = max(mix(vec4f(row.ends.x), vec4f(row.ends.z), s), vec4f(LEAST_PACE));
    let climb = frame.up.x * x + frame.up.y * y - frame.up.z;
    let index = numbers * grid.count + i;
    let surface = vec4f(ray_ends[index.x], ray_ends[index.y], ray_ends[index.z], ray_ends[index.w]);
    let zero = vec4f(0.0);
    let metres = sqrt(x * x + y * y + 1.0) / pace;
    var rays = Rays(metres, climb / pace, zero, vec4f(1.0), zero, zero, begin_sums(surface));
    if (MAPS > 1u) { rays.near = grid.map[row.map].near * pace; }
    if (FADES) { rays.way = vec4f(height_column(frame.base_height, layer_of_fog()) / max(light.climb, 1e-6)); }
    return rays;
}

/// Evaluate (1 - e^-x) / x for four. Twin: reference/visibility.py:mean_of_four.
fn mean_of_four(x: vec4f) -> vec4f {
    let series = 1.0 - x * (0.5 - x * (0.16666667 - x * (0.041666667 - x * 0.0083333333)));
    return select((1.0 - exp(-x)) / max(x, vec4f(1e-20)), series, x < vec4f(0.25));
}

/// Average density by height from the eye to four heights above the fog's base. Twin: reference/visibility.py:mean_densities.
fn mean_densities(y: vec4f) -> vec4f {
    let fog = layer_of_fog();
    var found = vec4f(0.0);
    //! each k of 4: found[k] = mean_height_density(frame.base_height, y[k], fog);
    return found;
}

/// Integrate the fog above four heights, m. Twin: reference/visibility.py:columns.
fn columns(y: vec4f) -> vec4f {
    let fog = layer_of_fog();
    return vec4f(height_column(y.x, fog), height_column(y.y, fog), height_column(y.z, fog), height_column(y.w, fog));
}

/// Add a block, from `begin` on and so wide, texels, in which such shares of four rays are lit. Twin: reference/visibility.py:add_block.
fn add_block(rays: Rays, share: vec4f, begin: f32, wide: f32) -> Rays {
    var out = rays;
    // Weigh the block
    var weight = vec4f(0.0);
    var middle = vec4f(0.0);
    var counts = vec4f(1.0);
    if (MAPS > 1u) { counts = clamp((begin + wide - rays.near) / wide, vec4f(0.0), vec4f(1.0)); }
    if (FOG == EVEN) {
        let long = wide * rays.metres;
        let each = long * mean_of_four(grid.middle * long);
        weight = rays.seen * each * counts;
        out.seen = rays.seen * (1.0 - grid.middle * each);
        middle = (begin + 0.5 * wide) * rays.metres;
    } else {
        let y = frame.base_height + (begin + wide) * rays.climb;
        out.dense = (begin + wide) * rays.metres * mean_densities(y);
        out.way = out.dense;
        if (FADES) { out.way += columns(y) / max(light.climb, 1e-6); }
        let least = min(rays.way, out.way);
        let mean = exp(-grid.middle * least) * mean_of_four(grid.middle * (max(rays.way, out.way) - least));
        weight = (out.dense - rays.dense) * mean * counts;
        middle = 0.5 * (rays.way + out.way);
    }
    out.sums = add_weighed(rays.sums, share, weight, middle, vec4f(1.0), begin, wide);
    return out;
}

/// Sum eight rays of a row, every fourth of a word's, and write them into the atlas.
@compute @workgroup_size(64)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    let i = part.first + id.z * part.rows + min(id.x, part.count - 1u);
    let word = id.y / 4u;
    let q = id.y % 4u;
    let row = rows[i];
    let farthest = word_ends[word * grid.count + i];
    let first = 32u * word + q;
    var low = begin_rays(i, first, row);
    var high = begin_rays(i, first + 16u, row);
    var v0 = vec4f(0.0);
    var w0 = vec4f(0.0);
    let step = select(3u, 2u, COLOURS);
    let wide_row = u32(row.rays);
    var layer_index = 0u;
    loop {
        var v1 = v0; var v2 = v0; var v3 = v0;
        var w1 = w0; var w2 = w0; var w3 = w0;
        // Add the blocks of a layer, without a loop, which software Vulkan does not unroll
        var begin = block_begin(f32(layer_index * step));
        var wide = 0.0;
        var n = 0u;
        var from_low = vec4f(0.0);
        var from_high = vec4f(0.0);
        //! each j of 3: if (!COLOURS || j < 2u) { wide = block_begin(f32(layer_index * step + j) + 1.0) - begin; n = nibbles(planes[((layer_index * step + j) * grid.words + word) * grid.count + i], q); low = add_block(low, vec4f((vec4u(n) >> vec4u(0u, 4u, 8u, 12u)) & vec4u(15u)) / SAMPLES, begin, wide); high = add_block(high, vec4f((vec4u(n) >> vec4u(16u, 20u, 24u, 28u)) & vec4u(15u)) / SAMPLES, begin, wide); begin += wide; from_low = low.sums.stored / low.sums.u; from_high = high.sums.stored / high.sums.u; if (j == 0u) { v1 = from_low; w1 = from_high; if (COLOURS) { v3 = slopes(low.sums); w3 = slopes(high.sums); } } if (j == 1u) { v2 = from_low; w2 = from_high; } if (j == 2u) { v3 = from_low; w3 = from_high; } }
        if (layer_index == 0u) { v0 = v1; w0 = w1; }
        let at = layer_index * wide_row + first;
        //! each j of 4: textureStore(atlas, vec2u(at + 4u * j, i), vec4f(v0[j], v1[j], v2[j], v3[j]));
        //! each j of 4: textureStore(atlas, vec2u(at + 16u + 4u * j, i), vec4f(w0[j], w1[j], w2[j], w3[j]));
        if (COLOURS) { v0 = v2; w0 = w2; } else { v0 = v3; w0 = w3; }
        layer_index += 1u;
        continuing { break if layer_index >= grid.layers || block_begin(f32(layer_index * step)) > ROOM * farthest; }
    }
}
