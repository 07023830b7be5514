// The light that all lights add, RGB, and lack, at the pixels of the small copy, before anything hides it. Twin: ray_amount in
// reference/look.py.
//! include "look/rays.wgsl"
override ADD: bool = false;   // to what earlier lights gave

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var bands: texture_2d<f32>;
@group(0) @binding(2) var matte: texture_2d<f32>;
@group(0) @binding(3) var bilinear: sampler;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var field: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(field);
    if (any(id.xy >= size)) { return; }
    let at = polar((vec2f(id.xy) + 0.5) / vec2f(size) * rays.box, rays);
    let found = vec4f(textureSampleLevel(bands, bilinear, band_place(at, rays), 0.0).rgb, at.x);
    let amount = ray_amount(found, textureLoad(matte, id.xy, 0).g, rays);
    var out = vec4f(max(amount, 0.0) * rays.color, max(-amount, 0.0) * dot(rays.color, vec3f(0.2126, 0.7152, 0.0722)));
    if (ADD) { out += textureLoad(before, id.xy, 0); }
    textureStore(field, id.xy, out);
}
