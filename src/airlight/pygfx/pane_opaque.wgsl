// Ends of pygfx's own fragment shaders of what is blended, where its opaque fragments alone are drawn, as what is solid.
struct FragmentOutput {
    // virtualfield none: bool = false;
    @location(0) color: vec4<f32>,
    @location(1) pick: vec4<u32>,
};

/// Discards fragments of an alpha below 0.95, what filters leave of 1; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, none: bool) {
    if ((*outp).color.a < 0.95) { discard; }
    (*outp).color.a = 1.0;
}
