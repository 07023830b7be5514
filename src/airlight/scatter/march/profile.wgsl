// Profile of a camera ray before surfaces that are seen through: at knots along it, what is scattered in up to there, and the optical length.
// Between two knots the medium counts as even, and as evenly lit.
//! include "medium/transmittance.wgsl"

const LISTED = 4.0;             // knots of a span, up to which each has its own place

struct Span {                   // of a ray's knots
    knots: vec4f,               // m: where they lie, in order; of more than LISTED, the first and the last, and the others evenly between
    count: f32,                 // of knots, but for one at the ray's end
    reach: f32,                 // m
}

struct PackedSpan {             // its knots as half floats
    knots: vec2u,
    count: f32,
    reach: f32,
}

/// Unpack a span. Twin: reference/profile.py:unpack_span.
fn unpack_span(span: PackedSpan) -> Span {
    return Span(vec4f(unpack2x16float(span.knots.x), unpack2x16float(span.knots.y)), span.count, span.reach);
}

/// Measure how far along the camera's ray of picture position uv a depth lies, m. rays, flat: projection.py: eye_rays; terms: depth_terms.
/// Twin: reference/profile.py:ray_distance.
fn ray_distance(uv: vec2f, depth: f32, rays: vec4f, terms: vec4f, flat: f32) -> f32 {
    let at = rays.xy * uv + rays.zw;
    let ahead = (terms.x * depth + terms.y) / (terms.z * depth + terms.w);
    return max(ahead, 0.0) * select(sqrt(1.0 + dot(at, at)), 1.0, flat > 0.0);
}

/// Place the k-th knot of a span, m. Twin: reference/profile.py:knot_place.
fn knot_place(span: Span, k: f32) -> f32 {
    let even = mix(span.knots.x, span.knots.y, k / max(span.count - 1.0, 1.0));
    let own = select(even, span.knots[u32(clamp(k, 0.0, LISTED - 1.0))], span.count <= LISTED);
    return select(own, span.reach, k >= span.count);
}

/// Find the knot, as a number, at or before which a distance lies; -1: before the first. Twin: reference/profile.py:knot_before.
fn knot_before(span: Span, t: f32) -> f32 {
    let along = (t - span.knots.x) / max(span.knots.y - span.knots.x, 1e-20);
    let even = clamp(floor(along * (span.count - 1.0)), -1.0, span.count - 1.0);
    let passed = select(vec4f(0.0), vec4f(1.0), span.knots <= vec4f(t)) * select(vec4f(0.0), vec4f(1.0), vec4f(0.0, 1.0, 2.0, 3.0) < vec4f(span.count));
    return select(even, dot(passed, vec4f(1.0)) - 1.0, span.count <= LISTED);
}

/// Pack (in-scattered radiance, optical length) as half floats. Twin: reference/profile.py:pack_knot.
fn pack_knot(value: vec4f) -> vec2u {
    let held = min(value, vec4f(65504.0));
    return vec2u(pack2x16float(held.xy), pack2x16float(held.zw));
}

/// Unpack (in-scattered radiance, optical length). Twin: reference/profile.py:unpack_knot.
fn unpack_knot(packed: vec2u) -> vec4f {
    return vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

/// Interpolate (in-scattered radiance, optical length) at a share of the way between two knots. Twin: reference/profile.py:between_knots.
fn between_knots(a: vec4f, b: vec4f, share: f32, sigma_t: vec3f) -> vec4f {
    let all = b.a - a.a;
    let thick = max(sigma_t * all, vec3f(1e-3)); // as thin as that it makes no difference
    let part = (1.0 - exp(-share * thick)) / (1.0 - exp(-thick));
    return vec4f(a.rgb + part * (b.rgb - a.rgb), a.a + share * all);
}
