// The march in steps: each is lit or not as its sample is, and its own integral is closed.
//! include "scatter/march/lights.wgsl"
//! include "wgsl/jitter.wgsl"
override FILTER: u32 = 0u;      // nearest, pcf, soft
override SNAP: bool = false;    // look-ups at the centres of texels
override CASCADES: bool = false; // of a sun, several

const TAPS = 12.0;              // of a soft look-up, and of its search for what hides the light
const WIDEST = 24.0;            // texels, of its radius

@group(0) @binding(6) var noise: texture_2d<f32>;

/// Whether view i's texel hides nothing from a depth; outside its map everything is lit.
fn open(i: u32, texel: vec2f, depth: f32) -> f32 {
    let within = clamp(texel, vec2f(0.0), vec2f(light.side - 1.0));
    return f32(depth >= held_at(i, within) || any(within != texel));
}

/// From which depth on a place of the map is lit.
fn held_at(i: u32, texel: vec2f) -> f32 {
    return threshold(textureLoad(shadow, vec2i(texel), i, 0), bias_in(i));
}

/// Reeves et al. 1987 over 2 x 2 texels, by their nearness.
fn filtered(i: u32, place: vec2f, depth: f32) -> f32 {
    let base = floor(place - 0.5);
    let part = place - 0.5 - base;
    let top = mix(open(i, base, depth), open(i, base + vec2f(1.0, 0.0), depth), part.x);
    let bottom = mix(open(i, base + vec2f(0.0, 1.0), depth), open(i, base + 1.0, depth), part.x);
    return mix(top, bottom, part.y);
}

/// The k-th of TAPS places on a disc, turned by a pixel's noise (Vogel 1979).
fn on_disc(k: f32, turn: f32) -> vec2f {
    let angle = 2.3999632 * k + 2.0 * PI * turn;
    return sqrt((k + 0.5) / TAPS) * vec2f(cos(angle), sin(angle));
}

/// A sun's share that is seen past what hides it, which is as far away as it is on the mean (Fernando 2005).
fn softened(i: u32, place: vec2f, depth: f32, turn: f32) -> f32 {
    let metres = light.view[i].depth_scale;
    let widest = clamp(light.spread * (1.0 - depth) * metres / light.view[i].texel, 1.0, WIDEST);
    var hidden = vec2f(0.0);
    for (var k = 0.0; k < TAPS; k += 1.0) {
        let held = held_at(i, clamp(place + widest * on_disc(k, turn), vec2f(0.0), vec2f(light.side - 1.0)));
        hidden += select(vec2f(0.0), vec2f(held - depth, 1.0), held > depth);
    }
    let radius = clamp(light.spread * hidden.x / max(hidden.y, 1.0) * metres / light.view[i].texel, 0.0, WIDEST);
    var sum = 0.0;
    for (var k = 0.0; k < TAPS; k += 1.0) { sum += open(i, place + radius * on_disc(k, turn), depth); }
    return sum / TAPS;
}

/// The share of the light that view i sees from a place of its map.
fn seen(i: u32, place: vec2f, depth: f32, turn: f32) -> f32 {
    if (FILTER == 0u) { return open(i, floor(place), depth); }
    let at = select(place, floor(place) + 0.5, SNAP);
    if (FILTER == 1u || KIND != 0u) { return filtered(i, at, depth); }
    return softened(i, at, depth, turn);
}

/// The share of the light, `ahead` metres along the camera's axis, that the cascade after view i gives.
fn passed(i: u32, ahead: f32) -> f32 {
    let view = light.view[i];
    return clamp(1.0 - (view.far - ahead) / max(light.blend * (view.far - view.near), 1e-20), 0.0, 1.0);
}

/// The angle at a lamp between the nearest approach and the ray at t.
fn angle_at(near: vec2f, t: f32) -> f32 {
    return atan2(t - near.x, near.y);
}

/// What a radian of that angle scatters: the integrand over t, times dt / d(angle) (Kulla and Fajardo 2012).
fn by_angle(ray: Ray, near: vec2f, angle: f32) -> vec3f {
    let slope = tan(angle);
    let longer = sqrt(1.0 + slope * slope); // than the nearest approach
    let d = near.y * longer;
    let t = near.x + near.y * slope;
    let aside = dot(ray.origin + t * ray.direction - light.place, light.axis) / d;
    return lamplight(t, d, -slope / longer, aside) / near.y;
}

/// The first step of a ray, of n that are each so long, whose sample lies at `from` or beyond. o: where in its step.
fn first_step(beyond: f32, each: f32, o: f32, n: f32) -> f32 {
    return clamp(ceil(beyond / max(each, 1e-20) - o), 0.0, n);
}

/// What view i of a sun lights of a ray, an integral of transmittance.
fn sun_steps(i: u32, ray: Ray, each: f32, o: f32, n: f32) -> vec3f {
    let line = line_of(i, ray, vec2f(0.0, ray.reach), 0.0);
    let ahead = -ray.direction.z * each; // metres of a step along the camera's axis
    let before = max(i, 1u) - 1u;
    var k = 0.0;
    var end = n;
    if (CASCADES) {
        let view = light.view[i];
        if (i > 0u) { k = first_step(view.near - light.blend * (view.near - light.view[before].near), ahead, o, n); }
        end = first_step(view.far, ahead, o, n);
    }
    let fade = exp(-frame.sigma_t * each);
    var weight = each * mean_transmittance(frame.sigma_t * each) * exp(-frame.sigma_t * each * k);
    var total = vec3f(0.0);
    loop {
        let at = line.b.xyz + (k + o) * each * line.a.xyz;
        var share = seen(i, at.xy, at.z, o);
        if (CASCADES) {
            let away = (k + o) * ahead;
            share *= select(1.0 - passed(i, away), passed(before, away), away < light.view[i].near);
        }
        total += select(vec3f(0.0), weight * share, k < end);
        weight *= fade;
        k += 1.0;
        continuing { break if k >= end; }
    }
    return total;
}

/// What view i of a lamp lights of a range of t, cut in n steps of equal angles at the lamp, the first at `start`.
fn lamp_steps(i: u32, ray: Ray, near: vec2f, range: vec2f, start: f32, each: f32, o: f32, n: f32) -> vec3f {
    let line = line_of(i, ray, range, 1.0);
    var k = 0.0;
    var end = n;
    if (KIND == 2u) {
        k = first_step(angle_at(near, line.range.x) - start, each, o, n);
        end = select(0.0, first_step(angle_at(near, line.range.y) - start, each, o, n), line.range.y > line.range.x);
    }
    var total = vec3f(0.0);
    loop {
        let angle = start + (k + o) * each;
        let at = line.b + (near.x + near.y * tan(angle)) * line.a;
        let share = select(seen(i, at.xy / at.w, at.z / at.w, o), 1.0, at.w <= 0.0);
        total += select(vec3f(0.0), by_angle(ray, near, angle) * share, k < end);
        k += 1.0;
        continuing { break if k >= end; }
    }
    return total * each;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    let n = f32(counted.steps);
    let o = offset(id.xy);
    if (KIND == 0u) {
        var total = vec3f(0.0);
        if (counted.views == 0u) { total = until(ray.reach); }
        for (var i = 0u; i < counted.views; i++) { total += sun_steps(i, ray, ray.reach / n, o, n); }
        sum += sunlight(ray) * total;
    } else if (KIND < 3u) {
        let near = approach(ray);
        var range = vec2f(0.0, ray.reach);
        if (KIND == 1u) { range = in_cone(ray, range, light.cosine); }
        range.y = max(range.x, range.y);
        let start = angle_at(near, range.x);
        let each = (angle_at(near, range.y) - start) / n;
        if (counted.views == 0u) { sum += lamp_stretch(ray, near, in_full(ray, range), range); }
        for (var i = 0u; i < counted.views; i++) { sum += lamp_steps(i, ray, near, range, start, each, o, n); }
    }
    store_layer(id.xy, ray, sum);
}
