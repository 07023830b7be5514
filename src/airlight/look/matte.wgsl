// What emits in the small copy, as one light sees it. Twin: matte in reference/look.py.
//! include "look/rays.wgsl"

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var small: texture_2d<f32>;
@group(0) @binding(2) var lets: texture_2d<f32>;  // r: 1 for what may emit
@group(0) @binding(3) var bilinear: sampler;
@group(0) @binding(4) var matte: texture_storage_2d<rgba16float, write>; // E g, E

@compute @workgroup_size(64)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(small);
    if (any(id.xy >= size)) { return; }
    let place = vec2f(id.xy) + 0.5;
    let p = place / length(vec2f(size));
    let d = p - rays.light;
    let distance = max(length(d), 1e-9);
    let y = dot(textureLoad(small, id.xy, 0).rgb, vec3f(0.2126, 0.7152, 0.0722));
    let e = emission(y, rays) * textureSampleLevel(lets, bilinear, place / vec2f(size), 0.0).r;
    textureStore(matte, id.xy, vec4f(e * nearness_weight(distance - entry(d / distance, rays)), e, 0.0, 1.0));
}
