// Ends of pygfx's own fragment shaders of what is seen through: each fragment is put into the fog at its own distance before it is blended, as
// its material says, over a picture that is fogged. Where that lets a share p of what is behind pass, radiance L and transmittance T before it,
//
//     picture = p picture + (1 - p) L + T S,    layer = p layer + (1 - p) L,
//
// S being what the material adds. Modes are numbered as in panes.py.
//! include "pygfx/pane_lookup.wgsl"
const PANE_MODE = 0u;           // one of these; private_panes.py puts it in
const PANE_SPLIT = false;       // opaque fragments are drawn elsewhere

const OVER = 0u;                // p = 1 - alpha; S is multiplied by alpha by the blending
const PREMULTIPLIED = 1u;       // p = 1 - alpha
const ADDED = 2u;               // p = 1
const TINT = 3u;                // p is the fragment's colour, of which p picture is made here, and the rest by VEIL
const VEIL = 4u;
const DARKEN = 5u;              // p is 1 - the fragment's colour, as TINT
const DARK_VEIL = 6u;

struct FragmentOutput {
    // virtualfield position: vec4f = varyings.position;
    @location(0) color: vec4<f32>,
    @location(1) layer: vec4<f32>,
    @location(2) pick: vec4<u32>,
};

/// Fogs a fragment; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, position: vec4f) {
    let color = (*outp).color;
    if (PANE_SPLIT && color.a >= 0.95) { discard; }
    let air = air_before(position.xyz);
    let passed = 1.0 - pane_fog.extinction * (1.0 - transmittance(air.a, pane_fog.sigma_t));
    var share = vec3f(0.0); // of L, to be blended
    switch (PANE_MODE) {
        case OVER: { share = vec3f(1.0); }
        case PREMULTIPLIED: { share = vec3f(color.a); }
        case VEIL: { share = 1.0 - color.rgb; }
        case DARK_VEIL: { share = color.rgb; }
        default: {}
    }
    let source = select(passed * color.rgb, color.rgb, PANE_MODE == TINT || PANE_MODE == DARKEN);
    let own = select(source, vec3f(0.0), PANE_MODE == VEIL || PANE_MODE == DARK_VEIL);
    let kept = select(vec3f(0.0), color.rgb, PANE_MODE == TINT || PANE_MODE == DARKEN);
    (*outp).color = vec4f(own + pane_fog.mix * share * air.rgb, color.a);
    (*outp).layer = vec4f(kept + share * air.rgb, color.a);
}
