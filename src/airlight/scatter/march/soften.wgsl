// A blur over a march's layer at the size that was computed, along rows or columns, which does not pass edges of depth: neighbours weigh as
// much as they lie near, and as their rays are as long (bilateral, separated: Pham et al. 2005). Lengths stay as they are.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/likeness.wgsl"
override GAUSSIAN: bool = true; // else all neighbours weigh alike
override DOWN: bool = false;    // along columns

const SOFTEN_RADIUS = 3;        // pixels to each side
const SOFTEN_SIGMA = 1.5;       // pixels, of the Gaussian

/// Weigh a neighbour so many pixels away, whose ray's length differs by `off`, relative. Twin: reference/soften.py:soften_weight.
fn soften_weight(away: f32, off: f32, sharpness: f32) -> f32 {
    let nearness = select(1.0, exp(-0.5 * away * away / (SOFTEN_SIGMA * SOFTEN_SIGMA)), GAUSSIAN);
    return nearness * exp(-sharpness * off);
}

/// Blur the layer `before` into `layer`.
@compute @workgroup_size(8, 8)
fn soften(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let own = textureLoad(before, id.xy, 0);
    let last = vec2i(frame.size) - 1;
    let reach = marched_length(vec2i(id.xy), own);
    var sum = vec4f(0.0);
    var k = -SOFTEN_RADIUS;
    loop {
        let at = vec2i(id.xy) + select(vec2i(k, 0), vec2i(0, k), DOWN);
        let within = clamp(at, vec2i(0), last);
        let found = textureLoad(before, within, 0);
        let weight = soften_weight(f32(k), relative_difference(marched_length(within, found), reach), frame.depth_sharpness);
        sum += select(0.0, weight, all(at >= vec2i(0)) && all(at <= last)) * vec4f(found.rgb, 1.0);
        k += 1;
        continuing { break if k > SOFTEN_RADIUS; }
    }
    textureStore(layer, id.xy, vec4f(sum.rgb / sum.a, own.a));
}
