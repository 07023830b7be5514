// Marches the moments of the converged sum along epipolar lines, and stores S at the nodes.
// A_p(b) = g A_p(a) + k1 I1 + k2 I2 for each power p; S = sum c A(r) + sum c' B(|1 - D| r). See docs/epipolar.md.
// An invocation holds LINES lines, WIDTH apart, as one value of type Rgb (scan_four.wgsl, scan_one.wgsl), so that the
// weights of a step are read once for all of them.

override POWERS: u32 = 1u;    // of the pixel's side, 1..3
override TAIL: u32 = 0u;      // of the tail, 0..5; 0: there is none
override FIRST_ZONE: bool = true;

struct Bundle {               // one workgroup's lines
    line: u32,                // first line, counted in the zone's stride
    lines: u32,               // of the zone
    stride: u32,              // lines of the finest zone between two of this
    step: u32,                // first row of the step table
    steps: u32,
    tail: u32,                // first row of the tail's steps
    row: u32,                 // texture row of the zone's first node, wrapped below 0 where the first nodes are not stored
    state_in: u32,            // where the nearer zone left its state, and how many lines it had
    lines_in: u32,
    state_out: u32,
    keep: u32,                // 1: a farther zone goes on from here
    start: vec4f,             // image position of line 0 and its change from line to line
    seed: vec4f,              // 1/(p + 1), or 0 where nothing lies nearer; w: the first node's place between the tail's nodes
    tail_seed: vec4f,
    c: vec4f,                 // of the powers; w: fifth of the tail's
    tail_c: vec4f,
    gain: vec4f,              // of the light; w: fifth tail seed
}

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var bilinear: sampler;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> bundles: array<Bundle>;
@group(0) @binding(4) var sums: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var<storage, read_write> state: array<f32>;

fn texel(place: vec4f, line: u32, stride: u32) -> vec3f {
    return textureSampleLevel(source, bilinear, place.xy + f32(line * stride) * place.zw, 0.0).rgb;
}

/// Row of the step table: 8 texels, 32 rows side by side. Of a step: places of its two samples, then for each power
/// g, k1, k2, and in the first of them the tail's nodes to take, with the place between the last two as fraction.
/// Of a step of the tail: place of its sample, nothing, then g and k.
fn entry(row: u32, k: u32) -> vec4f {
    return textureLoad(table, vec2u((row & 31u) * 8u + k, row >> 5u), 0);
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

fn store(line: u32, row: u32, gain: vec3f, sum: vec3f) {
    textureStore(sums, vec2u(line, row), vec4f(gain * max(sum, vec3f(0.0)), 1.0));
}

fn blend(low: Rgb, high: Rgb, place: f32) -> Rgb {
    return (1.0 - place) * low + place * high;
}

@compute @workgroup_size(WIDTH)
fn scan(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let bundle = bundles[group.x];
    let line = bundle.line + lane;
    let c = array<f32, 3>(bundle.c.x, bundle.c.y, bundle.c.z);
    let tail_c = array<f32, 5>(bundle.tail_c.x, bundle.tail_c.y, bundle.tail_c.z, bundle.tail_c.w, bundle.c.w);
    var a: array<Rgb, 3>;     // moments of the pixel's side
    var b: array<Rgb, 5>;     // moments of the tail
    var behind: Rgb;          // tail's sum at the last two of its nodes
    var ahead: Rgb;
    var sum: Rgb;
    if (FIRST_ZONE) {
        let seed = array<f32, 3>(bundle.seed.x, bundle.seed.y, bundle.seed.z);
        let tail_seed = array<f32, 5>(bundle.tail_seed.x, bundle.tail_seed.y, bundle.tail_seed.z, bundle.tail_seed.w, bundle.gain.w);
        let here = light_at(bundle.start, line, bundle.stride);
        //! each k of 3: if (k < POWERS) { a[k] = here * seed[k]; sum += c[k] * a[k]; }
        //! each k of 5: if (k < TAIL) { b[k] = here * tail_seed[k]; ahead += tail_c[k] * b[k]; }
        behind = ahead;
    } else {
        //! each k of 3: if (k < POWERS) { a[k] = inherit(bundle, line, k); sum += c[k] * a[k]; }
        //! each k of 5: if (k < TAIL) { b[k] = inherit(bundle, line, POWERS + k); }
        if (TAIL > 0u) {
            behind = inherit(bundle, line, POWERS + TAIL);
            ahead = inherit(bundle, line, POWERS + TAIL + 1u);
        }
    }
    if (TAIL > 0u) { sum += blend(behind, ahead, bundle.seed.w); }
    store_all(line, bundle.row, bundle.gain.rgb, sum);
    var tail = bundle.tail;
    for (var n = 0u; n < bundle.steps; n++) {
        let row = bundle.step + n;
        var w = entry(row, 2u);
        if (TAIL > 0u) {
            for (var left = u32(w.w); left > 0u; left--) {
                let i = light_at(entry(tail, 0u), line, bundle.stride);
                behind = ahead;
                ahead = Rgb();
                //! each k of 5: if (k < TAIL) { let v = entry(tail, 2u + k); b[k] = v.x * b[k] + v.y * i; ahead += tail_c[k] * b[k]; }
                tail++;
            }
        }
        let i1 = light_at(entry(row, 0u), line, bundle.stride);
        let i2 = light_at(entry(row, 1u), line, bundle.stride);
        sum = Rgb();
        if (TAIL > 0u) { sum = blend(behind, ahead, fract(w.w)); }
        //! each k of 3: if (k < POWERS) { if (k > 0u) { w = entry(row, 2u + k); } a[k] = w.x * a[k] + w.y * i1 + w.z * i2; sum += c[k] * a[k]; }
        store_all(line, bundle.row + n + 1u, bundle.gain.rgb, sum);
    }
    if (bundle.keep == 1u) {
        //! each k of 3: if (k < POWERS) { keep_all(bundle, line, k, a[k]); }
        //! each k of 5: if (k < TAIL) { keep_all(bundle, line, POWERS + k, b[k]); }
        if (TAIL > 0u) {
            keep_all(bundle, line, POWERS + TAIL, behind);
            keep_all(bundle, line, POWERS + TAIL + 1u, ahead);
        }
    }
}
