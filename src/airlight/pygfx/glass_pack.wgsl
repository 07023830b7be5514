// Packs the surfaces that let light through: of each texel the depths of the first four, and what is left of the light behind each.

@group(0) @binding(0) var surfaces: texture_depth_2d_array;
@group(0) @binding(1) var passed: texture_2d<f32>; // by each of them
@group(0) @binding(2) var<storage, read_write> glass: array<vec4u>;
@group(0) @binding(3) var<storage, read> begin: array<u32>;

/// Pack a texel.
@compute @workgroup_size(8, 8)
fn pack_glass(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(passed).x;
    if (any(id.xy >= vec2u(side))) { return; }
    var depths = vec4f(0.0);
    var left = textureLoad(passed, id.xy, 0);
    //! each k of 4: depths[k] = textureLoad(surfaces, id.xy, k, 0);
    left = select(vec4f(1.0), left, depths > vec4f(0.0));
    left.y *= left.x;
    left.z *= left.y;
    left.w *= left.z;
    let packed = vec4u(pack2x16float(depths.xy), pack2x16float(depths.zw), pack2x16unorm(left.xy), pack2x16unorm(left.zw));
    glass[begin[0] + id.y * side + id.x] = packed;
}
