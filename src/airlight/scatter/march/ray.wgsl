// A pixel's ray, and what a march binds. Twins: reference/medium.py.
//! include "scatter/march/scene.wgsl"
override FIRST: bool = true;    // the first light's pass begins with the ambient term, the others with what came before

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> light: Light;
@group(0) @binding(2) var depths: texture_depth_2d;
@group(0) @binding(3) var shadow: texture_depth_2d_array;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var layer: texture_storage_2d<rgba32float, write>;

struct Ray {
    origin: vec3f,              // view space
    reach: f32,                 // T: metres to the first surface, or to where the medium ends
    direction: vec3f,           // unit; -z: metres along the camera's axis a metre of the ray
}

/// The pixel of the picture whose centre a pixel of what is computed is taken at.
fn pixel_of(p: vec2u) -> vec2u {
    return min((2u * p + 1u) * frame.pixels / (2u * frame.size), frame.pixels - 1u);
}

fn ray_at(p: vec2u) -> Ray {
    return ray_at_pixel(pixel_of(p));
}

fn ray_at_pixel(pixel: vec2u) -> Ray {
    let at = frame.rays.xy * ((vec2f(pixel) + 0.5) / vec2f(frame.pixels)) + frame.rays.zw;
    let along = normalize(vec3f((1.0 - frame.flat) * at, -1.0));
    let depth = textureLoad(depths, pixel, 0);
    let ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
    let reach = select(clamp(ahead / -along.z, 0.0, frame.max_distance), frame.max_distance, depth >= 1.0);
    return Ray(vec3f(frame.flat * at, 0.0), reach, along);
}

/// (1 - e^-x) / x
fn mean_transmittance(x: vec3f) -> vec3f {
    let series = 1.0 - x * (0.5 - x * (0.16666667 - x * (0.041666667 - x * 0.0083333333)));
    return select((1.0 - exp(-x)) / max(x, vec3f(1e-20)), series, x < vec3f(0.25));
}

/// Transmittance over t metres of the ray, e^(-sigma_t t) (Beer-Lambert). Twin: transmittance.
fn transmittance(t: f32) -> vec3f {
    return select(exp(-frame.sigma_t * t), vec3f(1.0), frame.sigma_t == vec3f(0.0));
}

/// Integral of e^(-sigma_t t) from 0 to t, metres.
fn until(t: f32) -> vec3f {
    return t * mean_transmittance(frame.sigma_t * t);
}

/// A sun's in-scattered radiance where it shines on a metre of the ray, without extinction.
fn sunlight(ray: Ray) -> vec3f {
    return frame.sigma_s * light.intensity * phase_between(ray.direction, light.place, light.lobes);
}

/// What a lamp scatters into the ray from a point at t, a metre of it, times d^2: d metres from the lamp, `cosine` where one looks into its
/// light, `aside` the cosine to a spot's axis.
fn lamplight(t: f32, d: f32, cosine: f32, aside: f32) -> vec3f {
    let cone = clamp(aside * light.cone_scale + light.cone_offset, 0.0, 1.0);
    let q = d / light.range;
    let window = select(1.0, max(1.0 - q * q * q * q, 0.0), light.range > 0.0);
    let strength = phase(cosine, light.lobes) * cone * cone * window;
    return frame.sigma_s * light.intensity * strength * exp(-frame.sigma_t * (t + d));
}

/// What the layer of a pixel begins with: ambient light, or what the lights before gave.
fn begun(p: vec2u, ray: Ray) -> vec3f {
    if (FIRST) { return frame.sigma_s * frame.ambient * until(ray.reach); }
    return textureLoad(before, p, 0).rgb;
}
