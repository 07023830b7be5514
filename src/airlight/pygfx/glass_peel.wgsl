// Ends of pygfx's own fragment shaders where what they let through of a light is kept, a surface behind the other.
@group(9) @binding(90) var glass_nearer: texture_depth_2d; // of the surfaces that were kept last
const GLASS_FIRST = false;      // none were

struct FragmentOutput {
    // virtualfield position: vec4f = varyings.position;
    @location(0) color: vec4<f32>,
};

/// Puts out what a fragment lets through, if it lies behind those that were kept; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, position: vec4f) {
    let alpha = (*outp).color.a;
    if (alpha < 0.002) { discard; }
    if (!GLASS_FIRST && position.z >= 0.99999 * textureLoad(glass_nearer, vec2i(position.xy), 0)) { discard; }
    (*outp).color = vec4f(1.0 - min(alpha, 1.0));
}
