// Daylight on the picture of a scene: what the air adds to each pixel, and its transmittance, over the way to what is seen there:
//
//     L = L0 T + (1 - D) L1 + Lms
//
// Fog of a medium lies before it all.
//! include "scatter/march/air_ray.wgsl"
//! include "scatter/march/upsampling.wgsl"
//! include "scatter/march/unmarked.wgsl"
override FOGGED: bool = false;  // a medium's layer lies before the air's
override KEEPS: bool = false;   // where nothing is drawn the picture shows the sky already

struct Heaven {
    ground: vec3f,              // radiance of level ground, beyond what is drawn
    disc_radius: f32,           // radians
    disc: vec3f,                // radiance of the sun's disc above the air
    pixel: f32,                 // radians that a pixel is wide
}

@group(0) @binding(6) var<uniform> heaven: Heaven;
@group(0) @binding(7) var fog_radiance: texture_2d<f32>;
@group(0) @binding(8) var fog_transmittance: texture_2d<f32>;
@group(0) @binding(9) var through: texture_storage_2d<rgba32float, write>;

/// Write the layer of a pixel: radiance that is added, and the transmittance; 0 where nothing is drawn, and the sky replaces the picture. missing:
/// D L1; 0 where nothing is hidden: the same code for both, to the bit.
fn put_air(pixel: vec2u, missing: vec3f) {
    let ray = air_ray(pixel);
    let sky = daylight_ray(ray.direction);
    let is_sky = ray.reach >= NO_END;
    let t = select(ray.reach, sky.ground, is_sky);
    var radiance = max(daylight_whole(sky, t) - missing, vec3f(0.0));
    var left = daylight_transmittance(sky, t);
    if (is_sky) {
        // Behind the air are the sun's disc, or the ground
        let off = ray.direction - daylight.to_sun;
        let away = sqrt(dot(off, off)); // radians, where it matters
        let disc = heaven.disc * clamp((heaven.disc_radius - away) / heaven.pixel + 0.5, 0.0, 1.0);
        let behind = select(disc, heaven.ground, sky.ground < NO_END);
        radiance = select(radiance + left * behind, vec3f(0.0), KEEPS);
        left = vec3f(f32(KEEPS));
    }
    if (FOGGED) {
        let fog = textureLoad(fog_transmittance, pixel, 0).rgb;
        radiance = textureLoad(fog_radiance, pixel, 0).rgb + fog * radiance;
        left *= fog;
    }
    textureStore(layer, pixel, vec4f(radiance, min(ray.reach, 1e10)));
    textureStore(through, pixel, vec4f(left, 1.0));
}

/// Put the air before a pixel of the picture, where D L1 is known; of one texel if nothing is hidden.
@compute @workgroup_size(8, 8)
fn add_air(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    put_air(id.xy, textureLoad(before, min(id.xy, textureDimensions(before) - 1u), 0).rgb);
}

/// Put the air before a pixel for which D L1 was upsampled.
fn put_upsampled(pixel: vec2u, ray: Ray, own: f32, color: vec4f) {
    put_air(pixel, color.rgb);
}

/// Put the air before the pixels between four at which D L1 is known.
@compute @workgroup_size(8, 8)
fn add_air_between(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy > frame.size)) { return; }
    upsample_between(id.xy);
}
