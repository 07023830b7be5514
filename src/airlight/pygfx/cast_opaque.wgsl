// Ends of pygfx's own fragment shaders where only their depth is kept, and that of what is opaque alone.
struct FragmentOutput {
    // virtualfield none: bool = false;
    @location(0) color: vec4<f32>,
};

/// Discards fragments of an alpha below 0.95, what filters leave of 1, so that they cast no shadow; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, none: bool) {
    if ((*outp).color.a < 0.95) { discard; }
}
