// Sunlight that is missing in the air, in steps: each is dark or lit as the shadow map says at one jittered sample in it. Over a view's range of
// the ray C is taken to grow as in even air, by amounts that fall by one factor from step to step; it is read at both ends and in the middle.
//! include "scatter/march/air.wgsl"
//! include "scatter/march/filters.wgsl"
//! include "wgsl/jitter.wgsl"

@group(0) @binding(6) var noise: texture_2d<f32>;

const LEAST_STEPS = 16.0;       // in a cascade
const MOST_CHANGE = 16.0;       // of what a metre adds, from the middle of a range to its end

/// Sum the powers 0 to n - 1 of e^x. Twin: reference/march_air.py:sum_of_exponentials.
fn sum_of_exponentials(x: vec3f, n: f32) -> vec3f {
    let few = n * (1.0 + 0.5 * (n - 1.0) * x);
    let safe = select(x, vec3f(1.0), abs(n * x) < vec3f(1e-2));
    return select((exp(n * safe) - 1.0) / (exp(safe) - 1.0), few, abs(n * x) < vec3f(1e-2));
}

/// Evaluate the logarithm of the factor by which what n steps add changes from one to the next, from what the first and the second half of
/// them add. Twin: reference/march_air.py:change_of_steps.
fn change_of_steps(first: vec3f, second: vec3f, n: f32) -> vec3f {
    let little = 1e-3 * abs(first + second) + 1e-30; // which the table's digits do not tell
    let change = clamp((max(second, vec3f(0.0)) + little) / (max(first, vec3f(0.0)) + little), vec3f(1.0 / MOST_CHANGE), vec3f(MOST_CHANGE));
    return log(change) * 2.0 / n;
}

/// Integrate what sunlight is missing over the range of t that view i of the shadow map, or the table of what dims it, holds. o: where in its
/// step a sample is.
fn missing_in_view(i: u32, ray: Ray, sky: DaylightRay, o: f32) -> vec3f {
    let seen = range_of_view(i, ray);
    let line = project_ray(i, ray, seen, 0.0);
    var range = line.range;
    if (TABLE) {
        let dimmed = clamp(shaded, seen.xx, seen.yy);
        let both = select(vec2f(min(range.x, dimmed.x), max(range.y, dimmed.y)), dimmed, range.y <= range.x);
        range = select(range, both, dimmed.y > dimmed.x);
    }
    range = clamp(range, seen.xx, seen.yy);
    range.y = max(range.x, range.y);
    let n = max(floor(f32(light_storage.steps) / max(f32(light_storage.views), 1.0)), LEAST_STEPS);
    let each = (range.y - range.x) / n;
    let last = last_stretch(i, ray, 1.0);
    // Find what the first step adds, and how that changes from step to step
    let begin = daylight_single(sky, range.x);
    let middle = daylight_single(sky, 0.5 * (range.x + range.y));
    let end = daylight_single(sky, range.y);
    let change = change_of_steps(middle - begin, end - middle, n);
    let factor = exp(change);
    var weight = (end - begin) / sum_of_exponentials(change, n);
    var sum = vec3f(0.0);
    var k = 0.0;
    loop {
        // Add what is missing of a step
        let t = min(range.x + (k + o) * each, last);
        let at = line.b.xyz + t * line.a.xyz;
        let share = visibility(i, at.xy, at.z, o);
        if (GLASS || TABLE || FADES) {
            var most = vec3f(1.0);
            if (FADES) { most = left_by_fog(ray, t); }
            sum += (most - share * sunlight_left(i, ray, t, at.xy, at.z)) * weight;
        } else {
            sum += (1.0 - share) * weight;
        }
        weight *= factor;
        k += 1.0;
        continuing { break if k >= n; }
    }
    return sum;
}

/// Look up what sunlight is missing on the ray of a pixel of what is computed, D L1; in alpha the ray's length, the guide of its upsampling.
@compute @workgroup_size(8, 8)
fn look_up(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let whole = air_ray(sampled_pixel(id.xy));
    let sky = daylight_ray(whole.direction);
    let seen = select(whole.reach, sky.ground, whole.reach >= NO_END);
    let ray = Ray(whole.origin, min(seen, FARTHEST), whole.direction);
    let o = offset(id.xy);
    var sum = vec3f(0.0);
    if (TABLE) { enter_shade(ray); }
    if (FADES) { sum += missing_in_fog(ray, sky); }
    for (var i = 0u; i < max(light_storage.views, u32(TABLE)); i++) { sum += missing_in_view(i, ray, sky, o); }
    textureStore(layer, id.xy, vec4f(max(sum, vec3f(0.0)), min(whole.reach, frame.max_distance)));
}
