// Bindings of a march, the camera's rays through its medium, and what is scattered into them from a point.
//! include "scatter/march/scene.wgsl"
//! include "medium/phase.wgsl"
//! include "medium/transmittance.wgsl"
//! include "lights/irradiance.wgsl"
override FIRST: bool = true;    // the first light's pass begins with the ambient term, the others with what came before

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> light: Light;
@group(0) @binding(2) var depths: texture_depth_2d;
@group(0) @binding(3) var shadow: texture_depth_2d_array;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var layer: texture_storage_2d<rgba32float, write>;

struct Ray {
    origin: vec3f,              // view space
    reach: f32,                 // m to the first surface, or to where the medium ends
    direction: vec3f,           // unit; -z: metres along the camera's axis a metre of the ray
}

/// Find the pixel of the picture at whose centre a pixel of what is computed is sampled. Twin: reference/march.py:sampled_pixel.
fn sampled_pixel(p: vec2u) -> vec2u {
    return min((2u * p + 1u) * frame.pixels / (2u * frame.size), frame.pixels - 1u);
}

/// Make the camera's ray of a pixel of what is computed.
fn camera_ray(p: vec2u) -> Ray {
    return camera_ray_at(sampled_pixel(p));
}

/// Make the camera's ray of a pixel of the picture.
fn camera_ray_at(pixel: vec2u) -> Ray {
    let at = frame.rays.xy * ((vec2f(pixel) + 0.5) / vec2f(frame.pixels)) + frame.rays.zw;
    let along = normalize(vec3f((1.0 - frame.flat) * at, -1.0));
    let depth = textureLoad(depths, pixel, 0);
    let ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
    let reach = select(clamp(ahead / -along.z, 0.0, frame.max_distance), frame.max_distance, depth >= 1.0);
    return Ray(vec3f(frame.flat * at, 0.0), reach, along);
}

/// Evaluate what a directional light scatters into the ray along a metre of it, without extinction.
/// Twin: reference/march.py:in_scatter_directional.
fn in_scatter_directional(ray: Ray) -> vec3f {
    return frame.sigma_s * light.intensity * phase_between(ray.direction, light.position, light.lobes);
}

/// Evaluate what a light scatters into the ray from a point at t, along a metre of it, times d^2: d metres from the light, `cosine` as of
/// the phase function, `axis_cosine` to a spot's axis. Twin: reference/march.py:in_scatter_punctual.
fn in_scatter_punctual(t: f32, d: f32, cosine: f32, axis_cosine: f32) -> vec3f {
    let cone = cone_ramp(axis_cosine, light.cone_scale, light.cone_offset);
    let strength = phase(cosine, light.lobes) * cone * cone * range_window(d, light.range);
    return frame.sigma_s * light.intensity * strength * exp(-frame.sigma_t * (t + d));
}

/// Begin a pixel's radiance: with ambient light, or with what the lights before gave.
fn ambient_or_previous(p: vec2u, ray: Ray) -> vec3f {
    if (FIRST) { return frame.sigma_s * frame.ambient * transmittance_integral(ray.reach, frame.sigma_t); }
    return textureLoad(before, p, 0).rgb;
}
