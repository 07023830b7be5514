// Marches the moments of the converged sum along epipolar lines, and stores S at the nodes. See docs/epipolar.md.
// A step takes A_p(a) to A_p(b) = g A_p(a) + k1 I1 + k2 I2 + k3 I3 for each power p, with I3 at the far end of the ray;
// S = sum c A. For D > 1 the far end lies beyond the light and has moments of its own.
// An invocation holds one or four lines, WIDTH apart, as one value of type Rgb (scan_four.wgsl, scan_one.wgsl), so that the
// factors of a step are read once for all of them.
//! include "gpu/half.wgsl"

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
    end: f32,                 // 1 - D: the way of the far end over that of the sample
    column: u32,              // texture column of line 0
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

fn sample(place: vec4f, line: u32, stride: u32) -> vec3f {
    return textureSampleLevel(source, bilinear, place.xy + f32(line * stride) * place.zw, 0.0).rgb;
}

/// Of the table: for each run of steps of equal length the place of its first sample, how it moves from step to step, the
/// place of the far end, and (number of steps, whether the far end counts); then for each step and power (g, k1, k2, k3).
/// A place is that of line 0 and the way from line to line.
fn texel(i: u32) -> vec4f {
    return textureLoad(table, vec2u(i & 255u, i >> 8u), 0);
}

fn load_state(at: u32, lines: u32, k: u32) -> vec3f {
    let i = at + k * lines * 3u;
    return vec3f(state[i], state[i + lines], state[i + 2u * lines]);
}

/// A line between two of the nearer zone starts from their mean.
fn inherited(bundle: Bundle, line: u32, k: u32) -> vec3f {
    let low = min(line / 2u, bundle.lines_in - 1u);
    let high = min((line + 1u) / 2u, bundle.lines_in - 1u);
    return 0.5 * (load_state(bundle.state_in + low, bundle.lines_in, k) + load_state(bundle.state_in + high, bundle.lines_in, k));
}

fn keep(bundle: Bundle, line: u32, k: u32, value: vec3f) {
    if (line < bundle.lines) {
        let i = bundle.state_out + line + k * bundle.lines * 3u;
        state[i] = value.x;
        state[i + bundle.lines] = value.y;
        state[i + 2u * bundle.lines] = value.z;
    }
}

fn store(column: u32, row: u32, gain: vec3f, sum: vec3f) {
    textureStore(sums, vec2u(column, row), vec4f(nearest_half(gain * max(sum, vec3f(0.0))), 1.0));
}

@compute @workgroup_size(WIDTH)
fn scan(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let bundle = bundles[group.x];
    let line = bundle.line + lane;
    let c = array<f32, 3>(bundle.c.x, bundle.c.y, bundle.c.z);
    let d = array<f32, 5>(bundle.beyond_c.x, bundle.beyond_c.y, bundle.beyond_c.z, bundle.beyond_c.w, bundle.gain.w);
    var a: array<Rgb, 3>;     // moments of the pixel's side
    var b: array<Rgb, 5>;     // moments beyond the light
    if (bundle.lines_in > 0u) {
        //! each k of 3: if (k < POWERS) { a[k] = inherit(bundle, line, k); }
        //! each k of 5: if (k < BEYOND) { b[k] = inherit(bundle, line, POWERS + k); }
    }
    var i3: Rgb;
    var sum: Rgb;             // zeroed by hand: the translator does not, within a loop
    var at = bundle.run;
    var node = 0u;
    var left = bundle.steps;
    while (left > 0u) {
        let first = texel(at);
        let way = texel(at + 1u);
        let end = texel(at + 2u);
        let about = texel(at + 3u);
        let steps = min(u32(about.x), left);
        left -= steps;
        at += 4u;
        for (var n = 0u; n < steps; n++) {
            let place = first + f32(n) * way;
            let i1 = light_at(place, line, bundle.stride);
            let i2 = light_at(place + 0.5 * way, line, bundle.stride);
            if (FAR_END) {
                if (about.y > 0.0) { i3 = light_at(end + (f32(n) * bundle.end) * way, line, bundle.stride); }
            }
            sum = Rgb();
            //! each k of 3: if (k < POWERS) { let w = texel(at + k); a[k] = w.x * a[k] + w.y * i1 + w.z * i2; if (FAR_END && BEYOND == 0u) { a[k] += w.w * i3; } sum += c[k] * a[k]; }
            //! each k of 5: if (k < BEYOND) { let w = texel(at + POWERS + k); b[k] = w.x * b[k] + w.w * i3; sum += d[k] * b[k]; }
            at += POWERS + BEYOND;
            // a store beyond the texture is dropped
            store_all(bundle.column + line, select(bundle.row + node, NOWHERE, node < bundle.skip), bundle.gain.rgb, sum);
            node++;
        }
    }
    if (bundle.state_out != NOWHERE) {
        //! each k of 3: if (k < POWERS) { keep_all(bundle, line, k, a[k]); }
        //! each k of 5: if (k < BEYOND) { keep_all(bundle, line, POWERS + k, b[k]); }
    }
}
