// Luminances of every STEP-th pixel of the layer, which the host measures.
//! include "wgsl/luminance.wgsl"
override STEP: u32 = 1u;

@group(0) @binding(0) var layer: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> luminances: array<f32>;

/// Stores the luminance of a pixel.
@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3u) {
    let count = (textureDimensions(layer) + STEP - 1u) / STEP;
    if (all(id.xy < count)) {
        luminances[id.y * count.x + id.x] = luminance(textureLoad(layer, id.xy * STEP, 0).rgb);
    }
}
