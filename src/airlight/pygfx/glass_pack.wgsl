// Packs the surfaces that let light through: of each texel the depths of the first three, and of the others together, and what is left of the light
// behind each: a vec4u, or, where colours are kept, two.
//! include "scatter/march/glass_texel.wgsl"
override COLOURED: bool = false;

@group(0) @binding(0) var surfaces: texture_depth_2d_array;
@group(0) @binding(1) var passed: texture_2d_array<f32>; // see glass_peel.wgsl
@group(0) @binding(2) var<storage, read_write> glass: array<vec4u>;
@group(0) @binding(3) var<storage, read> begin: array<u32>;
@group(0) @binding(4) var solid: texture_depth_2d; // the light's shadow map

const IN_FRONT = 0.98;          // of a pane's depth, from which on what is solid counts as its frame

/// Read how far the first surface of a texel is; 0 where there is none, or it is behind what is solid.
fn first_surface(texel: vec2i) -> f32 {
    let side = vec2i(textureDimensions(passed).xy);
    let within = clamp(texel, vec2i(0), side - 1);
    let depth = textureLoad(surfaces, within, 0, 0);
    return select(depth, 0.0, any(within != texel) || solid_depth(within) > depth);
}

/// Read how far the nearest is of what is solid around the middle of a texel.
fn solid_depth(texel: vec2i) -> f32 {
    let size = vec2f(textureDimensions(solid));
    let middle = (vec2f(texel) + 0.5) * size / vec2f(textureDimensions(passed).xy);
    let low = vec2i(clamp(middle - 0.5, vec2f(0.0), size - 1.0));
    let high = vec2i(clamp(middle + 0.5, vec2f(0.0), size - 1.0));
    let below = max(textureLoad(solid, low, 0), textureLoad(solid, vec2i(high.x, low.y), 0));
    return max(below, max(textureLoad(solid, vec2i(low.x, high.y), 0), textureLoad(solid, high, 0)));
}

/// Choose the texel that tells of one: itself, or, where its middle lies on the frame of a pane, the nearest that shows the pane. What is lit of such a
/// texel, by the finer shadow map or its filter, lies behind the pane, and would be as bright as without it.
fn telling(texel: vec2i) -> vec2i {
    var found = texel;
    let before = solid_depth(texel);
    if (before > 0.0 && first_surface(texel) == 0.0) {
        var nearest = 100;
        for (var k = 0; k < 25; k++) {
            let away = vec2i(k % 5, k / 5) - 2;
            let depth = first_surface(texel + away);
            let far = away.x * away.x + away.y * away.y;
            let better = depth > 0.0 && before >= IN_FRONT * depth && far < nearest;
            found = select(found, texel + away, better);
            nearest = select(nearest, far, better);
        }
    }
    return found;
}

/// Pack a texel.
@compute @workgroup_size(8, 8)
fn pack_glass(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(passed).x;
    if (any(id.xy >= vec2u(side))) { return; }
    let texel = telling(vec2i(id.xy));
    var depths = vec4f(0.0);
    //! each k of 3: depths[k] = textureLoad(surfaces, texel, k, 0);
    // The others are taken for one, in the middle of them
    let others = textureLoad(passed, texel, 3, 0);
    depths.w = min(others.a / max(dot(others.rgb, vec3f(1.0 / 3.0)), 1e-6), depths.z);
    var sum = vec3f(0.0);
    var left: array<vec3f, 4>;
    //! each k of 4: sum += select(vec3f(0.0), textureLoad(passed, texel, k, 0).rgb, depths[k] > 0.0); left[k] = exp(-sum);
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
