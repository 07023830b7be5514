// The kernel by which shadows on surfaces are filtered, and the plane of a surface in a shadow map: see light_shadow.wgsl.
const KERNEL_RADIUS = 2.0;      // texels
const BEHIND = 0.25;            // texels behind the plane, and four times the bias more, begins what tells nothing of the surface

/// Evaluate the kernel's weight, 0..1, so many texels from its middle. Twin: reference/shadows.py:kernel_weight.
fn kernel_weight(x: vec4f) -> vec4f {
    let near = max(1.0 - x * x / (KERNEL_RADIUS * KERNEL_RADIUS), vec4f(0.0));
    return near * near;
}

/// Number the face of a cube, +X, -X, +Y, -Y, +Z, -Z, that a direction from its middle meets. Twin: reference/shadows.py:cube_face.
fn cube_face(direction: vec3f) -> i32 {
    let away = abs(direction);
    if (away.x >= away.y && away.x >= away.z) { return select(1, 0, direction.x > 0.0); }
    if (away.y >= away.z) { return select(3, 2, direction.y > 0.0); }
    return select(5, 4, direction.z > 0.0);
}

/// Differentiate x, y and depth in a map with respect to a step; place and step are homogeneous. Twin: reference/shadows.py:map_derivative.
fn map_derivative(at: vec4f, step: vec4f) -> vec3f {
    return (step.xyz - at.xyz / at.w * step.w) / at.w;
}

/// Find the slope of depth over x and y from their derivatives along two steps; area: the least that these are taken to span.
/// Twin: reference/shadows.py:depth_slope.
fn depth_slope(u: vec3f, v: vec3f, area: f32) -> vec2f {
    let spanned = u.x * v.y - u.y * v.x;
    let divisor = select(min(spanned, -area), max(spanned, area), spanned >= 0.0);
    return vec2f(u.z * v.y - v.z * u.y, v.z * u.x - u.z * v.x) / divisor;
}

/// Sum the weights of four texels of a kernel: (of what is lit, of what tells of the surface). above: texels that they stand off its plane
/// towards the light; bias: texels; casts: whether the surface is in the map. Twin: reference/shadows.py:weigh_texels.
fn weigh_texels(weight: vec4f, above: vec4f, bias: vec4f, casts: bool) -> vec2f {
    let told = select(weight, vec4f(0.0), (above < -BEHIND - 4.0 * bias) & vec4<bool>(casts));
    let lit = select(told, vec4f(0.0), above > bias);
    return vec2f(dot(lit, vec4f(1.0)), dot(told, vec4f(1.0)));
}
