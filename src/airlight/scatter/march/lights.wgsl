// The part of a ray that a shadow view or a spot's cone holds, and the integral over a lit segment of it.
//
//     L = integral over the lit t of  sigma_s p(cosine) E(t) e^(-sigma_t (t + d))
//
// A directional light's integral is closed. For one with a position, t = t0 + h sinh v with the ray's nearest approach (t0, h) to it turns
// dt / d^2 into dv / (h cosh v), so that the integrand over v is smooth however near the ray passes: three-point Gauss quadrature on pieces
// of v. The substitution is our own.
//! include "scatter/march/shade.wgsl"
//! include "scatter/march/ranges.wgsl"
// The light once more: software Vulkan compiles a shader anew for each value of a uniform that ends a loop, but reads them faster.
@group(0) @binding(7) var<storage, read> light_storage: Light;

const QUADRATURE_WIDTHS = vec3f(0.25, 0.5, 0.25); // of v, of a piece: before, in and behind a cone's fully lit part
const SHAPED_WIDTH = 0.25;      // of v, of a piece of what a light with a cookie adds, and with photometry
const TURN_WIDTH = 0.06;
const LONGEST_DEPTH = 0.25;     // optical depth of a piece of what a directional light with a cookie adds
const GAUSS_NODE = 0.38729833;  // sqrt(3 / 5) / 2: of the outer nodes from a piece's middle, of its width

/// Find the part of a range of t in which a spot's cone is fully lit; at its border the integrand has a kink.
/// Twin: reference/march.py:full_cone_range.
fn full_cone_range(ray: Ray, range: vec2f) -> vec2f {
    if (!CONE) { return range; }
    let found = clip_to_cone(ray, range, min((1.0 - light.cone_offset) / light.cone_scale, 1.0));
    return select(range.yy, found, found.y > found.x);
}

/// Evaluate v of t = t0 + h sinh v, nearest = (t0, h). Twin: reference/march.py:sinh_parameter.
fn sinh_parameter(nearest: vec2f, t: f32) -> f32 {
    return asinh((t - nearest.x) / nearest.y);
}

/// Evaluate the integrand over v: there t + d = t0 + h e^v and dt / d^2 = dv / (h cosh v), and no peak of a phase function is narrow.
/// Twin: reference/march.py:sinh_integrand.
fn sinh_integrand(ray: Ray, nearest: vec2f, v: f32) -> vec3f {
    let grown = exp(v);
    let cosh_v = 0.5 * (grown + 1.0 / grown);
    let sinh_v = 0.5 * (grown - 1.0 / grown);
    let d = nearest.y * cosh_v;
    let t = nearest.x + nearest.y * sinh_v;
    let axis_cosine = dot(ray.origin + t * ray.direction - light.position, light.axis) / d;
    return in_scatter_punctual(ray, t, d, -sinh_v / cosh_v, axis_cosine) / d;
}

/// Integrate in-scattered radiance over a lit segment of the ray of a light with a position. full: see full_cone_range.
/// Twin: reference/march.py:integrate_punctual.
fn integrate_punctual(ray: Ray, nearest: vec2f, full: vec2f, segment: vec2f) -> vec3f {
    // Divide v at the borders of the fully lit part, and each part into pieces
    let inner = clamp(full, segment.xx, segment.yy);
    let ends = vec4f(
        sinh_parameter(nearest, segment.x),
        sinh_parameter(nearest, inner.x),
        sinh_parameter(nearest, inner.y),
        sinh_parameter(nearest, segment.y)
    );
    let widths = max(ends.yzw - ends.xyz, vec3f(0.0));
    let pieces = ceil(widths / QUADRATURE_WIDTHS);
    let first = vec3f(0.0, pieces.x, pieces.x + pieces.y);
    let each = widths / max(pieces, vec3f(1.0));
    let count = first.z + pieces.z;
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        if (k >= count) { break; }
        // Choose the part of the k-th piece: (its start in v, its first piece, the pieces' width)
        let part = select(
            vec3f(ends.x, 0.0, each.x),
            select(vec3f(ends.y, first.y, each.y), vec3f(ends.z, first.z, each.z), k >= first.z),
            k >= first.y
        );
        // Sum the piece by Gauss's rule of three nodes
        let middle = part.x + (k - part.y + 0.5) * part.z;
        let off = GAUSS_NODE * part.z;
        let outer = sinh_integrand(ray, nearest, middle - off) + sinh_integrand(ray, nearest, middle + off);
        sum += part.z / 18.0 * (5.0 * outer + 8.0 * sinh_integrand(ray, nearest, middle));
        k += 1.0;
    }
    return sum;
}

/// Evaluate the integrand over v of a light with a shape.
fn shaped_integrand(ray: Ray, nearest: vec2f, v: f32) -> vec3f {
    let grown = exp(v);
    return shape_colour(nearest.x + 0.5 * nearest.y * (grown - 1.0 / grown), 0.0) * sinh_integrand(ray, nearest, v);
}

/// Integrate in-scattered radiance over a lit segment of the ray of a light with a position and a shape, from texel to texel of that.
fn integrate_shaped(ray: Ray, nearest: vec2f, full: vec2f, segment: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var t = segment.x;
    loop {
        if (t >= segment.y) { break; }
        let v = sinh_parameter(nearest, t);
        let most = exp(v + select(SHAPED_WIDTH, TURN_WIDTH, SHAPE == SPHERE));
        let widest = nearest.x + 0.5 * nearest.y * (most - 1.0 / most);
        var end = max(min(min(next_texel(t), widest), segment.y), t + 1e-6 * max(t, 1e-3));
        if (t < full.x) { end = min(end, max(full.x, t + 1e-6 * max(t, 1e-3))); } else if (t < full.y) { end = min(end, max(full.y, t + 1e-6 * max(t, 1e-3))); }
        end = min(end, segment.y);
        // Sum the piece by Gauss's rule of three nodes
        let width = sinh_parameter(nearest, end) - v;
        let middle = v + 0.5 * width;
        let off = GAUSS_NODE * width;
        let outer = shaped_integrand(ray, nearest, middle - off) + shaped_integrand(ray, nearest, middle + off);
        sum += width / 18.0 * (5.0 * outer + 8.0 * shaped_integrand(ray, nearest, middle));
        t = select(end, segment.y, end >= segment.y);
    }
    return sum;
}

/// Integrate density times transmittance, times its shape, over a lit segment of the ray of a directional light, m, from texel to texel.
fn integrate_patterned(ray: Ray, segment: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var t = segment.x;
    let longest = LONGEST_DEPTH / max(max(frame.sigma_t.x, max(frame.sigma_t.y, frame.sigma_t.z)), 1e-12);
    loop {
        if (t >= segment.y) { break; }
        let end = min(max(min(next_texel(t), t + longest), t + 1e-6 * max(t, 1e-3)), segment.y);
        let middle = 0.5 * (t + end);
        sum += shape_colour(0.5 * (t + middle), 0.0) * integrate_evenly(ray, vec2f(t, middle));
        sum += shape_colour(0.5 * (middle + end), 0.0) * integrate_evenly(ray, vec2f(middle, end));
        t = end;
    }
    return sum;
}

/// Integrate in-scattered radiance over a lit segment of the ray where the fog is smooth.
fn integrate_smooth(ray: Ray, nearest: vec2f, full: vec2f, segment: vec2f) -> vec3f {
    if (SHAPE != 0u) { return integrate_shaped(ray, nearest, full, segment); }
    return integrate_punctual(ray, nearest, full, segment);
}

/// Integrate in-scattered radiance over a lit segment of the ray of a light with a position, band by band of the fog's heights.
/// Twin: reference/march.py:integrate_in_fog.
fn integrate_in_fog(ray: Ray, nearest: vec2f, full: vec2f, segment: vec2f) -> vec3f {
    if (VARIES) { return integrate_in_field(ray, nearest, full, segment); }
    if (FOG == EVEN) { return integrate_smooth(ray, nearest, full, segment); }
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        if (k >= FOG_BANDS) { break; }
        let part = clip_to_band(ray, segment, k);
        if (part.y > part.x) { sum += integrate_smooth(ray, nearest, full, part); }
        k += 1u;
    }
    return sum;
}

/// Integrate density times transmittance, and its shape, over a lit segment of the ray of a directional light, m.
fn integrate_directional(ray: Ray, segment: vec2f) -> vec3f {
    if (VARIES) { return integrate_in_field(ray, vec2f(0.0), vec2f(0.0), segment); }
    if (SHAPE != 0u) { return integrate_patterned(ray, segment); }
    return integrate_evenly(ray, segment);
}

/// Integrate density times transmittance over a lit segment of the ray of a directional light without a shape, m: band by band of the fog's
/// heights where there is fog above the ramp, as then a part of it is not closed. Twin: reference/march.py:integrate_evenly.
fn integrate_evenly(ray: Ray, segment: vec2f) -> vec3f {
    if (FOG == EVEN) { return transmittance_integral(segment.y, frame.sigma_t) - transmittance_integral(segment.x, frame.sigma_t); }
    if (FOG == EXPONENTIAL || !FADES) { return directional_integral(ray, segment); }
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        if (k >= FOG_BANDS) { break; }
        let part = clip_to_band(ray, segment, k);
        if (part.y > part.x) { sum += directional_integral(ray, part); }
        k += 1u;
    }
    return sum;
}
