// The march in steps. A ray is cut into n steps, each lit as far as the shadow map says at one jittered sample in it:
//
//     L = sum over steps of  V(sample) * integral over the step of  sigma_s p E e^(-sigma_t (t + d)) dt
//
// A directional light's steps are equally long, and the integral of each is closed. A light with a position has steps of equal angles at
// it (equiangular sampling, Kulla and Fajardo 2012), where the integrand times dt / d(angle) has no peak at the nearest approach.
// Visibility: the nearest texel; percentage-closer filtering (Reeves et al. 1987); or percentage-closer soft shadows (Fernando 2005).
//! include "scatter/march/parts.wgsl"
//! include "wgsl/jitter.wgsl"
//! include "wgsl/unit_at.wgsl"
override FILTER: u32 = 0u;      // one of these, as FILTERS of march.py
override SNAP: bool = false;    // look-ups at the centres of texels
override CASCADES: bool = false; // of a directional light, several

const NEAREST = 0u;
const PCF = 1u;
const PCSS_TAPS = 12.0;         // of a soft look-up, and of its search for occluders
const MAX_FILTER_RADIUS = 24.0; // texels
const GOLDEN_ANGLE = 2.3999632; // radians
const LEAST_STEPS = 2.0;        // of a part of a ray

@group(0) @binding(6) var noise: texture_2d<f32>;

/// Test a depth against view i's texel: 1 where that hides nothing from it; outside the map everything is lit.
fn shadow_test(i: u32, texel: vec2f, depth: f32) -> f32 {
    let within = clamp(texel, vec2f(0.0), vec2f(light.side - 1.0));
    return f32(depth >= shadow_depth(i, within) || any(within != texel));
}

/// Read the depth from which on a texel of view i is lit.
fn shadow_depth(i: u32, texel: vec2f) -> f32 {
    return biased_occluder_depth(textureLoad(shadow, vec2i(texel), i, 0), depth_bias(i));
}

/// Filter the tests of 2 x 2 texels by their nearness to a position (Reeves et al. 1987).
fn pcf(i: u32, position: vec2f, depth: f32) -> f32 {
    let base = floor(position - 0.5);
    let part = position - 0.5 - base;
    let top = mix(shadow_test(i, base, depth), shadow_test(i, base + vec2f(1.0, 0.0), depth), part.x);
    let bottom = mix(shadow_test(i, base + vec2f(0.0, 1.0), depth), shadow_test(i, base + 1.0, depth), part.x);
    return mix(top, bottom, part.y);
}

/// Place the k-th of PCSS_TAPS points on the unit disc, turned by a part of a full turn (Vogel 1979). Twin: reference/march.py:vogel_disc.
fn vogel_disc(k: f32, turn: f32) -> vec2f {
    return sqrt((k + 0.5) / PCSS_TAPS) * unit_at(GOLDEN_ANGLE * k + 2.0 * PI * turn);
}

/// Estimate the share of a directional light's disc that is seen past occluders as far away as they are on the mean (Fernando 2005).
fn pcss(i: u32, position: vec2f, depth: f32, turn: f32) -> f32 {
    // Search for occluders where the disc's cone may meet any
    let metres = light.view[i].depth_scale;
    let widest = clamp(light.disc_tangent * (1.0 - depth) * metres / light.view[i].texel, 1.0, MAX_FILTER_RADIUS);
    var hidden = vec2f(0.0); // sum of distances to occluders, their number
    for (var k = 0.0; k < PCSS_TAPS; k += 1.0) {
        let occluder = shadow_depth(i, clamp(position + widest * vogel_disc(k, turn), vec2f(0.0), vec2f(light.side - 1.0)));
        hidden += select(vec2f(0.0), vec2f(occluder - depth, 1.0), occluder > depth);
    }
    // Filter over the penumbra of their mean distance
    let radius = clamp(light.disc_tangent * hidden.x / max(hidden.y, 1.0) * metres / light.view[i].texel, 0.0, MAX_FILTER_RADIUS);
    var sum = 0.0;
    for (var k = 0.0; k < PCSS_TAPS; k += 1.0) { sum += shadow_test(i, position + radius * vogel_disc(k, turn), depth); }
    return sum / PCSS_TAPS;
}

/// Look up the share of the light that view i lets through to a position of its map.
fn visibility(i: u32, position: vec2f, depth: f32, turn: f32) -> f32 {
    if (FILTER == NEAREST) { return shadow_test(i, floor(position), depth); }
    let at = select(position, floor(position) + 0.5, SNAP);
    if (FILTER == PCF || !DIRECTIONAL) { return pcf(i, at, depth); }
    return pcss(i, at, depth, turn);
}

/// Weigh the cascade after one from near to far, at `ahead` metres along the camera's axis: 0 before the part over which they blend.
/// Twin: reference/march.py:cascade_weight.
fn cascade_weight(ahead: f32, near: f32, far: f32, blend: f32) -> f32 {
    return clamp(1.0 - (far - ahead) / max(blend * (far - near), 1e-20), 0.0, 1.0);
}

/// Evaluate the angle at the light between the nearest approach (t0, h) and the ray at t. Twin: reference/march.py:equiangular_angle.
fn equiangular_angle(nearest: vec2f, t: f32) -> f32 {
    return atan2(t - nearest.x, nearest.y);
}

/// Compute the tangent of an angle below pi / 2, to 1e-6 of it. Twin: reference/angles.py:tangent.
fn tangent(angle: f32) -> f32 {
    let at = unit_at(angle);
    return at.y / at.x;
}

/// Evaluate the integrand over t, times dt / d(angle) (Kulla and Fajardo 2012). Twin: reference/march.py:equiangular_integrand.
fn equiangular_integrand(ray: Ray, nearest: vec2f, angle: f32) -> vec3f {
    let slope = tangent(angle);
    let longer = sqrt(1.0 + slope * slope); // than the nearest approach
    let d = nearest.y * longer;
    let t = nearest.x + nearest.y * slope;
    let axis_cosine = dot(ray.origin + t * ray.direction - light.position, light.axis) / d;
    return in_scatter_punctual(ray, t, d, -slope / longer, axis_cosine) / nearest.y;
}

/// Find the first of n steps, of a length each, whose sample lies at `beyond` or after it. o: where in its step.
/// Twin: reference/march.py:first_step.
fn first_step(beyond: f32, each: f32, o: f32, n: f32) -> f32 {
    return clamp(ceil(beyond / max(each, 1e-20) - o), 0.0, n);
}

/// Integrate transmittance over the steps of a ray that are lit in view i of a directional light.
fn march_directional(i: u32, ray: Ray, each: f32, o: f32, n: f32) -> vec3f {
    let line = project_ray(i, ray, vec2f(0.0, ray.reach), 0.0);
    let ahead = -ray.direction.z * each; // metres of a step along the camera's axis
    let before = max(i, 1u) - 1u;
    // Bound the steps to those that the cascade holds, and the one before blends into
    var k = 0.0;
    var end = n;
    if (CASCADES) {
        let view = light.view[i];
        if (i > 0u) { k = first_step(view.near - light.blend * (view.near - light.view[before].near) + ray.origin.z, ahead, o, n); }
        end = first_step(view.far + ray.origin.z, ahead, o, n);
    }
    let fade = exp(-frame.sigma_t * each);
    let last = last_stretch(i, ray, 1.0);
    var weight = each * mean_transmittance(frame.sigma_t * each) * exp(-frame.sigma_t * each * k);
    var total = vec3f(0.0);
    loop {
        // Look up the sample's visibility
        let at = line.b.xyz + min((k + o) * each, last) * line.a.xyz;
        var share = visibility(i, at.xy, at.z, o);
        if (GLASS) { share *= light_left(i, at.xy, at.z); }
        // Weigh it where cascades blend
        if (CASCADES) {
            let away = (k + o) * ahead - ray.origin.z;
            let view = light.view[i];
            let last = light.view[before];
            let next = cascade_weight(away, view.near, view.far, light.blend);
            share *= select(1.0 - next, cascade_weight(away, last.near, last.far, light.blend), away < view.near);
        }
        // Add the step's integral of transmittance
        if (FOG != EVEN) { weight = directional_integral(ray, vec2f(k, k + 1.0) * each); }
        total += select(vec3f(0.0), weight * share, k < end);
        weight *= fade;
        k += 1.0;
        continuing { break if k >= end; }
    }
    return total;
}

/// Integrate in-scattered radiance over the steps of a range of t that are lit in view i of a light with a position: n steps of equal angles
/// at the light, the first at `start`.
fn march_punctual(i: u32, ray: Ray, nearest: vec2f, range: vec2f, start: f32, each: f32, o: f32, n: f32) -> vec3f {
    let line = project_ray(i, ray, range, 1.0);
    // Bound the steps to those in the face of the cube
    var k = 0.0;
    var end = n;
    if (CUBE) {
        k = first_step(equiangular_angle(nearest, line.range.x) - start, each, o, n);
        end = select(0.0, first_step(equiangular_angle(nearest, line.range.y) - start, each, o, n), line.range.y > line.range.x);
    }
    let last = max(last_stretch(i, ray, line.b.w + ray.reach * line.a.w), line.range.x);
    var total = vec3f(0.0);
    loop {
        // Look up the sample's visibility
        let angle = start + (k + o) * each;
        let at = line.b + min(nearest.x + nearest.y * tangent(angle), last) * line.a;
        var share = select(visibility(i, at.xy / at.w, at.z / at.w, o), 1.0, at.w <= 0.0);
        if (GLASS && at.w > 0.0) { share *= light_left(i, at.xy / at.w, at.z / at.w); }
        // Add what the step scatters, but for the steps' angle
        total += select(vec3f(0.0), equiangular_integrand(ray, nearest, angle) * share, k < end);
        k += 1.0;
        continuing { break if k >= end; }
    }
    return total * each;
}

/// Integrate what the light adds to a ray, or to a part of one, `around` which the whole ray ranges: a part has its share of the steps.
fn in_scattered(ray: Ray, pixel: vec2u, around: vec2f) -> vec3f {
    var n = f32(light_storage.steps);
    let o = offset(pixel);
    if (DIRECTIONAL) {
        if (PANES) { n = clamp(ceil(n * ray.reach / max(around.y - around.x, 1e-20)), LEAST_STEPS, max(n, LEAST_STEPS)); }
        var total = vec3f(0.0);
        if (light_storage.views == 0u) { total = integrate_directional(ray, vec2f(0.0, ray.reach)); }
        for (var i = 0u; i < light_storage.views; i++) { total += march_directional(i, ray, ray.reach / n, o, n); }
        return in_scatter_directional(ray) * total;
    }
    let nearest = nearest_approach(ray);
    var range = vec2f(0.0, ray.reach);
    var whole = around;
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    range.y = max(range.x, range.y);
    let start = equiangular_angle(nearest, range.x);
    let all = equiangular_angle(nearest, range.y) - start;
    if (PANES) {
        if (CONE) { whole = clip_to_cone(ray, whole, light.cone_cosine); }
        let most = equiangular_angle(nearest, whole.y) - equiangular_angle(nearest, whole.x);
        n = clamp(ceil(n * all / max(most, 1e-20)), LEAST_STEPS, max(n, LEAST_STEPS));
    }
    var sum = vec3f(0.0);
    if (light_storage.views == 0u) { sum += integrate_in_fog(ray, nearest, full_cone_range(ray, range), range); }
    for (var i = 0u; i < light_storage.views; i++) { sum += march_punctual(i, ray, nearest, range, start, all / n, o, n); }
    return sum;
}

/// March the ray of a pixel in steps, and write its layer.
@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light_storage.begin;
    if (any(pixel >= frame.size)) { return; }
    let ray = camera_ray(pixel);
    var sum = ambient_or_previous(pixel, ray);
    if (PANES) { sum += march_parts(pixel, ray); } else if (LIT) { sum += in_scattered(ray, pixel, vec2f(0.0, ray.reach)); }
    textureStore(layer, pixel, vec4f(sum, ray.reach));
}
