// Where a light reaches a ray, and what of it a stretch scatters. Twins: reference/medium.py.
//! include "scatter/march/ray.wgsl"
// The light once more: software Vulkan compiles a shader anew for each value of a uniform that ends a loop, but reads them faster.
@group(0) @binding(7) var<storage, read> counted: Light;
@group(0) @binding(8) var layer_transmittance: texture_storage_2d<rgba32float, write>;

override UPSAMPLED: bool = false; // a later pass brings the layer to the picture's size, and writes its transmittance

override BIASED: bool = false;  // shadows begin farther behind what hides the light

const NARROW = vec3f(0.25, 0.5, 0.25); // of v, that one quadrature takes: before, in and behind a cone's fully lit part

/// Write a pixel of the layer: the in-scattered radiance of this light and those before it, and, once, the ray's transmittance.
fn store_layer(p: vec2u, ray: Ray, radiance: vec3f) {
    textureStore(layer, p, vec4f(radiance, ray.reach));
    if (FIRST && !UPSAMPLED) { textureStore(layer_transmittance, p, vec4f(transmittance(ray.reach), 1.0)); }
}

/// The bias in view i, in what it has for metres.
fn bias_in(i: u32) -> f32 {
    return select(0.0, light.bias / light.view[i].depth_scale, BIASED);
}

/// From which depth on a place is lit where the map holds this; a sun's map holds 0 where nothing casts.
fn threshold(held: f32, bias: f32) -> f32 {
    if (KIND == 0u) { return select(held - bias, -3e38, held == 0.0); }
    return held / (1.0 + bias * held);
}

/// Where b + t a >= 0 within a range of t.
fn cut(range: vec2f, b: f32, a: f32) -> vec2f {
    let at = -b / select(a, 1.0, a == 0.0);
    let within = select(vec2f(range.x, min(range.y, at)), vec2f(max(range.x, at), range.y), a > 0.0);
    return select(within, select(range, vec2f(range.x, range.x - 1.0), b < 0.0), a == 0.0);
}

struct Line {                   // a ray's part in a view
    a: vec4f,                   // of View.matrix, a metre of the ray
    b: vec4f,                   // at t = 0
    range: vec2f,               // of t
}

/// The part of a range of t that lies in view i; margin: texels at the map's border that do not count.
fn line_of(i: u32, ray: Ray, range: vec2f, margin: f32) -> Line {
    let a = light.view[i].matrix * vec4f(ray.direction, 0.0);
    let b = light.view[i].matrix * vec4f(ray.origin, 1.0);
    let side = light.side - margin;
    var within = cut(range, b.w, a.w);
    within = cut(within, b.x - margin * b.w, a.x - margin * a.w);
    within = cut(within, b.y - margin * b.w, a.y - margin * a.w);
    within = cut(within, side * b.w - b.x, side * a.w - a.x);
    within = cut(within, side * b.w - b.y, side * a.w - a.y);
    return Line(a, b, within);
}

/// Where a ray lies in a cone around a spot's axis within a range of t; cosine: of its half angle.
fn in_cone(ray: Ray, range: vec2f, cosine: f32) -> vec2f {
    let ahead = cut(range, dot(ray.origin - light.place, light.axis), dot(ray.direction, light.axis));
    return select(in_narrow_cone(ray, range, cosine), ahead, cosine < 1e-3); // a half space
}

fn in_narrow_cone(ray: Ray, range: vec2f, cosine: f32) -> vec2f {
    let q = ray.origin - light.place;
    let squared = cosine * cosine;
    let along = dot(ray.direction, light.axis);
    let at = dot(q, light.axis);
    let a = along * along - squared;
    let b = along * at - squared * dot(ray.direction, q);
    let c = at * at - squared * dot(q, q);
    let root = sqrt(max(b * b - a * c, 0.0));
    let under = select(a, select(-1e-9, 1e-9, a >= 0.0), abs(a) < 1e-9);
    let first = (-b - root) / under;
    let second = (-b + root) / under;
    let low = min(first, second);
    let high = max(first, second);
    if (a > 0.0) { return select(vec2f(range.x, min(range.y, low)), vec2f(max(range.x, high), range.y), along > 0.0); }
    let hit = b * b > a * c && at + 0.5 * (low + high) * along > 0.0;
    return select(vec2f(range.x, range.x - 1.0), vec2f(max(range.x, low), min(range.y, high)), hit);
}

/// The nearest approach of a ray to a lamp: (t there, distance).
fn approach(ray: Ray) -> vec2f {
    let to = light.place - ray.origin;
    let t = dot(to, ray.direction);
    return vec2f(t, max(length(to - t * ray.direction), 1e-6 * length(to) + 1e-9));
}

/// v of t = t0 + h sinh v (t0, h: the ray's nearest approach to the lamp).
fn v_at(near: vec2f, t: f32) -> f32 {
    return asinh((t - near.x) / near.y);
}

/// The integrand over v. There t + d = t0 + h e^v and dt / d^2 = dv / (h cosh v), and no peak of a phase function is narrow.
fn by_v(ray: Ray, near: vec2f, v: f32) -> vec3f {
    let grown = exp(v);
    let longer = 0.5 * (grown + 1.0 / grown);
    let beyond = 0.5 * (grown - 1.0 / grown);
    let d = near.y * longer;
    let t = near.x + near.y * beyond;
    let aside = dot(ray.origin + t * ray.direction - light.place, light.axis) / d;
    return lamplight(t, d, -beyond / longer, aside) / d;
}

/// In-scattered radiance of a lit stretch of a lamp's ray; full: where the ray lies in the part of a spot's cone that is fully lit, at
/// whose border the integrand has a kink.
fn lamp_stretch(ray: Ray, near: vec2f, full: vec2f, range: vec2f) -> vec3f {
    let inner = clamp(full, range.xx, range.yy);
    let ends = vec4f(v_at(near, range.x), v_at(near, inner.x), v_at(near, inner.y), v_at(near, range.y));
    let widths = max(ends.yzw - ends.xyz, vec3f(0.0));
    let parts = ceil(widths / NARROW);
    let first = vec3f(0.0, parts.x, parts.x + parts.y);
    let each = widths / max(parts, vec3f(1.0));
    let all = first.z + parts.z;
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        if (k >= all) { break; }
        let piece = select(
            vec3f(ends.x, 0.0, each.x),
            select(vec3f(ends.y, first.y, each.y), vec3f(ends.z, first.z, each.z), k >= first.z),
            k >= first.y
        );
        let middle = piece.x + (k - piece.y + 0.5) * piece.z;
        let off = 0.38729833 * piece.z;
        sum += piece.z / 18.0 * (5.0 * (by_v(ray, near, middle - off) + by_v(ray, near, middle + off)) + 8.0 * by_v(ray, near, middle));
        k += 1.0;
    }
    return sum;
}

/// Where a ray lies in the part of a spot's cone that is fully lit, within a range of t.
fn in_full(ray: Ray, range: vec2f) -> vec2f {
    if (KIND != 1u) { return range; }
    let found = in_cone(ray, range, min((1.0 - light.cone_offset) / light.cone_scale, 1.0));
    return select(range.yy, found, found.y > found.x);
}
