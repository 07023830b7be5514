// Mean and variance of a shadow map's depths around each texel (Donnelly and Lauritzen 2006, Variance shadow maps), over a square of texels.
// Variances are summed as such, not as differences of squares, whose digits would be lost.
@group(0) @binding(0) var shadow: texture_depth_2d_array;
@group(0) @binding(1) var moments: texture_storage_2d_array<rg32float, write>; // mean, variance
@group(0) @binding(2) var<uniform> first: vec4u;   // x: the row of tiles at which the pass begins
override RADIUS: u32 = 3u;      // texels to each side, at most MAX_RADIUS

const TILE = 16u;               // texels along what a workgroup writes
const MAX_RADIUS = 8u;
const HELD = 32u;               // TILE + 2 MAX_RADIUS

var<workgroup> held: array<f32, HELD * HELD>;
var<workgroup> rows: array<vec2f, HELD * TILE>; // moments of RADIUS texels to each side in a row

/// Average the moments of a tile's texels.
@compute @workgroup_size(16, 16)
fn average(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u, @builtin(local_invocation_index) lane: u32) {
    let last = vec2i(textureDimensions(shadow)) - 1;
    let corner = TILE * (group.xy + vec2u(0u, first.x));
    let count = 2u * RADIUS + 1u;
    // Read the tile and what lies around it
    var k = lane;
    loop {
        let texel = vec2i(corner + vec2u(k % HELD, k / HELD)) - i32(MAX_RADIUS);
        held[k] = textureLoad(shadow, clamp(texel, vec2i(0), last), group.z, 0);
        k += TILE * TILE;
        continuing { break if k >= HELD * HELD; }
    }
    workgroupBarrier();
    // Average along rows
    k = lane;
    loop {
        let begin = (k / TILE) * HELD + k % TILE + MAX_RADIUS - RADIUS;
        var mean = 0.0;
        for (var i = 0u; i < count; i++) { mean += held[begin + i]; }
        mean /= f32(count);
        var variance = 0.0;
        for (var i = 0u; i < count; i++) { variance += (held[begin + i] - mean) * (held[begin + i] - mean); }
        rows[k] = vec2f(mean, variance / f32(count));
        k += TILE * TILE;
        continuing { break if k >= HELD * TILE; }
    }
    workgroupBarrier();
    // Average the rows: the variance of all is the mean of theirs, and that of their means
    let begin = (local.y + MAX_RADIUS - RADIUS) * TILE + local.x;
    var sum = vec2f(0.0);
    for (var i = 0u; i < count; i++) { sum += rows[begin + i * TILE]; }
    sum /= f32(count);
    var between = 0.0;
    for (var i = 0u; i < count; i++) { between += (rows[begin + i * TILE].x - sum.x) * (rows[begin + i * TILE].x - sum.x); }
    let texel = corner + local.xy;
    if (all(vec2i(texel) <= last)) { textureStore(moments, texel, group.z, vec4f(sum.x, sum.y + between / f32(count), 0.0, 0.0)); }
}
