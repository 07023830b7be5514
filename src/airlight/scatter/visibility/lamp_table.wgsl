// Sums a lamp's table of visibility along the blocks of its rays, as table.wgsl does for suns. U is that of a point light without a range,
// by the angle at the lamp, in which 1 / d^2 is even; the sides of a cone and the light's range are in C.
//! include "scatter/visibility/in_full.wgsl"
//! include "scatter/visibility/counters.wgsl"
//! include "scatter/visibility/sums.wgsl"

struct Part {                   // as in lamp_bits.wgsl
    first: u32,
    count: u32,
}

override RANGED: bool = false;  // the light has a range

struct LampRays {               // four rays, along which the blocks are summed
    cosine: vec4f,              // of the angle at the eye to the lamp
    sine: vec4f,
    sums: Sums,
}

@group(0) @binding(7) var<storage, read> rows: array<LampRow>;
@group(0) @binding(8) var<storage, read> word_ends: array<f32>;
@group(0) @binding(9) var<storage, read> planes: array<vec4u>;
@group(0) @binding(10) var<uniform> part: Part;
@group(0) @binding(11) var<storage, read> ray_ends: array<f32>;
@group(0) @binding(12) var atlas: texture_storage_2d<rgba16float, write>;
@group(0) @binding(13) var<uniform> lamp: Lamp;

struct Weights {                // of places of four rays
    weight: vec4f,
    way: vec4f,                 // m from the lamp to the eye, beyond that between them
}

/// Begin the sums of four rays of a row: `first`, and each fourth after it.
fn begin_rays(i: u32, first: u32, row: LampRow) -> LampRays {
    let numbers = vec4u(first, first + 4u, first + 8u, first + 12u);
    let s = vec4f(numbers) * vec4f(numbers) / ((row.rays - 1.0) * (row.rays - 1.0));
    let across = max(mix(vec4f(row.ends.x), vec4f(row.ends.z), s), vec4f(1e-9));
    let towards = mix(vec4f(row.ends.y), vec4f(row.ends.w), s);
    let inverse = 1.0 / sqrt(across * across + towards * towards);
    let index = numbers * grid.count + i;
    return LampRays(towards * inverse, across * inverse, begin_sums(vec4f(ray_ends[index.x], ray_ends[index.y], ray_ends[index.z], ray_ends[index.w])));
}

/// Evaluate the mean of a spot's falloff over a block, whose middle is at an angle at the lamp. axis: of its row; at: cosine and sine of the
/// middle; eighth: of an eighth of the block. Twin: reference/visibility_lamps.py:mean_of_cone.
fn mean_of_cone(axis: vec2f, at: vec2f, eighth: vec2f) -> f32 {
    // Turn the axis instead of the four places, an eighth and three of them from the middle
    let along = at.y * axis.x - at.x * axis.y;
    let aside = at.x * axis.x + at.y * axis.y;
    let thrice = vec2f(eighth.x * (4.0 * eighth.x * eighth.x - 3.0), eighth.y * (3.0 - 4.0 * eighth.y * eighth.y));
    let cosines = along * vec4f(eighth.x, eighth.x, thrice.x, thrice.x) + aside * vec4f(eighth.y, -eighth.y, thrice.y, -thrice.y);
    let ramps = clamp(cosines * light.cone_scale + light.cone_offset, vec4f(0.0), vec4f(1.0));
    return 0.25 * dot(ramps, ramps);
}

/// Weigh places of four rays by what is scattered there where all is lit. at: cosine and sine of their angle at the lamp, `away` m from the
/// eye. Twin: reference/visibility_lamps.py:weigh.
fn weigh(rays: LampRays, at: vec2f, sigma: f32, away: f32) -> Weights {
    let sine = at.y * rays.cosine + at.x * rays.sine;
    let inverse = 1.0 / max(sine, vec4f(LEAST_SINE));
    let way = max(away * ((at.y + rays.sine) * inverse - 1.0), vec4f(0.0));
    let cosine = at.x * rays.cosine - at.y * rays.sine;
    var scattered = vec4f(0.0);
    //! each k of 4: scattered[k] = phase(cosine[k], light.lobes);
    return Weights(select(vec4f(0.0), scattered * exp(-sigma * way), sine > vec4f(LEAST_SINE)), way);
}

/// Weigh the middle of the block after `part` of a layer. Where colours differ its own place is weighed, as ways from place to place
/// are not even; else what lies between the layer's ends. at: of the block's middle. Twin: reference/visibility_lamps.py:weights_in_layer.
fn weights_in_layer(rays: LampRays, begin: Weights, end: Weights, part: f32, at: vec2f, sigma: f32, away: f32) -> Weights {
    if (COLOURS) { return weigh(rays, at, sigma, away); }
    return Weights(mix(begin.weight, end.weight, part), begin.way);
}

/// Evaluate the window of the light's range in places of four rays, where it has one. at: as of `weigh`.
/// Twin: reference/visibility_lamps.py:windows.
fn windows(rays: LampRays, at: vec2f, away: f32) -> vec4f {
    let sine = at.y * rays.cosine + at.x * rays.sine;
    let d = away * rays.sine / max(sine, vec4f(LEAST_SINE));
    var found = vec4f(0.0);
    //! each k of 4: found[k] = range_window(d[k], light.range);
    return found;
}

/// Sum eight rays of a row, every fourth of a word's, and write them into the atlas. There are few rows: small groups share them better.
@compute @workgroup_size(16)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    let i = part.first + min(id.x, part.count - 1u);
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
    let eighth = unit_at(0.125 * lamp.wide);
    var layer_index = 0u;
    var at = unit_at(lamp.begin);
    var low_end = weigh(low, at, grid.middle, lamp.away);
    var high_end = weigh(high, at, grid.middle, lamp.away);
    loop {
        var v1 = v0; var v2 = v0; var v3 = v0;
        var w1 = w0; var w2 = w0; var w3 = w0;
        let low_begin = low_end;
        let high_begin = high_end;
        if (!COLOURS) {
            at = unit_at(lamp.begin + f32((layer_index + 1u) * step) * lamp.wide);
            low_end = weigh(low, at, grid.middle, lamp.away);
            high_end = weigh(high, at, grid.middle, lamp.away);
        }
        // Add the blocks of a layer, without a loop, which software Vulkan does not unroll
        //! each j of 3: if (!COLOURS || j < 2u) { let part = (f32(j) + 0.5) / f32(step); let block = f32(layer_index * step + j); at = unit_at(lamp.begin + (block + 0.5) * lamp.wide); var n = nibbles(planes[((layer_index * step + j) * grid.words + word) * grid.count + i], q); var cone = 1.0; if (CONE) { cone = mean_of_cone(row.axis, at, eighth); n = select(n, 0u, cone == 0.0); } var strength = vec4f(cone); if (RANGED) { strength *= windows(low, at, lamp.away); } let a = weights_in_layer(low, low_begin, low_end, part, at, grid.middle, lamp.away); low.sums = add_weighed(low.sums, vec4f((vec4u(n) >> vec4u(0u, 4u, 8u, 12u)) & vec4u(15u)) / SAMPLES, a.weight, a.way, strength, block, 1.0); strength = vec4f(cone); if (RANGED) { strength *= windows(high, at, lamp.away); } let b = weights_in_layer(high, high_begin, high_end, part, at, grid.middle, lamp.away); high.sums = add_weighed(high.sums, vec4f((vec4u(n) >> vec4u(16u, 20u, 24u, 28u)) & vec4u(15u)) / SAMPLES, b.weight, b.way, strength, block, 1.0); let from_low = low.sums.stored / low.sums.u; let from_high = high.sums.stored / high.sums.u; if (j == 0u) { v1 = from_low; w1 = from_high; if (COLOURS) { v3 = slopes(low.sums); w3 = slopes(high.sums); } } if (j == 1u) { v2 = from_low; w2 = from_high; } if (j == 2u) { v3 = from_low; w3 = from_high; } }
        if (layer_index == 0u) { v0 = v1; w0 = w1; }
        let to = layer_index * wide_row + first;
        //! each j of 4: textureStore(atlas, vec2u(to + 4u * j, i), vec4f(v0[j], v1[j], v2[j], v3[j]));
        //! each j of 4: textureStore(atlas, vec2u(to + 16u + 4u * j, i), vec4f(w0[j], w1[j], w2[j], w3[j]));
        if (COLOURS) { v0 = v2; w0 = w2; } else { v0 = v3; w0 = w3; }
        layer_index += 1u;
        continuing { break if layer_index >= grid.layers || f32(layer_index * step) > farthest; }
    }
}
