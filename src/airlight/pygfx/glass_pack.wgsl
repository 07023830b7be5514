// Packs the surfaces that let light through: of each texel the depths of the first three, and of the others together, and what is left of the light
// behind each: a vec4u, or, where colours are kept, two.
//! include "scatter/march/glass_texel.wgsl"
override COLOURED: bool = false;

@group(0) @binding(0) var surfaces: texture_depth_2d_array;
@group(0) @binding(1) var passed: texture_2d_array<f32>; // see glass_peel.wgsl
@group(0) @binding(2) var<storage, read_write> glass: array<vec4u>;
@group(0) @binding(3) var<storage, read> begin: array<u32>;

/// Pack a texel.
@compute @workgroup_size(8, 8)
fn pack_glass(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(passed).x;
    if (any(id.xy >= vec2u(side))) { return; }
    var depths = vec4f(0.0);
    //! each k of 3: depths[k] = textureLoad(surfaces, id.xy, k, 0);
    // The others are taken for one, in the middle of them
    let others = textureLoad(passed, id.xy, 3, 0);
    depths.w = min(others.a / max(dot(others.rgb, vec3f(1.0 / 3.0)), 1e-6), depths.z);
    var sum = vec3f(0.0);
    var left: array<vec3f, 4>;
    //! each k of 4: sum += select(vec3f(0.0), textureLoad(passed, id.xy, k, 0).rgb, depths[k] > 0.0); left[k] = exp(-sum);
    let at = begin[0] + id.y * side + id.x;
    let places = vec2u(pack2x16float(depths.xy), pack2x16float(depths.zw));
    if (COLOURED) {
        glass[2u * at] = vec4u(places, pack_left(left[0]), pack_left(left[1]));
        glass[2u * at + 1u] = vec4u(pack_left(left[2]), pack_left(left[3]), 0u, 0u);
    } else {
        let packed = vec2u(pack2x16unorm(vec2f(left[0].x, left[1].x)), pack2x16unorm(vec2f(left[2].x, left[3].x)));
        glass[at] = vec4u(places, packed);
    }
}
