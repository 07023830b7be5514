// Bindings of a march, the camera's rays through its medium, and what is scattered into them from a point.
//! include "scatter/march/scene.wgsl"
//! include "medium/phase.wgsl"
//! include "medium/height.wgsl"
//! include "lights/irradiance.wgsl"
override FALLS: bool = false;   // the light falls otherwise than as 1 / d^2
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

/// Find the length of the ray of a pixel of what is computed, from what was marched there: in alpha, but where density varies.
fn marched_length(p: vec2i, found: vec4f) -> f32 {
    if (!VARIES) { return found.a; }
    return camera_ray(vec2u(p)).reach;
}

/// Evaluate what a directional light scatters into the ray along a metre of it, without extinction.
/// Twin: reference/march.py:in_scatter_directional.
fn in_scatter_directional(ray: Ray) -> vec3f {
    let glow = frame.sun_glow * glow_between(ray.direction, light.position, frame.glow_concentration);
    let spread = (1.0 - frame.sun_glow) * phase_between(ray.direction, light.position, light.lobes);
    return frame.sigma_s * light.intensity * (spread + glow);
}

/// Measure a place's height above the fog's base, m. Twin: reference/march.py:height.
fn height(place: vec3f) -> f32 {
    return frame.base_height + dot(frame.up, place);
}

/// Read the fog's depth and what is above it. Twin: reference/march.py:layer_of_fog.
fn layer_of_fog() -> vec2f {
    return vec2f(frame.fog_depth, frame.fog_above);
}

/// Integrate density along a ray up to t, by height alone: the length, m, of a path of density 1 through as much. Twin: reference/march.py:optical_length.
fn optical_length(ray: Ray, t: f32) -> f32 {
    let whole = select(t, frame.air * t, VARIES);
    if (FOG == EVEN) { return whole; }
    return whole * mean_height_density(height(ray.origin), height(ray.origin + t * ray.direction), layer_of_fog());
}

/// Integrate density times transmittance over a lit range of t, from a directional light to the eye: m. Exact where the density is that of
/// exponential fog, or of a ramp to nothing; else see integrate_directional. Twin: reference/march.py:directional_integral.
fn directional_integral(ray: Ray, range: vec2f) -> vec3f {
    let fog = layer_of_fog();
    let first = height(ray.origin + range.x * ray.direction);
    let last = height(ray.origin + range.y * ray.direction);
    let along = (range.y - range.x) * mean_height_density(first, last, fog);
    let before = optical_length(ray, range.x);
    var ends = vec2f(before, before + along);
    if (FADES) { ends += vec2f(height_column(first, fog), height_column(last, fog)) / max(light.climb, 1e-6); }
    let near = min(ends.x, ends.y);
    return along * transmittance(near, frame.sigma_t) * mean_transmittance(frame.sigma_t * (max(ends.x, ends.y) - near));
}

/// Average e^-x over x between two values that are `apart`, from it at both. Twin: reference/march_field.py:mean_between.
fn mean_between(first: vec3f, second: vec3f, apart: vec3f) -> vec3f {
    let few = max(first, second) * (1.0 - apart * (0.5 - apart * (0.16666667 - apart * 0.041666667)));
    return select(abs(first - second) / max(apart, vec3f(1e-20)), few, apart < vec3f(0.1));
}

/// Average density by height between two heights at which it is known. Twin: reference/march_field.py:mean_between_heights.
fn mean_between_heights(a: f32, b: f32, densest: f32) -> f32 {
    let fog = layer_of_fog();
    if (FOG == LINEAR) { return mean_height_density(a, b, fog); }
    let low = min(a, b);
    let high = max(a, b);
    let below = clamp(-low / max(high - low, 1e-30), 0.0, 1.0);
    let thinned = densest * mean_transmittance(vec3f((max(high, 0.0) - max(low, 0.0)) / fog.x)).x;
    return below + (1.0 - below) * thinned;
}

/// Clip a range of t to the k-th band of heights; empty where its end is not behind its start. Twin: reference/march.py:clip_to_band.
fn clip_to_band(ray: Ray, range: vec2f, k: u32) -> vec2f {
    let band = height_band(k, layer_of_fog());
    let from_base = height(ray.origin);
    let climb = dot(frame.up, ray.direction);
    return clip_range(clip_range(range, from_base - band.x, climb), band.y - from_base, -climb);
}

/// Clip a range of t to where b + t a >= 0; empty where its end is before its start. Twin: reference/march.py:clip_range.
fn clip_range(range: vec2f, b: f32, a: f32) -> vec2f {
    let at = -b / select(a, 1.0, a == 0.0);
    let within = select(vec2f(range.x, min(range.y, at)), vec2f(max(range.x, at), range.y), a > 0.0);
    return select(within, select(range, vec2f(range.x, range.x - 1.0), b < 0.0), a == 0.0);
}

/// Evaluate the share of a light's intensity that reaches a point d metres from it and is scattered to the eye there, 1/sr, times d^2, without
/// extinction: `cosine` as of the phase function, `axis_cosine` to a spot's axis. Twin: reference/march.py:scattered_share.
fn scattered_share(d: f32, cosine: f32, axis_cosine: f32) -> f32 {
    var strength = phase(cosine, light.lobes) * range_window(d, light.range);
    if (CONE) {
        let cone = cone_ramp(axis_cosine, light.cone_scale, light.cone_offset);
        strength *= cone * cone;
    }
    if (FALLS) { return strength * (light.falloff.x + d * (light.falloff.y + d * light.falloff.z)); }
    return strength;
}

/// Evaluate what a light scatters into the ray from a point at t, along a metre of it, times d^2: d metres from the light, `cosine` as of
/// the phase function, `axis_cosine` to a spot's axis. Twin: reference/march.py:in_scatter_punctual.
fn in_scatter_punctual(ray: Ray, t: f32, d: f32, cosine: f32, axis_cosine: f32) -> vec3f {
    let strength = scattered_share(d, cosine, axis_cosine);
    if (FOG == EVEN) { return frame.sigma_s * light.intensity * strength * exp(-frame.sigma_t * (t + d)); }
    let y = height(ray.origin + t * ray.direction);
    let lamp = d * mean_height_density(y, height(light.position), layer_of_fog());
    let density = height_density(y, layer_of_fog());
    return frame.sigma_s * light.intensity * (strength * density) * exp(-frame.sigma_t * (optical_length(ray, t) + lamp));
}

/// Begin a pixel's radiance: with ambient light, or with what the lights before gave.
fn ambient_or_previous(p: vec2u, ray: Ray) -> vec3f {
    if (FIRST && VARIES) { return vec3f(0.0); } // see in_field
    if (FIRST) { return frame.sigma_s * frame.ambient * transmittance_integral(optical_length(ray, ray.reach), frame.sigma_t); }
    return textureLoad(before, p, 0).rgb;
}
