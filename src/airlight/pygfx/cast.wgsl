// Ends of pygfx's own fragment shaders where only their depth is kept.
struct FragmentOutput {
    @location(0) color: vec4<f32>,
};
