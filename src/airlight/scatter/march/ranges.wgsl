// Ranges of a ray that a shadow view or a spot's cone holds, and depths of shadow maps.
//! include "scatter/march/ray.wgsl"
override BIASED: bool = false;  // shadows begin farther behind what hides the light
var<private> ends_midway: bool = false; // a part of a ray, see parts.wgsl, that ends before any surface

const LAST_TEXELS = 4.0;        // of a ray before a surface, whose visibility is that where they begin

/// Convert the bias to view i's depth, or, of a light with a position, to the inverse of its depth. Twin: reference/march.py:depth_bias.
fn depth_bias(i: u32) -> f32 {
    return select(0.0, light.bias / light.view[i].depth_scale, BIASED);
}

/// Move the depth that a map holds away from the light by the bias: from there on a point is lit. A directional light's map holds 0 where
/// nothing casts. Twin: reference/march.py:biased_occluder_depth.
fn biased_occluder_depth(occluder: f32, bias: f32) -> f32 {
    if (DIRECTIONAL) { return select(occluder - bias, -3e38, occluder == 0.0); }
    return occluder / (1.0 + bias * occluder);
}

struct ProjectedRay {           // a ray in a shadow view: homogeneous map coordinates b + t a
    a: vec4f,                   // of ShadowView.matrix, a metre of the ray
    b: vec4f,                   // at t = 0
    range: vec2f,               // of t, that lies in the map
}

/// Project a ray into view i, and clip a range of t to its map; margin: texels at the map's border that do not count.
/// Twin: reference/march.py:project_ray.
fn project_ray(i: u32, ray: Ray, range: vec2f, margin: f32) -> ProjectedRay {
    let a = light.view[i].matrix * vec4f(ray.direction, 0.0);
    let b = light.view[i].matrix * vec4f(ray.origin, 1.0);
    let side = light.side - margin;
    var within = clip_range(range, b.w, a.w);
    within = clip_range(within, b.x - margin * b.w, a.x - margin * a.w);
    within = clip_range(within, b.y - margin * b.w, a.y - margin * a.w);
    within = clip_range(within, side * b.w - b.x, side * a.w - a.x);
    within = clip_range(within, side * b.w - b.y, side * a.w - a.y);
    return ProjectedRay(a, b, within);
}

/// Clip a range of t to a cone around a spot's axis, of a half angle with this cosine. Twin: reference/march.py:clip_to_cone.
fn clip_to_cone(ray: Ray, range: vec2f, cosine: f32) -> vec2f {
    let from_light = ray.origin - light.position;
    let ahead = clip_range(range, dot(from_light, light.axis), dot(ray.direction, light.axis));
    // Count t from the nearest approach: of a ray close by the light few digits would be left of the cone's squares
    let t = -dot(from_light, ray.direction);
    let within = clip_to_narrow_cone(from_light + t * ray.direction, ray.direction, light.axis, range - t, cosine) + t;
    return select(within, ahead, cosine < 1e-3); // a half space
}

/// Clip a range of t of the ray q + t direction to a cone around an axis from the origin, less than a half space.
/// Twin: reference/march.py:clip_to_narrow_cone.
fn clip_to_narrow_cone(q: vec3f, direction: vec3f, axis: vec3f, range: vec2f, cosine: f32) -> vec2f {
    // Solve (axis . p)^2 = cosine^2 p . p for p = q + t direction
    let squared = cosine * cosine;
    let along = dot(direction, axis);
    let at = dot(q, axis);
    let a = along * along - squared;
    let b = along * at - squared * dot(direction, q);
    let c = at * at - squared * dot(q, q);
    let root = sqrt(max(b * b - a * c, 0.0));
    let under = select(a, select(-1e-9, 1e-9, a >= 0.0), abs(a) < 1e-9);
    let first = (-b - root) / under;
    let second = (-b + root) / under;
    let low = min(first, second);
    let high = max(first, second);
    // A ray steeper than the cone enters or leaves it once, any other passes through the cone or through its mirror image
    if (a > 0.0) { return select(vec2f(range.x, min(range.y, low)), vec2f(max(range.x, high), range.y), along > 0.0); }
    let hit = b * b > a * c && at + 0.5 * (low + high) * along > 0.0;
    return select(vec2f(range.x, range.x - 1.0), vec2f(max(range.x, low), min(range.y, high)), hit);
}

/// Find a ray's nearest approach to the light: (t there, distance). Twin: reference/march.py:nearest_approach.
fn nearest_approach(ray: Ray) -> vec2f {
    let to_light = light.position - ray.origin;
    let t = dot(to_light, ray.direction);
    return vec2f(t, max(length(to_light - t * ray.direction), 1e-6 * length(to_light) + 1e-9));
}

/// Find t from which on a ray takes the visibility that it has there, in view i, w its W at the ray's end: before a surface, depths of the
/// map's texels, and of the picture's pixels, cannot tell the one side of it from the other. Twin: reference/march.py:last_stretch.
fn last_stretch(i: u32, ray: Ray, w: f32) -> f32 {
    let texel = light.view[i].texel * select(max(w, 0.0), 1.0, DIRECTIONAL);
    return select(ray.reach, max(ray.reach - LAST_TEXELS * texel, 0.0), !ends_midway && ray.reach < frame.max_distance);
}

/// Evaluate the angle at the light between the nearest approach (t0, h) and the ray at t. Twin: reference/march.py:equiangular_angle.
fn equiangular_angle(nearest: vec2f, t: f32) -> f32 {
    return atan2(t - nearest.x, nearest.y);
}
