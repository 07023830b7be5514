// The variant of the shadow-map article, as it was and not as light is; its lengths are its units. Twin: reference/article.py.
//! include "scatter/march/ray.wgsl"
//! include "wgsl/jitter.wgsl"
override VIEWS: u32 = 0u;       // cascades; without any everything is lit

const STEPS = 600.0;
const STEP = 0.8;               // m
const DIVISOR = 750.0;          // where the article's prose has the ray's length
const EXTENT = 0.98;            // of a cascade's map, within which it is taken
const GAIN = 0.1;               // of its composite

struct Settings {
    bias: f32,                  // of the map's range of depth, 0: shadow_bias
    absorption: f32,            // 1/m
    cap: f32,                   // most light over a surface in shadow
    prose: f32,                 // 1: divide by the ray's length
}

@group(0) @binding(6) var noise: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> settings: Settings;

/// Integral of 1 / d^2 along a ray of length T, d the distance from a lamp that lies one unit from the eye in the sun's direction L:
/// Macklin's s (atan((T + b) s) - atan(b s)) with b = -d.L and c = 1, as the one angle that it is. Where the ray passes the lamp it has
/// no limit: least, the sun's radius, is the least distance at which it does.
fn inscatter(direction: vec3f, towards: vec3f, distance: f32, least: f32) -> f32 {
    let away = max(length(cross(direction, towards)), least);
    return atan2(distance * away, 1.0 - distance * dot(direction, towards)) / away;
}

/// Whether a cascade's map holds a place of it, in texels.
fn holds(at: vec2f) -> bool {
    let out = abs(2.0 * at / light.side - 1.0);
    return max(out.x, out.y) <= EXTENT;
}

/// 1 or 0: whether a place on a ray is lit, by the first cascade that holds it; by the texel around it, as if it were at its centre.
/// begin, along: the ray in the cascades, in texels and depth.
fn lit(t: f32, begin: array<vec3f, 4>, along: array<vec3f, 4>) -> f32 {
    if (VIEWS == 0u) { return 1.0; }
    var k = 0u;
    var at = begin[0] + t * along[0];
    //! each i of 3: if (i + 1u < VIEWS) { let on = !holds(at.xy); at = select(at, begin[i + 1u] + t * along[i + 1u], on); k += u32(on); }
    let bias = select(light.bias / light.view[k].depth_scale, settings.bias, settings.bias > 0.0);
    let texel = vec2u(clamp(at.xy, vec2f(0.0), vec2f(light.side - 1.0)));
    return select(0.0, 1.0, max(at.z, 0.0) + bias >= textureLoad(shadow, texel, k, 0) || !holds(at.xy));
}

@compute @workgroup_size(8, 8)
fn article(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy;
    if (any(p >= frame.size)) { return; }
    let ray = ray_at(p);
    let most = min(frame.max_distance, STEPS * STEP);
    let distance = min(ray.reach, most);
    let first = STEP * offset(p);
    let faded = exp(-STEP * settings.absorption);
    var share = STEP * exp(-first * settings.absorption);
    var begin: array<vec3f, 4>;
    var along: array<vec3f, 4>;
    //! each k of 4: begin[k] = (light.view[k].matrix * vec4f(ray.origin, 1.0)).xyz;
    //! each k of 4: along[k] = (light.view[k].matrix * vec4f(ray.direction, 0.0)).xyz;
    var sum = 0.0;
    var i = 0.0;
    if (first <= distance) {
        loop {
            sum += share * lit(first + i * STEP, begin, along);
            share *= faded;
            i += 1.0;
            continuing { break if i >= STEPS || first + i * STEP > distance; }
        }
    }
    let part = select(sum / DIVISOR, min(sum / max(distance, 1e-6), 1.0), settings.prose > 0.0);
    let out = part * inscatter(ray.direction, light.place, distance, max(light.spread, 1e-3));
    var cap = 1.0;
    if (ray.reach < most) { cap = mix(settings.cap, 1.0, lit(distance, begin, along)); }
    let brightest = max(light.intensity.r, max(light.intensity.g, light.intensity.b));
    let shafts = min(brightest * out * out, cap) * light.intensity / max(brightest, 1e-20); // keeps the sun's hue
    textureStore(layer, p, vec4f((2.0 * shafts - 1.0) * GAIN, 0.0));
}
