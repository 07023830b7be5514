// The picture with its shafts, linear. Twin: reference/scene.py:gathered. Twin: reference/scene.py:through.
//! include "pygfx/view.wgsl"
override CONTRAST: bool = false;
override GATHER: bool = false;  // shafts gather with the distance
override LIT: bool = false;     // there is a light
override WORLD: bool = false;   // a medium is lit
override EXTINCTION: bool = false; // the medium attenuates what is behind it, by its layer's transmittance

@group(0) @binding(3) var layer: texture_2d<f32>;
@group(0) @binding(4) var linear: sampler;
@group(0) @binding(5) var<storage, read> looked: array<f32>; // look.wgsl
@group(0) @binding(6) var aside: texture_2d<f32>; // of a medium: in-scattered radiance
@group(0) @binding(8) var transmittance: texture_2d<f32>; // of the same layer

/// Reads what of a surface's radiance the medium before it lets through.
fn transmitted(p: vec2i) -> vec3f {
    if (!EXTINCTION) { return vec3f(1.0); }
    return textureLoad(transmittance, p, 0).rgb;
}

/// Finds (fog's colour, its cover): aerial perspective in the light's colour, the denser the more the light is faced.
/// Twin: reference/scene.py:fog.
fn fog(ray: vec3f, inverse: f32, distance: f32) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < 8u; i++) {
        let aim = view.aim[i];
        let toward = max(dot(ray, aim.direction) * inverse, 0.0);
        let squared = toward * toward;
        let fourth = squared * squared;
        sum += aim.fade * fourth * fourth * vec4f(aim.color, 1.0);
    }
    let cover = min(sum.a, 1.0) * (1.0 - exp(-distance / looked[4]));
    return vec4f(sum.rgb / max(sum.a, 1e-6) * looked[3], cover);
}

/// Composites a pixel: its RGB with shafts, and 1 where that differs from the picture.
fn merged(p: vec2i) -> vec4f {
    let pixel = textureLoad(scene, p, 0);
    if (WORLD) {
        let color = pixel.rgb * transmitted(p) + view.mix * textureLoad(aside, p, 0).rgb;
        return vec4f(color, f32(any(color != pixel.rgb)));
    }
    if (!LIT) { return vec4f(pixel.rgb, 0.0); }
    let uv = (vec2f(p) + 0.5) * view.pixel;
    var added = textureSampleLevel(layer, linear, view.region.xy + view.region.zw * uv, 0.0).rgb * view.mix;
    var color = pixel.rgb;
    if (GATHER || CONTRAST) {
        let depth = textureLoad(depths, p, 0);
        if (depth < 1.0) {
            let ray = view_ray(uv);
            let length = sqrt(dot(ray, ray));
            let distance = axial(depth) * length;
            if (GATHER) { added *= 1.0 - exp(-distance / view.reach); }
            if (CONTRAST) {
                let haze = fog(ray, 1.0 / length, distance);
                color = mix(color, haze.rgb, haze.a);
            }
        }
    }
    return vec4f(color + added, f32(any(color + added != pixel.rgb)));
}
