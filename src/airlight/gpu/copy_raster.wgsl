// One-tap copy of an rgba16f image by drawing, beside those of copy.wgsl.

@group(0) @binding(0) var source: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn copy(@builtin(position) place: vec4f) -> @location(0) vec4f {
    return textureLoad(source, vec2u(place.xy), 0);
}
