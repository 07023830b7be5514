// The picture of a rendered scene with a layer on it, linear. Shafts of a screen method are added; a medium also attenuates what is behind.
//! include "composite/scene_uniforms.wgsl"
//! include "composite/medium.wgsl"
override CONTRAST: bool = false; // fog in the light's colour (13.5.3)
override GATHER: bool = false;  // shafts gather with the distance
override LIT: bool = false;     // there is a light
override MEDIUM: bool = false;  // the layer is a medium's
override DONE: bool = false;    // the picture holds the layer already
override EXTINCTION: bool = false; // the medium attenuates what is behind it, by its layer's transmittance

@group(0) @binding(3) var layer: texture_2d<f32>; // of a screen method
@group(0) @binding(4) var linear: sampler;
@group(0) @binding(5) var<storage, read> looked: array<f32>; // pygfx/look.wgsl
@group(0) @binding(6) var aside: texture_2d<f32>; // in-scattered radiance of a medium's layer
@group(0) @binding(8) var transmittance: texture_2d<f32>; // of a medium's layer

/// Reads what of a surface's radiance is seen through the medium before it.
fn transmitted(p: vec2i) -> vec3f {
    if (!EXTINCTION) { return vec3f(1.0); }
    return share_of_dimming(textureLoad(transmittance, p, 0).rgb, view.extinction_share);
}

/// Make (the fog's colour, its cover): aerial perspective in the light's colour, the denser the more the light is faced.
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

/// Composite a pixel with the layer: RGB, and whether that differs from the picture.
fn composited(p: vec2i) -> vec4f {
    let pixel = textureLoad(scene, p, 0);
    if (DONE) { return vec4f(pixel.rgb, 0.0); }
    if (MEDIUM) {
        let color = through_medium(pixel.rgb, transmitted(p), textureLoad(aside, p, 0).rgb, view.mix);
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
