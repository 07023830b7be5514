// The air of daylight along rays of the camera, and what is left of the sun's light on its way to a place in it: past fog, volumes,
// particles and noise, as a table of the sun holds it, and past what is seen through, as a map beside its shadow map holds it.
//
//     L = L0 T + (1 - D) L1 + Lms,   D L1 = int (1 - V left) dC
//
// C(t) is L1 up to t m, from the table of view rays; V is what the shadow maps let through. The fog's part, int (1 - fog) dC, is summed by
// itself over the whole ray, the rest, int (fog - V left) dC, where maps and tables hold the ray. Where nothing hides the sun both are 0.
//! include "scatter/march/shade.wgsl"
//! include "scatter/march/glass.wgsl"
//! include "scatter/march/ranges.wgsl"
//! include "scatter/march/air_ray.wgsl"
@group(0) @binding(7) var<storage, read> light_storage: Light; // a copy that loops may hang on

const FARTHEST = 1e6;           // m, to which shadows are looked up
const FOG_DEEPEST = 8.0;        // depths of fog, above which it takes next to nothing
const FOG_PIECES = 8.0;         // of a ray in fog, between which C is read
const FOG_SAMPLES = 4.0;        // of a piece
const FOG_NEAR = 30.0;          // m from the eye, within which pieces are equally long; farther away they grow

/// Find the range of t of a ray that view i of the sun's shadow map holds; all of it where there is no map.
/// Twin: reference/march_air.py:range_of_view.
fn range_of_view(i: u32, ray: Ray) -> vec2f {
    let ahead = max(-ray.direction.z, 1e-6);
    let view = light.view[i];
    let seen = clamp((vec2f(view.near, view.far) + ray.origin.z) / ahead, vec2f(0.0), vec2f(ray.reach));
    return select(seen, vec2f(0.0, ray.reach), light_storage.views == 0u);
}

/// Evaluate what the fog above a place of a ray leaves of the sun's light. Twin: reference/march_air.py:left_by_fog.
fn left_by_fog(ray: Ray, t: f32) -> vec3f {
    let fog = frame.air * height_column(height(place_at(ray, t)), layer_of_fog());
    return transmittance(fog / max(light.climb, 1e-6), frame.sigma_t);
}

/// Look up what is left of the sun's light at t of a ray, past all but walls: `position` and `depth` there in view i of its map.
fn sunlight_left(i: u32, ray: Ray, t: f32, position: vec2f, depth: f32) -> vec3f {
    var left = vec3f(1.0);
    if (GLASS) { left = light_left(i, position, depth); }
    if (TABLE || FADES) { left *= transmittance(light_length(ray, t), frame.sigma_t); }
    return left;
}

/// Integrate what the fog takes of the sun's light over a ray: pieces of it that grow with the distance, in each of which C is as good as straight.
fn missing_in_fog(ray: Ray, sky: DaylightRay) -> vec3f {
    let most = clip_range(vec2f(0.0, ray.reach), FOG_DEEPEST * frame.fog_depth - height(ray.origin), -dot(frame.up, ray.direction));
    let grown = log(1.0 + max(most.y - most.x, 0.0) / FOG_NEAR) / FOG_PIECES;
    var t = most.x;
    var before = daylight_single(sky, t);
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        let end = most.x + FOG_NEAR * (exp((k + 1.0) * grown) - 1.0);
        var taken = vec3f(0.0);
        var step = 0.5;
        loop {
            taken += 1.0 - left_by_fog(ray, t + (end - t) * step / FOG_SAMPLES);
            step += 1.0;
            continuing { break if step >= FOG_SAMPLES; }
        }
        let now = daylight_single(sky, end);
        sum += taken / FOG_SAMPLES * (now - before);
        before = now;
        t = end;
        k += 1.0;
        continuing { break if k >= FOG_PIECES; }
    }
    return sum;
}
