// Ends of pygfx's own fragment shaders where only the distances of what is seen through are kept, by a maximum, and their number, by a sum. They are
// drawn at the size of the march, and tested against the picture's depth at the pixels that it samples.
//! include "pygfx/pane_camera.wgsl"
@group(9) @binding(91) var pane_depths: texture_depth_2d;
const PANE_SPLIT = false;       // opaque fragments are drawn elsewhere; private_panes.py puts it in

struct FragmentOutput {
    // virtualfield position: vec4f = varyings.position;
    @location(0) color: vec4<f32>, // of the extremes
    @location(1) sums: vec4<f32>,
};

/// Puts out a fragment's distance, as spans.wgsl reads them; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, position: vec4f) {
    if (PANE_SPLIT && (*outp).color.a >= 0.95) { discard; }
    let pixels = textureDimensions(pane_depths);
    let sampled = (2u * vec2u(position.xy) + 1u) * pixels / (2u * vec2u(pane_fog.size));
    if (position.z > textureLoad(pane_depths, min(sampled, pixels - 1u), 0)) { discard; }
    let t = min(ray_distance(position.xy / u_stdinfo.physical_size, position.z, pane_fog.rays, pane_fog.depth, pane_fog.flat), 60000.0); // of halves
    (*outp).color = vec4f(t, -t, 0.0, 1.0);
    (*outp).sums = vec4f(t, t * t, 1.0, 1.0);
}
