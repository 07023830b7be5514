// The converged sum, GPU Gems 3, Eq. 4 for n -> infinity at lambda = -n ln(decay), unpublished (docs/epipolar.md derives it):
//
//     S(x) = int_0^1 e^(-lambda s) I(x - D s (x - l)) ds = sum_p c_p M_p(r),    M_p(r) = 1/r int_{r(1-D)}^r (q/r)^p I dq
//
// on a line through the light l, r and q the distances of pixel and sample from it: the weight is fitted by powers of q/r (moments.py).
// Each moment has a recurrence from node a to node b of a line, with two samples between them and one at the far end of the ray:
// M_p(b) = g M_p(a) + k1 I1 + k2 I2 + k3 I3. All factors lie in [0, 1]; the host writes them. For D > 1 the far end lies beyond the light
// and has moments of its own. This marches from the light outwards and stores S at the nodes; gather.wgsl interpolates it at pixels.
// An invocation holds one or four lines, WIDTH apart, as one value of type Rgb (scan_four.wgsl, scan_one.wgsl), so that the
// factors of a step are read once for all of them.
//! include "wgsl/half.wgsl"

override POWERS: u32 = 1u;    // on the pixel's side, 1..3
override BEYOND: u32 = 0u;    // beyond the light, 0..5
override FAR_END: bool = false; // whether the far end counts

const NOWHERE = 0xffffffffu;

struct Bundle {               // one workgroup's lines
    line: u32,                // first line, counted in the zone's stride
    lines: u32,               // of the zone
    stride: u32,              // lines of the finest zone between two of this
    run: u32,                 // first texel of the first run of steps
    steps: u32,
    row: u32,                 // texture row of the zone's first node, if it were stored
    skip: u32,                // first nodes that are not stored
    state_in: u32,            // where the nearer zone left its state, and how many lines it had
    lines_in: u32,            // 0: there is none
    state_out: u32,           // NOWHERE: no farther zone goes on from here
    end: f32,                 // 1 - D: the step of the far end over that of the sample
    column: u32,              // texture column of line 0
    sector: u32,              // where `state` tells whether the lines are needed; NOWHERE: they are
    aside: f32,               // lines of the finest zone by which a step's samples lie beside the line, one on each side
    c: vec4f,                 // of the powers
    beyond_c: vec4f,
    gain: vec4f,              // of the light; w: fifth of beyond_c
}

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var bilinear: sampler;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> bundles: array<Bundle>;
@group(0) @binding(4) var sums: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var<storage, read_write> state: array<f32>;

/// Samples the source on a line of the zone. position: of line 0, and from line to line.
fn sample_source(position: vec4f, line: u32, stride: u32) -> vec3f {
    return textureSampleLevel(source, bilinear, position.xy + f32(line * stride) * position.zw, 0.0).rgb;
}

/// Reads the table: for each run of steps of equal length the position of its first sample, how it moves from step to step, the
/// position of the far end, and (number of steps, 1 if the far end counts, steps to one sample of it); then for each step and power (g, k1, k2, k3).
/// A position is that of line 0 and the vector from line to line.
fn table_texel(i: u32) -> vec4f {
    return textureLoad(table, vec2u(i & 255u, i >> 8u), 0);
}

/// Loads a moment that a nearer zone left.
fn load_state(at: u32, lines: u32, k: u32) -> vec3f {
    let i = at + k * lines * 3u;
    return vec3f(state[i], state[i + lines], state[i + 2u * lines]);
}

/// Starts a line from the nearer zone: one between two of its lines from their mean.
fn inherited(bundle: Bundle, line: u32, k: u32) -> vec3f {
    let low = min(line / 2u, bundle.lines_in - 1u);
    let high = min((line + 1u) / 2u, bundle.lines_in - 1u);
    return 0.5 * (load_state(bundle.state_in + low, bundle.lines_in, k) + load_state(bundle.state_in + high, bundle.lines_in, k));
}

/// Leaves a moment to the farther zone.
fn store_state(bundle: Bundle, line: u32, k: u32, value: vec3f) {
    if (line < bundle.lines) {
        let i = bundle.state_out + line + k * bundle.lines * 3u;
        state[i] = value.x;
        state[i + bundle.lines] = value.y;
        state[i + 2u * bundle.lines] = value.z;
    }
}

/// Stores S at a node.
fn store_sum(column: u32, row: u32, gain: vec3f, sum: vec3f) {
    textureStore(sums, vec2u(column, row), vec4f(nearest_half(gain * max(sum, vec3f(0.0))), 1.0));
}

/// Marches the lines of an invocation through one zone.
@compute @workgroup_size(WIDTH)
fn scan(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let bundle = bundles[group.x];
    let line = bundle.line + lane;
    let c = array<f32, 3>(bundle.c.x, bundle.c.y, bundle.c.z);
    let d = array<f32, 5>(bundle.beyond_c.x, bundle.beyond_c.y, bundle.beyond_c.z, bundle.beyond_c.w, bundle.gain.w);
    var a: array<Rgb, 3>;     // moments of the pixel's side
    var b: array<Rgb, 5>;     // moments beyond the light
    if (bundle.lines_in > 0u) {
        //! each k of 3: if (k < POWERS) { a[k] = inherit_lines(bundle, line, k); }
        //! each k of 5: if (k < BEYOND) { b[k] = inherit_lines(bundle, line, POWERS + k); }
    }
    var i3: Rgb;
    var sum: Rgb;             // zeroed by hand: the translator does not, within a loop
    var at = bundle.run;
    var node = 0u;
    // close lines leave no state: it tells of each sector whether it needs them
    let is_needed = bundle.sector == NOWHERE || state[min(bundle.sector, arrayLength(&state) - 1u)] > 0.0;
    var left = select(0u, bundle.steps, is_needed);
    while (left > 0u) {
        // Read the head of a run of steps of equal length
        let first = table_texel(at);
        let step = table_texel(at + 1u);
        let end = table_texel(at + 2u);
        let about = table_texel(at + 3u);
        let steps = min(u32(about.x), left);
        left -= steps;
        at += 4u;
        for (var begin = 0u; begin < steps; begin += u32(about.z)) {
            // Sample the far end of the ray, in the middle of some steps
            if (FAR_END) {
                if (about.y > 0.0) { i3 = sample_lines(end + ((f32(begin) + 0.5 * (about.z - 1.0)) * bundle.end) * step, line, bundle.stride); }
            }
            for (var n = begin; n < min(begin + u32(about.z), steps); n++) {
                // Sample the step's two halves
                let position = first + f32(n) * step;
                let middle = position + 0.5 * step;
                let i1 = sample_lines(position - vec4f(bundle.aside * position.zw, 0.0, 0.0), line, bundle.stride);
                let i2 = sample_lines(middle + vec4f(bundle.aside * middle.zw, 0.0, 0.0), line, bundle.stride);
                // Step every moment, and sum them
                sum = Rgb();
                //! each k of 3: if (k < POWERS) { let w = table_texel(at + k); a[k] = w.x * a[k] + w.y * i1 + w.z * i2; if (FAR_END && BEYOND == 0u) { a[k] += w.w * i3; } sum += c[k] * a[k]; }
                //! each k of 5: if (k < BEYOND) { let w = table_texel(at + POWERS + k); b[k] = w.x * b[k] + w.w * i3; sum += d[k] * b[k]; }
                at += POWERS + BEYOND;
                // a store beyond the texture is dropped
                store_sums(bundle.column + line, select(bundle.row + node, NOWHERE, node < bundle.skip), bundle.gain.rgb, sum);
                node++;
            }
        }
    }
    if (bundle.state_out != NOWHERE) {
        //! each k of 3: if (k < POWERS) { store_states(bundle, line, k, a[k]); }
        //! each k of 5: if (k < BEYOND) { store_states(bundle, line, POWERS + k, b[k]); }
    }
}
