// Looks up the medium before a fragment of what is seen through, in the profiles of the rays around it.
//! include "pygfx/pane_distance.wgsl"
@group(9) @binding(91) var pane_spans: texture_2d<f32>;
@group(9) @binding(92) var pane_profile: texture_2d_array<f32>;

/// Look up (in-scattered radiance, optical length) up to a distance on one ray of the march, and weigh it: a ray that ends before, at
/// something near, knows little.
fn air_on_ray(q: vec2i, t: f32) -> vec4f {
    let texel = textureLoad(pane_spans, q, 0);
    let span = Span(texel.x, texel.y, texel.z, texel.w);
    let k = knot_before(span, t);
    let begin = select(knot(span, k), 0.0, k < 0.0);
    let end = knot(span, k + 1.0);
    let a = select(textureLoad(pane_profile, q, i32(max(k, 0.0)), 0), vec4f(0.0), k < 0.0);
    let b = textureLoad(pane_profile, q, i32(k + 1.0), 0);
    return between_knots(a, b, clamp((t - begin) / max(end - begin, 1e-20), 0.0, 1.0), pane_fog.sigma_t);
}

/// Look up (in-scattered radiance, optical length) before a fragment, among the four rays around it.
fn air_before(position: vec3f) -> vec4f {
    let t = pane_distance(position);
    let at = (position.xy - pane_fog.shift) / pane_fog.ratio - 0.5;
    let base = floor(at);
    let part = at - base;
    let most = vec2i(pane_fog.size) - 1;
    var sum = vec4f(0.0);
    var weights = 0.0;
    var k = 0u;
    loop {
        let step = vec2f(vec2u(k & 1u, k >> 1u));
        let near = mix(1.0 - part, part, step);
        let q = clamp(vec2i(base + step), vec2i(0), most);
        let weight = max(near.x * near.y, 1e-6) * select(1e-4, 1.0, textureLoad(pane_spans, q, 0).w >= 0.98 * t);
        sum += weight * air_on_ray(q, t);
        weights += weight;
        k += 1u;
        continuing { break if k >= 4u; }
    }
    return sum / weights;
}
