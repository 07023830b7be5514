// Where a light needs its close lines: the sectors of lines that meet something far brighter than the picture's mean. The layer behind
// it is as sharp as it is; elsewhere wide lines do.
const LANES = 64u;
const BLOCK = 16u;            // pixels on a side
const BRIGHT = 6.0;           // mean of 2 x 2 pixels over the picture's mean, from which they are bright

struct Lines {                // of a quadrant
    u: vec2f,                 // the distance from the light along the major axis: x + y times the place on it, in pixels
    line: vec2f,              // the line times that distance: the place on the minor axis + x + y times the place on the major one
    scale: f32,               // sectors a unit of that
    is_down: u32,             // 1: the major axis is y
    first: u32,               // of its sectors
    sectors: u32,
    near: f32,                // distance, px, as far as wide lines are close enough
}

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var bilinear: sampler;
@group(0) @binding(2) var<storage, read> quadrants: array<Lines, 4>;
@group(0) @binding(3) var<storage, read_write> blocks: array<vec2f>; // of each block: brightest, sum; behind the last the mean
@group(0) @binding(4) var<storage, read_write> lit: array<f32>; // of each sector, 1: something on it is bright

/// Counts the blocks in a row and in a column.
fn block_counts() -> vec2u {
    return (textureDimensions(source) + BLOCK - 1u) / BLOCK;
}

/// Finds the brightest 2 x 2 pixels of a block, and the sum of all.
@compute @workgroup_size(LANES)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    let counts = block_counts();
    let size = vec2f(textureDimensions(source));
    let corner = vec2f(BLOCK * vec2u(id.x % counts.x, id.x / counts.x));
    var most = 0.0;
    var sum = 0.0;
    for (var i = 0u; i < BLOCK * BLOCK / 4u; i++) {
        let at = corner + vec2f(2u * vec2u(i % (BLOCK / 2u), i / (BLOCK / 2u)) + 1u);
        let c = textureSampleLevel(source, bilinear, at / size, 0.0).rgb;
        let value = max(c.r, max(c.g, c.b));
        most = max(most, value);
        sum += value;
    }
    if (id.x < counts.x * counts.y) {
        blocks[id.x] = vec2f(most, sum);
    }
}

var<workgroup> parts: array<f32, LANES>;

/// Finds the picture's mean, and begins with no sector lit.
@compute @workgroup_size(LANES)
fn clear(@builtin(local_invocation_index) lane: u32) {
    let counts = block_counts();
    let number = counts.x * counts.y;
    var sum = 0.0;
    for (var i = lane; i < number; i += LANES) {
        sum += blocks[i].y;
    }
    for (var i = lane; i < arrayLength(&lit); i += LANES) {
        lit[i] = 0.0;
    }
    parts[lane] = sum;
    workgroupBarrier();
    if (lane == 0u) {
        var all = 0.0;
        for (var i = 0u; i < LANES; i++) {
            all += parts[i];
        }
        blocks[number] = vec2f(all / f32(number * BLOCK * BLOCK / 4u), 0.0);
    }
}

/// Lights the sectors that meet a bright block.
@compute @workgroup_size(LANES)
fn mark(@builtin(global_invocation_id) id: vec3u) {
    let counts = block_counts();
    let number = counts.x * counts.y;
    let is_bright = id.x < number && blocks[min(id.x, number)].x > BRIGHT * blocks[number].x;
    let low = vec2f(BLOCK * vec2u(id.x % counts.x, id.x / counts.x)) - 1.0;
    let high = low + f32(BLOCK) + 2.0;
    for (var k = 0u; k < select(0u, 4u, is_bright); k++) {
        let q = quadrants[k];
        let near = select(low, low.yx, q.is_down == 1u); // along the major axis, across it
        let far = select(high, high.yx, q.is_down == 1u);
        let u = q.u.x + q.u.y * vec2f(near.x, far.x);
        if (is_bright && max(u.x, u.y) > q.near) {
            // The line is monotone in both coordinates where u > 0: its ends lie in the corners
            let across = q.line.x + q.line.y * vec2f(near.x, far.x);
            let at = q.scale * vec4f(near.y + across, far.y + across) / max(u.xyxy, vec4f(1.0));
            let ends = vec2f(min(min(at.x, at.y), min(at.z, at.w)), max(max(at.x, at.y), max(at.z, at.w)));
            let begin = u32(clamp(ends.x, 0.0, f32(q.sectors)));
            let end = u32(clamp(ends.y + 1.0, 0.0, f32(q.sectors)));
            for (var i = begin; i < end; i++) {
                lit[q.first + i] = 1.0;
            }
        }
    }
}
