// What fragments of pygfx's own shaders come to where only their depth is kept.
struct FragmentOutput {
    @location(0) color: vec4<f32>,
};
