// Marches the moments of the converged sum along epipolar lines, and stores S at the nodes.
// A_p(b) = g A_p(a) + k1 I1 + k2 I2 for each power p; S = sum c A(r) + sum c' B(|1 - D| r). See docs/epipolar.md.
// Each invocation holds LINES lines, WIDTH apart, so that the weights of a step are read once for all of them.

override POWERS: u32 = 1u;    // of the pixel's side, 1..3
override TAIL: u32 = 0u;      // of the tail, 0..5; 0: there is none
override LINES: u32 = 8u;     // lines an invocation, at most MOST
override FIRST_ZONE: bool = true;
const WIDTH = 8u;
const MOST = 8u;

struct Bundle {               // one workgroup's lines
    line: u32,                // first line, counted in the zone's stride
    lines: u32,               // of the zone
    stride: u32,              // lines of the finest zone between two of this
    step: u32,                // first row of the step table
    steps: u32,
    tail: u32,                // first row of the tail's steps
    row: u32,                 // texture row of the zone's first node
    first: u32,               // node index from which nodes are stored
    state_in: u32,            // where the nearer zone left its state, and how many lines it had
    lines_in: u32,
    state_out: u32,
    keep: u32,                // 1: a farther zone goes on from here
    start: vec4f,             // image position of line 0 and its change from line to line
    seed: vec4f,              // 1/(p + 1), or 0 where nothing lies nearer
    tail_seed: vec4f,
    more: vec4f,              // fifth tail seed; sum of c seed; sum of c' seed'; place of node 0 between the tail's nodes
    gain: vec4f,              // of the light
}

struct Line {
    a: array<vec3f, 3>,
    b: array<vec3f, 5>,
    behind: vec3f,            // tail's sum at the last two of its nodes
    ahead: vec3f,
}

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var bilinear: sampler;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> bundles: array<Bundle>;
@group(0) @binding(4) var sums: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var<storage, read_write> state: array<f32>;

fn light_at(place: vec4f, line: f32) -> vec3f {
    return textureSampleLevel(source, bilinear, place.xy + line * place.zw, 0.0).rgb;
}

fn weights(row: u32, power: u32) -> vec4f {
    return textureLoad(table, vec2u(3u + power, row), 0);
}

fn load_state(at: u32, lines: u32, k: u32) -> vec3f {
    let i = at + k * lines * 3u;
    return vec3f(state[i], state[i + lines], state[i + 2u * lines]);
}

fn store_state(at: u32, lines: u32, k: u32, value: vec3f) {
    let i = at + k * lines * 3u;
    state[i] = value.x;
    state[i + lines] = value.y;
    state[i + 2u * lines] = value.z;
}

/// A line between two of the nearer zone starts from their mean.
fn inherited(bundle: Bundle, line: u32, k: u32) -> vec3f {
    let low = min(line / 2u, bundle.lines_in - 1u);
    let high = min((line + 1u) / 2u, bundle.lines_in - 1u);
    return 0.5 * (load_state(bundle.state_in + low, bundle.lines_in, k) + load_state(bundle.state_in + high, bundle.lines_in, k));
}

@compute @workgroup_size(8)
fn scan(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let bundle = bundles[group.x];
    var line: array<Line, MOST>;
    let seed = array<f32, 3>(bundle.seed.x, bundle.seed.y, bundle.seed.z);
    let tail_seed = array<f32, 5>(bundle.tail_seed.x, bundle.tail_seed.y, bundle.tail_seed.z, bundle.tail_seed.w, bundle.more.x);
    for (var j = 0u; j < LINES; j++) {
        let index = bundle.line + lane + j * WIDTH;
        if (FIRST_ZONE) {
            let here = light_at(bundle.start, f32(index * bundle.stride));
            for (var k = 0u; k < POWERS; k++) { line[j].a[k] = here * seed[k]; }
            for (var k = 0u; k < TAIL; k++) { line[j].b[k] = here * tail_seed[k]; }
            line[j].behind = here * bundle.more.z;
            line[j].ahead = line[j].behind;
            if (bundle.first == 0u) {
                textureStore(sums, vec2u(index, bundle.row), vec4f(bundle.gain.rgb * max(here * (bundle.more.y + bundle.more.z), vec3f(0.0)), 1.0));
            }
        } else {
            for (var k = 0u; k < POWERS; k++) { line[j].a[k] = inherited(bundle, index, k); }
            for (var k = 0u; k < TAIL; k++) { line[j].b[k] = inherited(bundle, index, POWERS + k); }
            var sum = vec3f(0.0);
            if (TAIL > 0u) {
                line[j].behind = inherited(bundle, index, POWERS + TAIL);
                line[j].ahead = inherited(bundle, index, POWERS + TAIL + 1u);
                sum = mix(line[j].behind, line[j].ahead, bundle.more.w);
            }
            for (var k = 0u; k < POWERS; k++) { sum += weights(bundle.step, k).w * line[j].a[k]; }
            textureStore(sums, vec2u(index, bundle.row), vec4f(bundle.gain.rgb * max(sum, vec3f(0.0)), 1.0));
        }
    }
    var tail = bundle.tail;
    for (var n = 0u; n < bundle.steps; n++) {
        let row = bundle.step + n;
        let place1 = textureLoad(table, vec2u(0u, row), 0);
        let place2 = textureLoad(table, vec2u(1u, row), 0);
        let extra = textureLoad(table, vec2u(2u, row), 0); // tail steps, place between the tail's nodes, texture row
        if (TAIL > 0u) {
            for (var left = u32(extra.x); left > 0u; left--) {
                let tail1 = textureLoad(table, vec2u(0u, tail), 0);
                let tail2 = textureLoad(table, vec2u(1u, tail), 0);
                for (var j = 0u; j < LINES; j++) {
                    let i = f32((bundle.line + lane + j * WIDTH) * bundle.stride);
                    let i1 = light_at(tail1, i);
                    let i2 = light_at(tail2, i);
                    line[j].behind = line[j].ahead;
                    line[j].ahead = vec3f(0.0);
                    for (var k = 0u; k < TAIL; k++) {
                        let w = weights(tail, k);
                        line[j].b[k] = w.x * line[j].b[k] + w.y * i1 + w.z * i2;
                        line[j].ahead += w.w * line[j].b[k];
                    }
                }
                tail++;
            }
        }
        for (var j = 0u; j < LINES; j++) {
            let index = bundle.line + lane + j * WIDTH;
            let i = f32(index * bundle.stride);
            let i1 = light_at(place1, i);
            let i2 = light_at(place2, i);
            var sum = vec3f(0.0);
            if (TAIL > 0u) {
                sum = mix(line[j].behind, line[j].ahead, extra.y);
            }
            for (var k = 0u; k < POWERS; k++) {
                let w = weights(row, k);
                line[j].a[k] = w.x * line[j].a[k] + w.y * i1 + w.z * i2;
                sum += w.w * line[j].a[k];
            }
            textureStore(sums, vec2u(index, u32(extra.z)), vec4f(bundle.gain.rgb * max(sum, vec3f(0.0)), 1.0));
        }
    }
    if (bundle.keep == 1u) {
        for (var j = 0u; j < LINES; j++) {
            let index = bundle.line + lane + j * WIDTH;
            if (index < bundle.lines) {
                let at = bundle.state_out + index;
                for (var k = 0u; k < POWERS; k++) { store_state(at, bundle.lines, k, line[j].a[k]); }
                for (var k = 0u; k < TAIL; k++) { store_state(at, bundle.lines, POWERS + k, line[j].b[k]); }
                if (TAIL > 0u) {
                    store_state(at, bundle.lines, POWERS + TAIL, line[j].behind);
                    store_state(at, bundle.lines, POWERS + TAIL + 1u, line[j].ahead);
                }
            }
        }
    }
}
