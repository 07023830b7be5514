// Values that fragments of pygfx's own shaders hand to the blending, when they draw the source of the sum.
struct FragmentOutput {
    // virtualfield none: bool = false;
    @location(0) color: vec4<f32>,
};

/// Cleans a colour, since one bad fragment must not spoil the sums: no NaN or infinity, nothing below 0 or beyond a half float.
/// Twin: reference/colour.py:sound.
fn sound(color: vec4f) -> vec4f {
    let finite = (bitcast<vec4u>(color) & vec4u(0x7f800000u)) != vec4u(0x7f800000u);
    return clamp(select(vec4f(0.0), color, finite), vec4f(0.0), vec4f(65504.0, 65504.0, 65504.0, 1.0));
}

/// Cleans what a fragment hands over; called by pygfx.
fn apply_virtual_fields_of_fragment_output(outp: ptr<function, FragmentOutput>, none: bool) {
    (*outp).color = sound((*outp).color);
}
