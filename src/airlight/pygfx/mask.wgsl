// The source of a scene's shafts from its own picture and depth, at the resolution of the shafts: S = I m (13.5.2), or with contrast
// (13.5.3) what does not emit too, flattened. Twin: reference/scene.py:source.
//! include "wgsl/half.wgsl"
//! include "pygfx/emission.wgsl"
override TAPS: u32 = 2u;        // samples a side of a texel: the pixels under it
override CONTRAST: bool = false;

@group(0) @binding(0) var<uniform> view: SceneUniforms;
@group(0) @binding(3) var source: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var<storage, read> looked: array<f32>; // look.wgsl
@group(0) @binding(5) var nearest: sampler;
@group(0) @binding(6) var linear: sampler;

/// Finds what a pixel adds to the source. pixel: RGB, m.
fn emitted(pixel: vec4f) -> vec3f {
    var color = pixel.rgb * pixel.a;
    if (CONTRAST) {
        color += (1.0 - pixel.a) * mix(vec3f(looked[0], looked[1], looked[2]), pixel.rgb, KEPT);
    }
    return color;
}

/// Finds the pixel at the middle of the k-th of TAPS x TAPS parts of a texel. Twin: reference/scene.py:sample_pixel.
fn sample_pixel(texel: vec2i, k: u32) -> vec2i {
    let inner = (vec2f(vec2u(k % TAPS, k / TAPS)) + 0.5) / f32(TAPS);
    return min(vec2i((vec2f(texel) + inner) * view.ratio), vec2i(view.pixels) - 1);
}

/// Averages two by two pixels. Their depths are read at once; so are their colours where all are alike.
fn mean_of_four(p: vec2i, light: vec4f) -> vec3f {
    let depth = textureGather(depths, nearest, (vec2f(p) + 1.0) * view.pixel).wzxy;
    let m = vec4f(emits(depth.x, light), emits(depth.y, light), emits(depth.z, light), emits(depth.w, light));
    let alike = all(m == m.xxxx) && all((depth >= vec4f(1.0)) == vec4<bool>(depth.x >= 1.0)) && light.x == 0.0;
    let count = select(4u, 1u, alike);
    var sum = vec3f(0.0);
    var k = 0u;
    loop { // drivers on CPUs skip the turns of a loop, but no branch; and a `for` takes one turn more than it needs
        let position = vec2f(p) + select(vec2f(vec2u(k & 1u, k >> 1u)) + 0.5, vec2f(1.0), alike);
        let color = textureSampleLevel(scene, linear, position * view.pixel, 0.0).rgb;
        sum += emitted(vec4f(radiance(color, depth[k] >= 1.0, light), m[k]));
        k += 1u;
        continuing {
            break if k >= count;
        }
    }
    return sum / f32(count);
}

/// Averages the pixels under a texel.
fn texel(q: vec2i) -> vec3f {
    var light = vec4f(0.0);
    if (CONES > 0u) { light = lights_at((vec2f(q) + 0.5) * view.ratio * view.pixel); }
    if (TAPS == 2u) { return mean_of_four(max(min(sample_pixel(q, 0u), vec2i(view.pixels) - 2), vec2i(0)), light); }
    var sum = vec3f(0.0);
    for (var k = 0u; k < TAPS * TAPS; k++) {
        let p = sample_pixel(q, k);
        sum += emitted(seen(p, textureLoad(depths, p, 0), light));
    }
    return sum / f32(TAPS * TAPS);
}

/// Writes a column of eight texels of the source.
@compute @workgroup_size(64)
fn mask(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(view.texels);
    var i = 0u;
    loop {
        let position = vec2u(id.x, id.y * 8u + i);
        let q = vec2i(position) - view.apron;
        var color = vec3f(0.0);
        if (all(q >= vec2i(0)) && all(q < size)) {
            color = texel(q);
            // one bad pixel of the scene must not spoil the sums
            color = select(vec3f(0.0), color, (bitcast<vec3u>(color) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
        }
        textureStore(source, position, vec4f(nearest_half(color), 1.0));
        i += 1u;
        continuing {
            break if i >= 8u;
        }
    }
}
