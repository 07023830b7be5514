// The signed amount of light that one light's rays add or lack, on its grid. Twin: reference/look.py:ray_amount.
//! include "look/rays.wgsl"
//! include "wgsl/unit_at.wgsl"
const CONTRAST = 0.40;
const MIST = 0.8;
const MOST_CONTRAST = 20.0; // of which the hyperbolic tangent is 1; some drivers' is no number beyond 44

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var before: texture_2d<f32>; // bands
@group(0) @binding(2) var amounts: texture_storage_2d<rgba16float, write>;

/// Writes the amount of one node of the grid.
@compute @workgroup_size(64)
fn ray_amount(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= LINES + 2u) { return; }
    let found = textureLoad(before, id.xy, 0);
    let distance = rays.nearest + f32(id.y + 1u) * rays.step;
    let angle = rays.start + (f32(id.x) - 0.5) * (rays.span / f32(LINES));
    let begins = entry_distance(unit_at(angle), rays);
    let total = found.z + rays.rest;
    let contrast = clamp(CONTRAST * found.y / total / rays.deviation, -MOST_CONTRAST, MOST_CONTRAST);
    let amount = tanh(contrast) + rays.mist * MIST * found.z / total;
    textureStore(amounts, id.xy, vec4f(amount * exp(-distance / rays.length) * smooth_step(distance - begins, 0.0, rays.soft), 0.0, 0.0, 1.0));
}
