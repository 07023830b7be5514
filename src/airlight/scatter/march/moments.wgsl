// Mean and variance of a shadow map's depths around each texel (Donnelly and Lauritzen 2006, Variance shadow maps): over a square of texels, by
// rows, then columns. Sums are of what depths differ from the one in the middle, since as differences of squares variances would lose their
// digits.
@group(0) @binding(0) var shadow: texture_depth_2d_array;
@group(0) @binding(1) var row_moments: texture_2d_array<f32>; // mean, variance of texels beside each other
@group(0) @binding(2) var moments: texture_storage_2d_array<rg32float, write>; // mean, variance
@group(0) @binding(3) var<uniform> first: vec4u;   // x: the row of workgroups at which the pass begins
override RADIUS: i32 = 3;       // texels to each side

/// Average depths along a row.
@compute @workgroup_size(8, 8)
fn along_rows(@builtin(global_invocation_id) invocation: vec3u) {
    let id = vec3i(invocation + vec3u(0u, first.x, 0u));
    let last = vec2i(textureDimensions(shadow)) - 1;
    if (any(id.xy > last)) { return; }
    let middle = textureLoad(shadow, id.xy, id.z, 0);
    var sum = vec2f(0.0);
    var k = -RADIUS;
    loop {
        let off = textureLoad(shadow, vec2i(clamp(id.x + k, 0, last.x), id.y), id.z, 0) - middle;
        sum += vec2f(off, off * off);
        k += 1;
        continuing { break if k > RADIUS; }
    }
    sum /= f32(2 * RADIUS + 1);
    textureStore(moments, id.xy, id.z, vec4f(middle + sum.x, max(sum.y - sum.x * sum.x, 0.0), 0.0, 0.0));
}

/// Average rows: the variance of all is the mean of theirs, and that of their means.
@compute @workgroup_size(8, 8)
fn along_columns(@builtin(global_invocation_id) invocation: vec3u) {
    let id = vec3i(invocation + vec3u(0u, first.x, 0u));
    let last = vec2i(textureDimensions(row_moments)) - 1;
    if (any(id.xy > last)) { return; }
    let middle = textureLoad(row_moments, id.xy, id.z, 0).x;
    var sum = vec3f(0.0);
    var k = -RADIUS;
    loop {
        let row = textureLoad(row_moments, vec2i(id.x, clamp(id.y + k, 0, last.y)), id.z, 0).xy;
        let off = row.x - middle;
        sum += vec3f(off, off * off, row.y);
        k += 1;
        continuing { break if k > RADIUS; }
    }
    sum /= f32(2 * RADIUS + 1);
    textureStore(moments, id.xy, id.z, vec4f(middle + sum.x, sum.z + max(sum.y - sum.x * sum.x, 0.0), 0.0, 0.0));
}
