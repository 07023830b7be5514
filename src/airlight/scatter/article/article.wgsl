// Shadow-mapped in-scattering of the shadow-map article (unpublished, 2014), which knows no units: its lengths are metres here.
// With I(d) = s (atan((d + b) s) - atan(b s)), b = direction . q, c = q . q, s = 1 / sqrt(c - b^2), q = -(unit vector to the sun):
// `article`, as its code prints it: samples at d = 0.8 i, i = 0 ... 599, until one lies within 2.0 of the surface,
//     x = 1 + sum_i ((lit_i ? min(1, I_i) : 0) - clamp(I_(i-1), 0, 1)) / 750, I_(-1) = 0; the picture is given 0.1 (2 x^2 - 1).
//   Where all is lit the sum telescopes to 1 + min(1, I_last) / 750; each dark step takes min(1, I_i) / 750 from it.
// `prose`, as its text says it: I(T) times the shares of the lit steps, squared, in the sun's colour, with absorption and a cap.
// Deviations: maps of any size, each a layer, with depth that falls from the light; cascades and their depth range by shadows/fit.py;
// lit where no cascade holds; h = 1 / s held above 0, where the printed I divides by it.
//! include "scatter/march/ray.wgsl"
//! include "wgsl/jitter.wgsl"
override VIEWS: u32 = 0u;       // cascades; without any everything is lit
override STRICT: bool = false; // borders of maps and equal depths as the code compares them: not held, not lit

const STEPS = 600u;
const STEP = 0.8;               // m
const STOP = 2.0;               // m from the surface, nearer than which no sample lies
const DIVISOR = 750.0;          // where the article's prose has the ray's length
const EXTENT = 0.98;            // of a cascade's map, within which it is taken
const GAIN = 0.1;               // of its composite
const LEAST_SINE = 1e-3;        // of the angle between a ray and the sun's direction

struct Settings {
    absorption: vec3f,          // 1/m
    bias: f32,                  // of the map's range of depth, 0: shadow_bias
    cap: f32,                   // most light over a surface in shadow
    prose: f32,                 // 1: divide by the ray's length
    steps: f32,
    step: f32,                  // m
}

@group(0) @binding(6) var noise: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> settings: Settings;

/// Integrates 1 / d^2 along a ray of length `distance`, d the distance from a lamp that lies one unit from the eye in the sun's direction:
/// Macklin's s (atan((T + b) s) - atan(b s)) with b = -direction . towards and c = 1, as the one angle that it is. Where the ray passes
/// the lamp it has no limit: least is the least distance at which it does. Twin: reference/article.py:inscatter.
fn inscatter(direction: vec3f, towards: vec3f, distance: f32, least: f32) -> f32 {
    let away = max(length(cross(direction, towards)), least);
    return atan2(distance * away, 1.0 - distance * dot(direction, towards)) / away;
}

/// Tests whether a cascade's map holds a position of it, in texels. Twin: reference/article.py:holds.
fn holds(at: vec2f) -> bool {
    let out = abs(2.0 * at / light.side - 1.0);
    let most = max(out.x, out.y);
    return select(most <= EXTENT, most < EXTENT, STRICT);
}

/// Tests a position on a ray against the first cascade that holds it: 1 lit, 0 in shadow; by the texel around it, as if it were at its
/// centre. begin, along: the ray in the cascades, in texels and depth. Twin: reference/article.py:lit.
fn lit(t: f32, begin: array<vec3f, 4>, along: array<vec3f, 4>) -> f32 {
    if (VIEWS == 0u) { return 1.0; }
    var k = 0u;
    var at = begin[0] + t * along[0];
    //! each i of 3: if (i + 1u < VIEWS) { let on = !holds(at.xy); at = select(at, begin[i + 1u] + t * along[i + 1u], on); k += u32(on); }
    let bias = select(light.bias / light.view[k].depth_scale, settings.bias, settings.bias > 0.0);
    let texel = vec2u(clamp(at.xy, vec2f(0.0), vec2f(light.side - 1.0)));
    let depth = max(at.z, 0.0) + bias;
    let held = textureLoad(shadow, texel, k, 0);
    return select(0.0, 1.0, select(depth >= held, depth > held, STRICT) || !holds(at.xy));
}

/// Writes what the article's code adds to a picture. Twin: reference/article.py:article.
@compute @workgroup_size(8, 8)
fn article(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy;
    if (any(p >= frame.size)) { return; }
    let ray = camera_ray(p);
    var begin: array<vec3f, 4>;
    var along: array<vec3f, 4>;
    //! each k of 4: begin[k] = (light.view[k].matrix * vec4f(ray.origin, 1.0)).xyz;
    //! each k of 4: along[k] = (light.view[k].matrix * vec4f(ray.direction, 0.0)).xyz;
    var sum = 0.0;
    var last = 0.0;
    for (var i = 0u; i < STEPS; i++) {
        // Stop before the surface
        let d = STEP * f32(i);
        if (ray.reach - d < STOP) { break; }
        // Add the step's light if it is lit, and subtract that of the step before; I only rises
        var now = 1.0;
        if (last < 1.0) { now = min(1.0, inscatter(ray.direction, light.position, d, LEAST_SINE)); }
        sum += now * lit(d, begin, along) - last;
        last = now;
    }
    let x = 1.0 + sum / DIVISOR; // at the end, for f32's digits
    let shafts = select(0.0, x * x, any(light.intensity > vec3f(0.0)));
    textureStore(layer, p, vec4f(vec3f((2.0 * shafts - 1.0) * GAIN), 0.0));
}

/// Writes what the article's prose adds to a picture. Twin: reference/article.py:prose.
@compute @workgroup_size(8, 8)
fn prose(@builtin(global_invocation_id) id: vec3u) {
    let p = id.xy;
    if (any(p >= frame.size)) { return; }
    let ray = camera_ray(p);
    let step = settings.step;
    let most = min(frame.max_distance, settings.steps * step);
    let distance = min(ray.reach, most);
    let first = step * offset(p);
    let faded = exp(-step * settings.absorption);
    var share = step * exp(-first * settings.absorption);
    var begin: array<vec3f, 4>;
    var along: array<vec3f, 4>;
    //! each k of 4: begin[k] = (light.view[k].matrix * vec4f(ray.origin, 1.0)).xyz;
    //! each k of 4: along[k] = (light.view[k].matrix * vec4f(ray.direction, 0.0)).xyz;
    var sum = vec3f(0.0);
    var i = 0.0;
    if (first <= distance) {
        loop {
            sum += share * lit(first + i * step, begin, along);
            share *= faded;
            i += 1.0;
            continuing { break if i >= settings.steps || first + i * step > distance; }
        }
    }
    let part = select(sum / DIVISOR, min(sum / max(distance, 1e-6), vec3f(1.0)), settings.prose > 0.0);
    let out = part * inscatter(ray.direction, light.position, distance, max(light.disc_tangent, LEAST_SINE));
    var cap = 1.0;
    if (ray.reach < most) { cap = mix(settings.cap, 1.0, lit(distance, begin, along)); }
    let brightest = max(light.intensity.r, max(light.intensity.g, light.intensity.b));
    let shafts = min(brightest * out * out, vec3f(cap)) * light.intensity / max(brightest, 1e-20); // keeps the sun's hue
    textureStore(layer, p, vec4f((2.0 * shafts - 1.0) * GAIN, 0.0));
}
