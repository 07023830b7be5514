// The march in steps. A ray is cut into n steps, each lit as far as the shadow map says at one jittered sample in it:
//
//     L = sum over steps of  V(sample) * integral over the step of  sigma_s p E e^(-sigma_t (t + d)) dt
//
// A directional light's steps are equally long, and the integral of each is closed. A light with a position has steps of equal angles at
// it (equiangular sampling, Kulla and Fajardo 2012), where the integrand times dt / d(angle) has no peak at the nearest approach.
// Visibility: the nearest texel; percentage-closer filtering (Reeves et al. 1987); percentage-closer soft shadows (Fernando 2005); or
// variance shadow maps (Donnelly and Lauritzen 2006).
//! include "scatter/march/parts.wgsl"
//! include "scatter/march/chosen.wgsl"
//! include "scatter/march/groups.wgsl"
//! include "scatter/march/filters.wgsl"
//! include "wgsl/jitter.wgsl"
override CASCADES: bool = false; // of a directional light, several

const SPREAD = 0.5;             // of a step, over which the shape of a light is averaged
const LEAST_STEPS = 2.0;        // of a part of a ray

@group(0) @binding(6) var noise: texture_2d<f32>;

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

struct Group {                  // of steps
    sum: vec3f,                 // m, of density times transmittance
    slope: vec3f,               // change of the logarithm of what is scattered from the group's begin to its end
    steps: vec2f,               // t where its first step begins, and m of each; where the density varies
}

struct Knot {                   // a place of a ray, in fog that depends on height
    t: f32,
    y: f32,                     // m above the fog's base
    density: f32,
    before: f32,                // optical length from the eye, m
    whole: f32,                 // and from the light to the eye by way of it
    seen: vec3f,                // transmittance of the latter
}

struct LampStep {               // where the density varies
    range: vec2f,               // of t
    lengths: vec2f,             // optical lengths from the light to the eye by way of its ends
    excess: f32,                // of its density over the air's closed form
}

var<private> knot: Knot;        // at the end of the group before
var<private> far_end: f32;      // m of the ray, up to where steps go
var<private> gridded: vec2f;    // range of t of the ray in which there are grids
var<private> stretch: vec4f;    // a range of t of the ray, and the steps that begin and end there

/// Widen the range of t in which there are grids by that of one, up to `far`.
fn widen_gridded(one: vec2f, far: f32) {
    gridded = select(gridded, vec2f(min(gridded.x, one.x), max(gridded.y, min(one.y, far))), one.y > one.x);
}

/// Give the half of the steps, or more, to the part of the ray that lies in grids, if any does.
fn divide_steps(far: f32, n: f32) {
    far_end = far;
    stretch = vec4f(far, far, n, n);
    gridded = vec2f(3e38, 0.0);
    if (GRIDS == 0u) { return; }
    //! each i of 8: if (GRIDS > i) { widen_gridded(crossings[i].range, far); }
    let range = gridded;
    if (range.y <= range.x) { return; }
    stretch = vec4f(0.0, far, 0.0, n);
    if (NOISE) { return; }
    // In whole groups, since the sample of one stands for all of it; one where there is nothing
    let group = select(4.0, 8.0, n >= MANY_STEPS);
    let outside = max(far - range.y + range.x, 0.0);
    let spare = select(n - n * max(0.5, (range.y - range.x) / far), 0.0, frame.air == 0.0);
    let ends = vec2f(range.x, far - range.y);
    let groups = max(round(ends * spare / (group * max(outside, 1e-20))), vec2f(1.0));
    let before = select(group * groups.x, 0.0, ends.x <= 0.0);
    let after = select(group * groups.y, 0.0, ends.y <= 0.0);
    stretch = select(stretch, vec4f(range, before, n - after), before + after < n);
}

/// Find the first of n steps whose sample lies at `beyond` metres along the camera's axis or after it. o: where in its step.
fn first_step_ahead(beyond: f32, ray: Ray, each: f32, o: f32, n: f32) -> f32 {
    if (!VARIES) { return first_step(beyond, -ray.direction.z * each, o, n); }
    let t = min(beyond, 1e30) / max(-ray.direction.z, 1e-6); // the last cascade ends nowhere: what is no number comes of its infinity
    return clamp(ceil(step_at(min(t, far_end), n, far_end, stretch) - o), 0.0, n);
}

/// Move the knot to t of a ray, where so much of optical length lies before it.
fn begin_fog(ray: Ray, t: f32, before: f32) {
    let y = height(ray.origin + t * ray.direction);
    var whole = before;
    if (FADES) { whole += height_column(y, layer_of_fog()) / max(light.climb, 1e-6); }
    knot = Knot(t, y, height_density(y, layer_of_fog()), before, whole, transmittance(whole, frame.sigma_t));
}

/// Integrate density times transmittance from the knot to t, lit by a directional light, see directional_integral, and move the knot there.
fn fog_group(ray: Ray, t: f32) -> Group {
    let start = knot;
    let y = height(ray.origin + t * ray.direction);
    let along = (t - start.t) * mean_between_heights(start.y, y, max(start.density, height_density(y, layer_of_fog())));
    begin_fog(ray, t, start.before + along);
    let apart = knot.whole - start.whole;
    let mean = mean_between(start.seen, knot.seen, frame.sigma_t * abs(apart));
    let thinned = log(max(knot.density, 1e-20) / max(start.density, 1e-20));
    return Group(along * mean, clamp(thinned - frame.sigma_t * apart, vec3f(-40.0), vec3f(40.0)), vec2f(0.0));
}

/// Choose in how many pieces density is sampled from the cursor to `end`, in a group of so many steps: a piece a step in grids.
fn pieces_of(end: f32, size: f32) -> f32 {
    return select(1.0, max(0.5 * size, 1.0), GRIDS > 0u && end > gridded.x && cursor.x < gridded.y);
}

/// Integrate density times transmittance over the group of `size` steps from the k-th of n on; o: where the samples are, in their pieces.
/// some: there are steps in it.
fn begin_group(ray: Ray, k: f32, size: f32, each: f32, o: f32, n: f32, some: bool) -> Group {
    if (!VARIES) { return fog_group(ray, (k + size) * each); }
    let start = cursor;
    let end = select(start.x, step_place(k + size, n, far_end, stretch), some);
    let along = step_length(ray, end, o, pieces_of(end, size), (end - start.x) / size).x;
    move_cursor(ray, end, along);
    let before = knot;
    see_knot(start.y + along + light_length(ray, end));
    let apart = frame.sigma_t * (knot.whole - before.whole);
    return Group(along * mean_between(before.seen, knot.seen, abs(apart)), -apart, vec2f(start.x, (end - start.x) / size));
}

/// Note what of a directional light is seen from the knot on, by way of it, where so much of optical length lies along that way.
fn see_knot(whole: f32) {
    knot.whole = whole;
    knot.seen = transmittance(whole, frame.sigma_t);
}

/// Choose how many steps take what is left of a light from one look-up. Twin: reference/panes.py:dimmed_steps.
fn dimmed_steps(n: f32) -> f32 {
    if (COLOURED) { return select(1.0, MOST_COLOURED, n >= MANY_STEPS); }
    return select(1.0, select(2.0, select(4.0, 8.0, DIRECTIONAL), n >= MANY_STEPS), n >= 0.5 * MANY_STEPS);
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
        if (i > 0u) { k = first_step_ahead(view.near - light.blend * (view.near - light.view[before].near) + ray.origin.z, ray, each, o, n); }
        end = first_step_ahead(view.far + ray.origin.z, ray, each, o, n);
    }
    var fade = exp(-frame.sigma_t * each);
    let last = last_stretch(i, ray, 1.0);
    var weight = each * mean_transmittance(frame.sigma_t * each) * exp(-frame.sigma_t * each * k);
    var total = vec3f(0.0);
    if (VARIES) {
        enter_light(ray, step_place(k, n, far_end, stretch), each);
        see_knot(cursor.y + kept);
    }
    if (FOG != EVEN && !VARIES) {
        var passed_by = 0.0;
        if (CASCADES) { passed_by = optical_length(ray, k * each); }
        begin_fog(ray, k * each, passed_by);
    }
    loop {
        // Begin a group of steps, or what is left of one step by step
        var stop = end;
        var samples = vec2f(0.0); // t of the group's step 0, and m of a step
        if (VARIES || FOG != EVEN) {
            var size = group_size(k, n, stretch.zw);
            if (GLASS) { size = min(size, select(MOST_DIMMED, MOST_COLOURED, COLOURED)); }
            let group = begin_group(ray, k, size, each, o, n, k < end);
            fade = exp(group.slope / size);
            weight = group.sum / sum_of_powers(fade, size);
            samples = vec2f(group.steps.x - k * group.steps.y, group.steps.y);
            stop = min(k + size, end);
        } else if (GLASS) {
            stop = min(k + dimmed_steps(f32(light_storage.steps)), end);
        }
        // Let one lit step of the group stand for all behind what dims the light
        let first = k;
        var sum = vec3f(0.0);
        var lit = 0u;
        var count = 0.0;
        var own = 0u;
        loop {
            // Look up the sample's visibility
            var sample = (k + o) * each;
            if (VARIES) { sample = samples.x + (k + o) * samples.y; }
            let at = line.b.xyz + min(sample, last) * line.a.xyz;
            var share = visibility(i, at.xy, at.z, o);
            // Weigh it where cascades blend
            if (CASCADES) {
                let away = select((k + o) * ahead, -ray.direction.z * sample, VARIES) - ray.origin.z;
                let view = light.view[i];
                let last = light.view[before];
                let next = cascade_weight(away, view.near, view.far, light.blend);
                share *= select(1.0 - next, cascade_weight(away, last.near, last.far, light.blend), away < view.near);
            }
            // Add the step's integral of transmittance
            let found = select(vec3f(0.0), weight * share * shape_sample(sample, SPREAD * select(each, samples.y, VARIES), fract(37.618034 * o + 0.618034 * k)), k < end);
            if (GLASS) {
                sum += found;
                let is_lit = share > 0.0 && k < end;
                lit = select(lit, with_lit(lit, own), is_lit);
                count += f32(is_lit);
                own += 1u;
            } else {
                total += found;
            }
            weight *= fade;
            k += 1.0;
            continuing { break if k >= stop; }
        }
        if (GLASS) {
            let one = first + lit_step(lit, count, fract(37.618034 * o + 0.618034 * first)) + o;
            let at = line.b.xyz + min(select(one * each, samples.x + one * samples.y, VARIES), last) * line.a.xyz;
            total += sum * light_left(i, at.xy, at.z);
        }
        continuing { break if k >= end; }
    }
    return total;
}

/// Find what lies along a step from the cursor to the ray at `angle` from a light with a position, and move the cursor there. sample: the angle
/// at which the step is lit, where density is sampled too; some: there is such a step. Steps are not of groups, as angles are far from lengths,
/// nor do samples lose detail by their length.
fn begin_lamp_step(ray: Ray, nearest: vec2f, angle: f32, sample: f32, some: bool) -> LampStep {
    let reached = clamp(nearest.x + nearest.y * tangent(angle), cursor.x, ray.reach);
    let range = vec2f(cursor.x, select(cursor.x, reached, some));
    let first = cursor.y + kept;
    // Near a light one step holds most of the ray
    let pieces = max(ceil((range.y - range.x) / ray.reach * f32(light_storage.steps) - 0.01), 1.0);
    let at = (nearest.x + nearest.y * tangent(sample) - range.x) / max(range.y - range.x, 1e-20);
    let along = step_length(ray, range.y, fract(clamp(at, 0.0, 0.9999) * pieces), pieces, 0.0);
    move_cursor(ray, range.y, along.x);
    kept = light_length(ray, range.y);
    return LampStep(range, vec2f(first, cursor.y + kept), along.y);
}

/// Evaluate the integrand over t, times dt / d(angle), at an angle in a step (Kulla and Fajardo 2012).
/// Twin: reference/march_field.py:in_lamp_step.
fn in_lamp_step(ray: Ray, nearest: vec2f, step: LampStep, angle: f32) -> vec3f {
    let slope = tangent(angle);
    let longer = sqrt(1.0 + slope * slope);
    let d = nearest.y * longer;
    let t = nearest.x + nearest.y * slope;
    let place = place_at(ray, t);
    let strength = scattered_share(d, -slope / longer, dot(place - light.position, light.axis) / d);
    let at = clamp((t - step.range.x) / max(step.range.y - step.range.x, 1e-20), 0.0, 1.0);
    let here = max(even_density(place) + step.excess, 0.0);
    let way = mix(step.lengths.x, step.lengths.y, at);
    return frame.sigma_s * light.intensity * (strength * here / nearest.y) * exp(-frame.sigma_t * way);
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
    var step = LampStep(vec2f(0.0), vec2f(0.0), 0.0);
    var total = vec3f(0.0);
    if (VARIES) { enter_light(ray, clamp(nearest.x + nearest.y * tangent(start + k * each), 0.0, ray.reach), ray.reach / n); }
    loop {
        var stop = end;
        if (VARIES) {
            step = begin_lamp_step(ray, nearest, start + (k + 1.0) * each, start + (k + o) * each, k < end);
            stop = min(k + 1.0, end);
        } else if (GLASS) {
            stop = min(k + dimmed_steps(f32(light_storage.steps)), end);
        }
        let first = k;
        var sum = vec3f(0.0);
        var lit = 0u;
        var count = 0.0;
        var own = 0u;
        loop {
            // Look up the sample's visibility
            let angle = start + (k + o) * each;
            let at = line.b + min(nearest.x + nearest.y * tangent(angle), last) * line.a;
            let share = select(visibility(i, at.xy / at.w, at.z / at.w, o), 1.0, at.w <= 0.0);
            // Add what the step scatters, but for the steps' angle
            var scattered = vec3f(0.0);
            if (VARIES) {
                scattered = in_lamp_step(ray, nearest, step, angle);
            } else {
                scattered = equiangular_integrand(ray, nearest, angle);
            }
            if (SHAPE != 0u) {
                let slope = tangent(angle);
                let long = each * nearest.y * (1.0 + slope * slope); // m of the step
                scattered *= shape_sample(nearest.x + nearest.y * slope, SPREAD * long, fract(37.618034 * o + 0.618034 * k));
            }
            let found = select(vec3f(0.0), scattered * share, k < end);
            if (GLASS) {
                sum += found;
                let is_lit = share > 0.0 && k < end;
                lit = select(lit, with_lit(lit, own), is_lit);
                count += f32(is_lit);
                own += 1u;
            } else {
                total += found;
            }
            k += 1.0;
            continuing { break if k >= stop; }
        }
        if (GLASS) {
            let angle = start + (first + lit_step(lit, count, fract(37.618034 * o + 0.618034 * first)) + o) * each;
            let at = line.b + min(nearest.x + nearest.y * tangent(angle), last) * line.a;
            total += sum * select(light_left(i, at.xy / at.w, at.z / at.w), vec3f(1.0), at.w <= 0.0);
        }
        continuing { break if k >= end; }
    }
    return total * each;
}

/// Integrate what the light adds to a ray, or to a part of one, `around` which the whole ray ranges: a part has its share of the steps.
fn in_scattered(ray: Ray, pixel: vec2u, around: vec2f) -> vec3f {
    return with_scattered(vec3f(0.0), ray, pixel, around);
}

/// Add that to radiance that is there, view by view.
fn with_scattered(there: vec3f, ray: Ray, pixel: vec2u, around: vec2f) -> vec3f {
    let o = offset(pixel);
    var n = f32(light_storage.steps);
    let most = max(n, LEAST_STEPS); // of a part
    enter_shape(ray);
    if (VARIES) { enter_shade(ray); }
    if (DIRECTIONAL) {
        var far = min(ray.reach, frame.sun_reach);
        if (PANES) {
            far = clamp(frame.sun_reach + around.x, 0.0, ray.reach);
            n = clamp(ceil(n * far / max(min(around.y - around.x, frame.sun_reach), 1e-20)), LEAST_STEPS, most);
        }
        if (VARIES) { divide_steps(far, n); }
        var total = vec3f(0.0);
        if (light_storage.views == 0u && !VARIES) { total = integrate_directional(ray, vec2f(0.0, far)); }
        for (var i = 0u; i < max(light_storage.views, u32(VARIES)); i++) { total += march_directional(i, ray, far / n, o, n); }
        return there + in_scatter_directional(ray) * total;
    }
    let nearest = nearest_approach(ray);
    var range = vec2f(0.0, ray.reach);
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    if (BOUNDED) { range = clip_to_planes(ray, range); }
    range.y = max(range.x, range.y);
    let start = equiangular_angle(nearest, range.x);
    let all = equiangular_angle(nearest, range.y) - start;
    if (PANES) {
        var whole = around;
        if (CONE) { whole = clip_to_cone(ray, whole, light.cone_cosine); }
        if (BOUNDED) { whole = clip_to_planes(ray, whole); }
        let angles = equiangular_angle(nearest, whole.y) - equiangular_angle(nearest, whole.x);
        n = clamp(ceil(n * all / max(angles, 1e-20)), LEAST_STEPS, most);
    }
    var sum = there;
    if (light_storage.views == 0u && !VARIES) { sum += integrate_in_fog(ray, nearest, full_cone_range(ray, range), range); }
    for (var i = 0u; i < max(light_storage.views, u32(VARIES)); i++) { sum += march_punctual(i, ray, nearest, range, start, all / n, o, n); }
    return sum;
}

/// March the ray of a pixel in steps, and write its layer.
@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light_storage.begin;
    if (!is_listed() && any(pixel >= frame.size)) { return; }
    let sampled = marched_pixel(pixel);
    let ray = camera_ray_at(sampled);
    if (PANES) {
        textureStore(layer, pixel, layer_of_parts(pixel, ray));
        return;
    }
    var sum = ambient_or_previous(pixel, ray);
    if (VARIES) { enter_field(ray); }
    if (LIT) { sum = with_scattered(sum, ray, select(pixel, sampled, is_listed()), vec2f(0.0, ray.reach)); }
    textureStore(layer, pixel, finished(pixel, ray, sum));
}
