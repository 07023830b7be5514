// The source of the sum, S = I m. With contrast, what does not emit is there too, its texture drawn towards its mean (13.5.3).
// Twin: reference/radial.py:source.
//! include "wgsl/half.wgsl"
//! include "occlusion/mask.wgsl"
override FRACTION: bool = false; // write m itself, for D(phi)
override STENCIL: bool = false; // m is 0 or 1 (13.5.2)
const KEPT = 0.25;            // of the occluders' contrast; KEPT in reference/radial.py

@group(0) @binding(3) var source: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var<storage, read> mean: vec4f; // RGB of the occluders, for contrast

/// Writes a column of eight texels of the source.
@compute @workgroup_size(64)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(picture);
    for (var i = 0u; i < 8u; i++) {
        let q = vec2u(id.x, id.y * 8u + i);
        let p = vec2i(q) - knee.apron;
        var color = vec3f(0.0);
        if (all(p >= vec2i(0)) && all(p < vec2i(size))) {
            var pixel = emitter_at(p);
            if (STENCIL) { pixel.a = select(0.0, 1.0, pixel.a >= 0.5); }
            color = pixel.rgb * pixel.a;
            if (MODE == 4u) { color += (1.0 - pixel.a) * mix(mean.rgb, pixel.rgb, KEPT); }
            color = select(min(color * knee.scale, vec3f(65504.0)), vec3f(pixel.a), FRACTION);
        }
        textureStore(source, q, vec4f(nearest_half(color), 1.0));
    }
}
