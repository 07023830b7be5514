// Places of steps along a ray, and groups of steps, over which what lies along the ray is found at once.
//! include "scatter/march/field.wgsl"

const IN_GRIDS = 4.0;           // steps of a group there
const MANY_STEPS = 64.0;        // from which on groups of them are of 8 or 16, else of 4

/// Place the k-th of n steps, or a part of one, along a ray. Twin: reference/march_field.py:step_place.
fn step_place(k: f32, n: f32, reach: f32, stretch: vec4f) -> f32 {
    if (k < stretch.z) { return k * stretch.x / stretch.z; }
    if (k < stretch.w) { return stretch.x + (k - stretch.z) * (stretch.y - stretch.x) / (stretch.w - stretch.z); }
    return stretch.y + (k - stretch.w) * (reach - stretch.y) / max(n - stretch.w, 1e-6);
}

/// Find the step, and the part of it, at t of a ray: the inverse of step_place. Twin: reference/march_field.py:step_at.
fn step_at(t: f32, n: f32, reach: f32, stretch: vec4f) -> f32 {
    if (t < stretch.x) { return t * stretch.z / stretch.x; }
    if (t < stretch.y) { return stretch.z + (t - stretch.x) * (stretch.w - stretch.z) / (stretch.y - stretch.x); }
    return stretch.w + (t - stretch.y) * (n - stretch.w) / max(reach - stretch.y, 1e-20);
}

/// Sum the powers 0 to n - 1 of a number, n 1, 2, 4, 8 or 16. Twin: reference/march_field.py:sum_of_powers.
fn sum_of_powers(x: vec3f, n: f32) -> vec3f {
    let one = vec3f(1.0);
    let squared = x * x;
    let fourth = squared * squared;
    let halves = select(one, 1.0 + x, n > 1.0) * select(one, 1.0 + squared, n > 2.0);
    return halves * select(one, 1.0 + fourth, n > 4.0) * select(one, 1.0 + fourth * fourth, n > 8.0);
}

/// Choose the number of steps of a group that begins at the k-th of n: what lies along all of them is found at once, and their weights fall by
/// one factor from step to step, as they do in exponential fog; what is left of a ray goes step by step. grids: steps that begin and end
/// where there are some. Twin: reference/march_field.py:group_size.
fn group_size(k: f32, n: f32, grids: vec2f) -> f32 {
    var most = select(4.0, select(8.0, 16.0, FOG == EXPONENTIAL && !VARIES), n >= MANY_STEPS);
    if (VARIES) { most = select(most, select(1.0, IN_GRIDS, n >= MANY_STEPS), k + most > grids.x && k < grids.y); }
    return select(1.0, most, k + most <= n);
}
