// From what emits to the bands of a light's rays: a sum along each line, then means over lines, the wide ones in groups of lines.
// Twin: reference/look.py:scan. Twin: reference/look.py:smooth. Twin: reference/look.py:low. Twin: reference/look.py:bands.
//! include "look/rays.wgsl"
//! include "wgsl/unit_at.wgsl"
const GROUPS = LINES / COARSE;
const FIRST_LENGTH = 0.01; // diagonals of weighted path before the picture, on which emission is as at its border
const FINE = 1.0;

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var matte: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var<storage, read> pattern: array<f32>; // of drawn rays, by line
@group(0) @binding(4) var<storage, read_write> raw: array<vec2f>; // C, w
@group(0) @binding(5) var<storage, read_write> smoothed: array<vec2f>; // C', w
@group(0) @binding(6) var<storage, read_write> grouped: array<vec2f>; // sums of C' w, w
@group(0) @binding(7) var<storage, read_write> means: array<vec2f>; // narrow, wide
@group(0) @binding(8) var bands: texture_storage_2d<rgba16float, write>;

/// Finds the unit direction of a line. Twin: reference/rays.py:direction_of.
fn direction_of(line: u32) -> vec2f {
    return unit_at(rays.start + (f32(line) + 0.5) * (rays.span / f32(LINES)));
}

/// Tells whether a point lies in the picture. Twin: reference/rays.py:is_within.
fn is_within(p: vec2f) -> bool {
    return all(p >= vec2f(0.0)) && all(p <= rays.box);
}

/// Sums what emits along a line: C, and how dark each kept point is, by which it counts in means.
@compute @workgroup_size(32)
fn scan(@builtin(global_invocation_id) id: vec3u) {
    let toward = direction_of(id.x);
    let begins = entry_distance(toward, rays);
    let step = rays.step / f32(STEPS);
    var sum = FIRST_LENGTH * textureSampleLevel(matte, bilinear, (rays.light + toward * begins) / rays.box, 0.0).r;
    for (var i = 0u; i < RADII; i++) {
        // Add the emission of the picture up to the next kept distance
        for (var k = 0u; k < STEPS; k++) {
            let p = rays.light + toward * (rays.nearest + (f32(i * STEPS + k) + 0.5) * step);
            if (is_within(p)) { sum += step * textureSampleLevel(matte, bilinear, p / rays.box, 0.0).r; }
        }
        let distance = rays.nearest + f32(i + 1u) * rays.step;
        // Divide by the weights of the whole path
        let path_length = HALF_WEIGHT_DIAGONALS * atan(max(distance - begins, 0.0) / HALF_WEIGHT_DIAGONALS);
        let emits = textureSampleLevel(matte, bilinear, (rays.light + toward * distance) / rays.box, 0.0).g;
        raw[i * LINES + id.x] = vec2f(sum / (path_length + FIRST_LENGTH), 1.02 - emits);
    }
}

// Gaussian weights one after the other, from the middle outwards: each is the one before times a factor that itself shrinks evenly.
struct Falloff {
    weight: f32,
    factor: f32,
    shrinks: f32,
}

/// Makes the first of the weights of a Gaussian, and the factors that lead from each to the next. Twin: reference/rays.py:falloff.
fn falloff(sigma: f32) -> Falloff {
    let q = exp(-0.5 / max(sigma * sigma, 1e-6));
    return Falloff(1.0, q, q * q);
}

/// Weighs a neighbour: all round 1, else nothing beyond the first and the last. Twin: reference/rays.py:neighbour_weight.
fn neighbour_weight(at: i32, count: u32) -> f32 {
    return select(0.0, 1.0, INSIDE || (at >= 0 && at < i32(count)));
}

/// Averages C over neighbouring lines, never so few that a ray is a scratch.
@compute @workgroup_size(64)
fn smooth_lines(@builtin(global_invocation_id) id: vec3u) {
    let row = id.y * LINES;
    let own = raw[row + id.x];
    let line = i32(id.x);
    var sum = vec2f(own.x, 1.0);
    let distance = rays.nearest + f32(id.y + 1u) * rays.step;
    let sigma = max(rays.fine, min(rays.thinnest / distance, rays.broadest));
    var f = falloff(sigma);
    for (var i = 1; i <= i32(ceil(3.0 * sigma)); i++) {
        f = Falloff(f.weight * f.factor, f.factor * f.shrinks, f.shrinks);
        let before = f.weight * neighbour_weight(line - i, LINES);
        let after = f.weight * neighbour_weight(line + i, LINES);
        sum += before * vec2f(raw[row + (u32(line - i) & (LINES - 1u))].x, 1.0);
        sum += after * vec2f(raw[row + (u32(line + i) & (LINES - 1u))].x, 1.0);
    }
    smoothed[row + id.x] = vec2f(sum.x / sum.y, own.y);
}

/// Sums COARSE lines for the wide means, weighted by how dark their points are.
@compute @workgroup_size(64)
fn group_lines(@builtin(global_invocation_id) id: vec3u) {
    var sum = vec2f(0.0);
    for (var i = 0u; i < COARSE; i++) {
        let one = smoothed[id.y * LINES + id.x * COARSE + i];
        sum += vec2f(one.x * one.y, one.y);
    }
    grouped[id.y * GROUPS + id.x] = sum;
}

/// Averages groups of lines about one, by a Gaussian.
fn mean_over_groups(group: i32, row: u32, sigma: f32) -> f32 {
    var sum = grouped[row + u32(group)];
    var f = falloff(sigma);
    for (var i = 1; i <= i32(ceil(3.0 * sigma)); i++) {
        f = Falloff(f.weight * f.factor, f.factor * f.shrinks, f.shrinks);
        sum += f.weight * neighbour_weight(group - i, GROUPS) * grouped[row + (u32(group - i) & (GROUPS - 1u))];
        sum += f.weight * neighbour_weight(group + i, GROUPS) * grouped[row + (u32(group + i) & (GROUPS - 1u))];
    }
    return sum.x / max(sum.y, 1e-9);
}

/// Finds the narrow and the wide mean of a group.
@compute @workgroup_size(64)
fn mean_lines(@builtin(global_invocation_id) id: vec3u) {
    let row = id.y * GROUPS;
    means[row + id.x] = vec2f(mean_over_groups(i32(id.x), row, rays.narrow), mean_over_groups(i32(id.x), row, rays.wide));
}

/// Interpolates values of groups at a line.
fn between_groups(line: u32, row: u32) -> vec2f {
    let at = (f32(line) + 0.5) / f32(COARSE) - 0.5;
    let first = i32(floor(at));
    var low = u32(first) & (GROUPS - 1u);
    var high = u32(first + 1) & (GROUPS - 1u);
    if (!INSIDE) {
        low = u32(max(first, 0));
        high = u32(min(first + 1, i32(GROUPS) - 1));
    }
    return mix(means[row * GROUPS + low], means[row * GROUPS + high], at - f32(first));
}

/// Takes the means from C, and writes the bands with a line more on either side.
@compute @workgroup_size(64)
fn stand_out(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= LINES + 2u) { return; }
    var line = (id.x + LINES - 1u) & (LINES - 1u);
    if (!INSIDE) { line = min(max(id.x, 1u) - 1u, LINES - 1u); }
    let share = smoothed[id.y * LINES + line].x;
    let mean = between_groups(line, id.y);
    let fine = share - mean.x;
    var all_of_it = FINE * fine + mean.x - mean.y;
    if (rays.own > 0.0) { all_of_it = rays.own * fine + rays.drawn * pattern[line] * mean.y; }
    textureStore(bands, id.xy, vec4f(fine, all_of_it, mean.y, 1.0));
}
