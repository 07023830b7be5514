// Daylight on the picture of a scene: what the air adds to each pixel, and its transmittance, over the way to what is seen there:
//
//     L = L0 T + (1 - D) L1 + Lms,   D L1 = sum over hidden stretches (a, b) of the ray of C(b) - C(a)
//
// C(t) is L1 up to t m, from the table of view rays; what is hidden from the sun is looked up in its shadow maps, step by step. Where nothing
// is hidden nothing is taken away, and the picture is that of the air alone. Fog of a medium lies before it all.
//! include "scatter/march/filters.wgsl"
//! include "scatter/daylight/view_table.wgsl"
//! include "wgsl/jitter.wgsl"
override FOGGED: bool = false;  // a medium's layer lies before the air's
override KEEPS: bool = false;   // where nothing is drawn the picture shows the sky already

struct Heaven {
    ground: vec3f,              // radiance of level ground, beyond what is drawn
    disc_radius: f32,           // radians
    disc: vec3f,                // radiance of the sun's disc above the air
    pixel: f32,                 // radians that a pixel is wide
}

@group(0) @binding(6) var noise: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> light_storage: Light; // a copy that loops may hang on
@group(0) @binding(8) var<uniform> heaven: Heaven;
@group(0) @binding(9) var hidden: texture_2d<f32>; // D L1; a texel of 0 where nothing is hidden: the same code for both, to the bit
@group(0) @binding(10) var fog_radiance: texture_2d<f32>;
@group(0) @binding(11) var fog_transmittance: texture_2d<f32>;
@group(0) @binding(12) var through: texture_storage_2d<rgba32float, write>;

const FARTHEST = 1e6;           // m, to which shadows are looked up
const GROUP = 8.0;              // steps
const LEAST_GROUPS = 2.0;       // in a cascade

/// Make the camera's ray of a pixel of the picture, to what is drawn there, however far; NO_END where nothing is.
fn air_ray(pixel: vec2u) -> Ray {
    let at = frame.rays.xy * ((vec2f(pixel) + 0.5) / vec2f(frame.pixels)) + frame.rays.zw;
    let along = normalize(vec3f((1.0 - frame.flat) * at, -1.0));
    let depth = textureLoad(depths, pixel, 0);
    let ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
    return Ray(vec3f(frame.flat * at, 0.0), select(max(ahead / -along.z, 0.0), NO_END, depth >= 1.0), along);
}

/// Integrate what sunlight is missing over a range of t, that view i of the shadow map holds. o: where in its step a sample is.
fn missing_in_view(i: u32, ray: Ray, sky: DaylightRay, seen: vec2f, o: f32) -> vec3f {
    let line = project_ray(i, ray, seen, 0.0);
    let range = line.range;
    if (range.y <= range.x) { return vec3f(0.0); }
    let groups = max(floor(f32(light_storage.steps) / (GROUP * f32(light_storage.views))), LEAST_GROUPS);
    let each = (range.y - range.x) / (GROUP * groups);
    let last = last_stretch(i, ray, 1.0);
    var before = daylight_single(sky, range.x);
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        // Count the steps of a group that are hidden: within it C is as good as straight
        var dark = 0.0;
        var step = 0.0;
        loop {
            let at = line.b.xyz + min(range.x + (k * GROUP + step + o) * each, last) * line.a.xyz;
            dark += 1.0 - visibility(i, at.xy, at.z, o);
            step += 1.0;
            continuing { break if step >= GROUP; }
        }
        k += 1.0;
        let now = daylight_single(sky, range.x + k * GROUP * each);
        sum += dark / GROUP * (now - before);
        before = now;
        continuing { break if k >= groups; }
    }
    return sum;
}

/// Look up what sunlight is missing on the ray of a pixel of what is computed, D L1; in alpha the ray's length, the guide of its upsampling.
@compute @workgroup_size(8, 8)
fn look_up(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let whole = air_ray(sampled_pixel(id.xy));
    let ray = Ray(whole.origin, min(whole.reach, FARTHEST), whole.direction);
    let sky = daylight_ray(ray.direction);
    let o = offset(id.xy);
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_storage.views; i++) {
        let ahead = max(-ray.direction.z, 1e-6);
        let view = light.view[i];
        let seen = clamp((vec2f(view.near, view.far) + ray.origin.z) / ahead, vec2f(0.0), vec2f(ray.reach));
        sum += missing_in_view(i, ray, sky, seen, o);
    }
    textureStore(layer, id.xy, vec4f(max(sum, vec3f(0.0)), min(ray.reach, frame.max_distance)));
}

/// Write the layer of a pixel: radiance that is added, and the transmittance; 0 where nothing is drawn, and the sky replaces the picture.
@compute @workgroup_size(8, 8)
fn add_air(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    let ray = air_ray(id.xy);
    let sky = daylight_ray(ray.direction);
    let is_sky = ray.reach >= NO_END;
    let t = select(ray.reach, sky.ground, is_sky);
    let missing = textureLoad(hidden, min(id.xy, textureDimensions(hidden) - 1u), 0).rgb;
    var radiance = max(daylight_single(sky, t) - missing, vec3f(0.0)) + daylight_multiple(sky, t);
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
        let fog = textureLoad(fog_transmittance, id.xy, 0).rgb;
        radiance = textureLoad(fog_radiance, id.xy, 0).rgb + fog * radiance;
        left *= fog;
    }
    textureStore(layer, id.xy, vec4f(radiance, min(ray.reach, 1e10)));
    textureStore(through, id.xy, vec4f(left, 1.0));
}
