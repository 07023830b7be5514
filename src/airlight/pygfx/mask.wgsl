// The source of a scene's shafts from its own picture and depth, at the resolution of the shafts: S = I m (13.5.2), or with contrast
// (13.5.3) what does not emit too, flattened. Twin: source in reference/scene.py.
//! include "gpu/half.wgsl"
//! include "pygfx/view.wgsl"
override TAPS: u32 = 2u;        // samples a side of a texel: the pixels under it
override CONTRAST: bool = false;

@group(0) @binding(3) var source: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var<storage, read> looked: array<f32>; // look.wgsl

fn tap(texel: vec2i, k: u32, light: vec4f, length: f32) -> vec3f {
    let inner = (vec2f(vec2u(k % TAPS, k / TAPS)) + 0.5) / f32(TAPS);
    let p = min(vec2i((vec2f(texel) + inner) * view.pixels / view.texels), vec2i(view.pixels) - 1);
    let pixel = seen(p, light, length);
    var color = pixel.rgb * pixel.a;
    if (CONTRAST) {
        color += (1.0 - pixel.a) * mix(vec3f(looked[0], looked[1], looked[2]), pixel.rgb, KEPT);
    }
    return color;
}

fn texel(q: vec2i) -> vec3f {
    var light = vec4f(0.0);
    var length = 1.0;
    if (CONES) {
        let ray = view_ray((vec2f(q) + 0.5) / view.texels);
        length = sqrt(dot(ray, ray));
        light = lights_at(ray, 1.0 / length);
    }
    if (TAPS == 1u) { return tap(q, 0u, light, length); }
    if (TAPS == 2u) {
        return 0.25 * (tap(q, 0u, light, length) + tap(q, 1u, light, length) + tap(q, 2u, light, length) + tap(q, 3u, light, length));
    }
    var sum = vec3f(0.0);
    for (var k = 0u; k < TAPS * TAPS; k++) {
        sum += tap(q, k, light, length);
    }
    return sum / f32(TAPS * TAPS);
}

@compute @workgroup_size(64)
fn mask(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(view.texels);
    for (var i = 0u; i < 8u; i++) {
        let place = vec2u(id.x, id.y * 8u + i);
        let q = vec2i(place) - view.apron;
        var color = vec3f(0.0);
        if (all(q >= vec2i(0)) && all(q < size)) {
            color = texel(q);
            // one bad pixel of the scene must not spoil the sums
            color = select(vec3f(0.0), color, (bitcast<vec3u>(color) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
        }
        textureStore(source, place, vec4f(nearest_half(color), 1.0));
    }
}
