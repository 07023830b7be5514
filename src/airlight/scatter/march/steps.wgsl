// The march in steps: each is lit or not as its sample is, and its own integral is closed.
//! include "scatter/march/lights.wgsl"
//! include "scatter/jitter.wgsl"
override FILTER: u32 = 0u;      // nearest, pcf, soft
override SNAP: bool = false;    // look-ups at the centres of texels
override CASCADES: bool = false; // of a sun, several

const TAPS = 12.0;              // of a soft look-up, and of its search for what hides the light
const WIDEST = 24.0;            // texels, of its radius

@group(0) @binding(6) var noise: texture_2d<f32>;

/// Whether view i's texel hides nothing from a depth; outside its map everything is lit.
fn open(i: u32, texel: vec2f, depth: f32) -> f32 {
    if (any(texel < vec2f(0.0)) || any(texel >= vec2f(light.side))) { return 1.0; }
    return f32(depth >= held_at(i, texel));
}

fn held_at(i: u32, texel: vec2f) -> f32 {
    return threshold(textureLoad(shadow, vec2i(clamp(texel, vec2f(0.0), vec2f(light.side - 1.0))), i, 0), bias_in(i));
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
        let held = held_at(i, place + widest * on_disc(k, turn));
        hidden += select(vec2f(0.0), vec2f(held - depth, 1.0), held > depth);
    }
    let radius = clamp(light.spread * hidden.x / max(hidden.y, 1.0) * metres / light.view[i].texel, 0.0, WIDEST);
    var sum = 0.0;
    for (var k = 0.0; k < TAPS; k += 1.0) { sum += open(i, place + radius * on_disc(k, turn), depth); }
    return sum / TAPS;
}

/// The share of the light that view i sees from a place of a ray.
fn seen(i: u32, ray: Ray, t: f32, turn: f32) -> f32 {
    let at = light.view[i].matrix * vec4f(ray.origin + t * ray.direction, 1.0);
    let place = select(at.xy / at.w, floor(at.xy / at.w) + 0.5, SNAP);
    let depth = at.z / at.w;
    if (at.w <= 0.0) { return 1.0; }
    if (FILTER == 0u) { return open(i, place, depth); }
    if (FILTER == 1u || KIND != 0u) { return filtered(i, place, depth); }
    return softened(i, place, depth, turn);
}

/// The share of the light that reaches a ray at t: of a sun by the cascade there, of a point by the face towards it.
fn lit(ray: Ray, t: f32, turn: f32) -> f32 {
    if (light.views == 0u) { return 1.0; }
    if (KIND == 1u) { return seen(0u, ray, t, turn); }
    let ahead = -ray.direction.z * t;
    let at = ray.origin + t * ray.direction;
    var chosen = 0u;
    var best = -3e38;
    for (var i = 0u; i < light.views; i++) {
        let m = light.view[i].matrix;
        let key = select(dot(vec4f(m[0].w, m[1].w, m[2].w, m[3].w), vec4f(at, 1.0)), f32(i), KIND == 0u);
        let here = key > best && (KIND == 2u || ahead >= light.view[i].near);
        chosen = select(chosen, i, here);
        best = select(best, key, here);
    }
    let found = seen(chosen, ray, t, turn);
    if (!CASCADES) { return found; }
    let view = light.view[chosen];
    let share = clamp(1.0 - (view.far - ahead) / max(light.blend * (view.far - view.near), 1e-20), 0.0, 1.0);
    return mix(found, seen(min(chosen + 1u, light.views - 1u), ray, t, turn), share);
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    let n = f32(frame.steps);
    let o = offset(id.xy);
    if (KIND == 0u) {
        let each = ray.reach / n;
        let fade = exp(-frame.sigma_t * each);
        var weight = each * mean_transmittance(frame.sigma_t * each);
        var total = vec3f(0.0);
        var k = 0.0;
        loop {
            total += weight * lit(ray, (k + o) * each, o);
            weight *= fade;
            k += 1.0;
            continuing { break if k >= n; }
        }
        sum += sunlight(ray) * total;
    } else if (KIND < 3u) {
        let near = approach(ray);
        var range = vec2f(0.0, ray.reach);
        if (KIND == 1u) { range = in_cone(ray, range); }
        let start = angle_at(near, range.x);
        let each = max(angle_at(near, max(range.y, range.x)) - start, 0.0) / n;
        var total = vec3f(0.0);
        var k = 0.0;
        loop {
            let angle = start + (k + o) * each;
            total += by_angle(ray, near, angle) * lit(ray, near.x + near.y * tan(angle), o);
            k += 1.0;
            continuing { break if k >= n; }
        }
        sum += total * each;
    }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
}
