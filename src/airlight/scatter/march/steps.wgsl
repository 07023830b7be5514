// The march in steps: each is lit or not as its sample is, and its own integral is closed.
//! include "scatter/march/lights.wgsl"
override BIASED: bool = false;
override JITTER: u32 = 0u;      // fixed, midpoint, interleaved-gradient noise, blue noise
@group(0) @binding(6) var noise: texture_2d<f32>;

/// Where in its step a pixel's samples lie, 0..1.
fn offset(p: vec2u) -> f32 {
    if (JITTER == 0u) { return 0.0; }
    if (JITTER == 1u) { return 0.5; }
    if (JITTER == 2u) { return fract(52.9829189 * fract(dot(vec2f(p) + 0.5, vec2f(0.06711056, 0.00583715)))); }
    return textureLoad(noise, p % 256u, 0).r;
}

/// Whether view i sees the light from a place; a place outside its map is lit.
fn lit_in(i: u32, at: vec4f) -> bool {
    let place = at.xy / at.w;
    if (any(place < vec2f(0.0)) || any(place >= vec2f(light.side)) || at.w <= 0.0) { return true; }
    var held = textureLoad(shadow, vec2i(place), i, 0);
    let level = select(0.0, light.bias / light.view[i].depth_scale, BIASED);
    if (KIND == 0u) { held = select(held - level, -3e38, held == 0.0); } else { held /= 1.0 + level * held; }
    return at.z / at.w >= held;
}

fn place_in(i: u32, ray: Ray, t: f32) -> vec4f {
    return light.view[i].matrix * vec4f(ray.origin + t * ray.direction, 1.0);
}

fn lit(ray: Ray, t: f32) -> bool {
    let ahead = -ray.direction.z * t;
    var chosen = 0u;
    var best = -3e38;
    for (var i = 0u; i < light.views; i++) {
        let w = place_in(i, ray, t).w;
        if (KIND == 0u && ahead >= light.view[i].near) { chosen = i; }
        if (KIND == 2u && w > best) {
            best = w;
            chosen = i;
        }
    }
    if (light.views == 0u) { return true; }
    return lit_in(chosen, place_in(chosen, ray, t));
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
            total += select(vec3f(0.0), weight, lit(ray, (k + o) * each));
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
            total += select(vec3f(0.0), by_angle(ray, near, angle), lit(ray, near.x + near.y * tan(angle)));
            k += 1.0;
            continuing { break if k >= n; }
        }
        sum += total * each;
    }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
}
