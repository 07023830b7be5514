// Ends of pygfx's own fragment shaders where what they let through of a light is kept, a surface behind the other: optical depths, which add up. Modes
// are numbered as in panes.py.
@group(9) @binding(90) var glass_nearer: texture_depth_2d; // of the surfaces that were kept last
const GLASS_FIRST = false;      // none were
const GLASS_MODE = 0u;          // one of these; private_panes.py puts it in

const TINT = 3u;                // its colour passes
const DARKEN = 5u;              // all but its colour
const LEAST_PASSED = 1e-7;

struct FragmentOutput {
    // virtualfield position: vec4f = varyings.position;
    @location(0) color: vec4<f32>,
};

/// Puts out a fragment's optical depth, if it lies behind those that were kept, and in alpha how far it is, weighted by that; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, position: vec4f) {
    let color = clamp((*outp).color, vec4f(0.0), vec4f(1.0));
    var passed = vec3f(1.0 - color.a);
    if (GLASS_MODE == TINT) { passed = color.rgb; }
    if (GLASS_MODE == DARKEN) { passed = 1.0 - color.rgb; }
    if (all(passed > vec3f(0.998))) { discard; }
    if (!GLASS_FIRST && position.z >= 0.99999 * textureLoad(glass_nearer, vec2i(position.xy), 0)) { discard; }
    let depths = -log(max(passed, vec3f(LEAST_PASSED)));
    (*outp).color = vec4f(depths, position.z * dot(depths, vec3f(1.0 / 3.0)));
}
