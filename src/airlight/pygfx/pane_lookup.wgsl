// Looks up the medium before a fragment of what is seen through, in the profiles of the rays around it.
//! include "pygfx/pane_camera.wgsl"
@group(9) @binding(91) var<storage, read> pane_spans: array<PackedSpan>;
@group(9) @binding(92) var<storage, read> pane_profile: array<vec2u>; // see pack_knot

/// Look up (in-scattered radiance, optical length) before a fragment: profiles of the four rays around it, averaged knot by knot.
fn air_before(position: vec3f) -> vec4f {
    let t = ray_distance(position.xy / u_stdinfo.physical_size, position.z, pane_fog.rays, pane_fog.depth, pane_fog.flat);
    let at = (position.xy - pane_fog.shift) / pane_fog.ratio - 0.5;
    let base = floor(at);
    let part = at - base;
    let most = vec2i(pane_fog.size) - 1;
    let low = clamp(vec2i(base), vec2i(0), most);
    let high = clamp(vec2i(base) + 1, vec2i(0), most);
    let across = i32(pane_fog.size.x);
    let rays = across * i32(pane_fog.size.y);
    let q = across * vec4i(low.yy, high.yy) + vec4i(low.x, high.x, low.x, high.x);
    let near = vec4f((1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y), (1.0 - part.x) * part.y, part.x * part.y);
    // Average the spans of the rays that pass the fragment, not those that end before it at something near, and meet as many surfaces as the
    // nearest one of them
    let s = array<PackedSpan, 4>(pane_spans[q.x], pane_spans[q.y], pane_spans[q.z], pane_spans[q.w]);
    var w = max(near, vec4f(1e-6)) * select(vec4f(1e-6), vec4f(1.0), vec4f(s[0].reach, s[1].reach, s[2].reach, s[3].reach) >= vec4f(0.98 * t));
    let most_weight = max(max(w.x, w.y), max(w.z, w.w));
    var count = s[3].count;
    //! each k of 3: count = select(count, s[k].count, w[k] == most_weight);
    w *= select(vec4f(1e-6), vec4f(1.0), vec4f(s[0].count, s[1].count, s[2].count, s[3].count) == vec4f(count));
    w /= dot(w, vec4f(1.0));
    var span = Span(vec4f(0.0), count, 0.0);
    //! each k of 4: span.knots += w[k] * unpack_span(s[k]).knots; span.reach += w[k] * s[k].reach;
    // Average their knots before and behind the fragment
    let before = knot_before(span, t);
    let begin = select(knot_place(span, before), 0.0, before < 0.0);
    let end = knot_place(span, before + 1.0);
    var a = vec4f(0.0);
    var b = vec4f(0.0);
    let first = q + i32(max(before, 0.0)) * rays;
    let second = q + i32(before + 1.0) * rays;
    //! each k of 4: a += w[k] * unpack_knot(pane_profile[first[k]]); b += w[k] * unpack_knot(pane_profile[second[k]]);
    a = select(a, vec4f(0.0), before < 0.0);
    return between_knots(a, b, clamp((t - begin) / max(end - begin, 1e-20), 0.0, 1.0), pane_fog.sigma_t);
}
