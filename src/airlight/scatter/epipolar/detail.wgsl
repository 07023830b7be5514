// Finds where a light needs its close lines: in the sectors of lines in which the sums of wide lines bend from line to line. What bends
// there is not straight between two wide lines, which is what the gather takes it for. Where the space between two lines is wider than
// samples reach, a step's samples lie on both sides of the line (Grid.aside), so that what is narrower bends their sums too.
const LANES = 64u;
const EVERY = 4u;             // of the rows: along a line the sums hardly change from one to the next
override MOST: f32 = 0.04;    // root mean square of the bend over the mean of all sums, up to which wide lines do

struct Window {               // sums of a sector's part that are judged together
    row: u32,                 // of the sums' texture, the first
    rows: u32,
    column: u32,              // the first that has a neighbour on each side
    columns: u32,             // 0: too few to tell
    sector: u32,
    area: f32,                // of the picture, in px^2
}

@group(0) @binding(0) var sums: texture_2d<f32>; // of the wide lines
@group(0) @binding(1) var<storage, read> windows: array<Window>;
@group(0) @binding(2) var<uniform> count: u32;   // of windows: the buffer may be longer
@group(0) @binding(3) var<storage, read_write> found: array<vec2f>; // of each window the mean square of the bend, and the mean
@group(0) @binding(4) var<storage, read_write> lit: array<f32>; // of each sector, 1: it needs close lines

/// Finds how far a sum is from the line through its neighbours' (x), and the sum (y): of the channel where each is largest.
/// Twin: reference/epipolar.py:bend.
fn bend(before: vec3f, here: vec3f, after: vec3f) -> vec2f {
    let off = abs(before - 2.0 * here + after);
    return vec2f(max(off.r, max(off.g, off.b)), max(here.r, max(here.g, here.b)));
}

/// Measures a window.
@compute @workgroup_size(LANES)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    let window = windows[min(id.x, count - 1u)];
    var sum = vec2f(0.0);
    for (var row = window.row; row < window.row + window.rows; row += EVERY) {
        var before = textureLoad(sums, vec2u(window.column - 1u, row), 0).rgb;
        var here = textureLoad(sums, vec2u(window.column, row), 0).rgb;
        for (var i = 1u; i <= window.columns; i++) {
            let after = textureLoad(sums, vec2u(window.column + i, row), 0).rgb;
            let one = bend(before, here, after);
            sum += vec2f(one.x * one.x, one.y);
            before = here;
            here = after;
        }
    }
    if (id.x < count) {
        found[id.x] = sum / f32(max(window.columns * ((window.rows + EVERY - 1u) / EVERY), 1u));
    }
}

var<workgroup> parts: array<vec2f, LANES>;

/// Marks the sectors of the windows in which wide lines do not do.
@compute @workgroup_size(LANES)
fn mark(@builtin(local_invocation_index) lane: u32) {
    var part = vec2f(0.0);
    for (var i = lane; i < arrayLength(&lit); i += LANES) {
        lit[i] = 0.0;
    }
    for (var i = lane; i < count; i += LANES) {
        part += windows[i].area * vec2f(found[i].y, 1.0);
    }
    parts[lane] = part;
    storageBarrier();
    workgroupBarrier();
    var all = vec2f(0.0);
    for (var i = 0u; i < LANES; i++) {
        all += parts[i];
    }
    let most = MOST * all.x / max(all.y, 1.0);
    for (var i = lane; i < count; i += LANES) {
        if (windows[i].columns == 0u || found[i].x > most * most) {
            lit[windows[i].sector] = 1.0;
        }
    }
}
