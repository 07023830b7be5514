// The slices of the chapter "Light Shaft Rendering" (Mitchell 2004), as it prints them. A sample on plane i is
//
//     noise luminance(cookie) scale falloff shadow
//
// and is added to a buffer of 8 bits: rounded to a code, and held at 255. With the channel mask plane i goes to channel i mod 4, and a quarter of
// each is added at the end; without it a quarter of each sample is, so that both are as bright, and one has two bits less. Where the chapter says nothing: planes lie in
// the middles of equal parts of the box; colours of lights, cones and ranges, which it has not, are factors.
//! include "scatter/slices/volume.wgsl"
//! include "scatter/slices/maps.wgsl"
//! include "wgsl/luminance.wgsl"
override CLIP: bool = true;     // planes are cut to the volume, else what lies outside is dark
override MASK: bool = false;    // planes go to four channels
override NOISE: bool = false;   // two maps, else a constant
override SHADOW: bool = true;

const NOISE_CONSTANT = 0.015;   // without maps
const NOISE_SCALE = 0.05;       // of the product of two maps
const CHANNELS = 4.0;

/// Look up the light's cookie, or photometry, towards a place, nothing filtered.
fn shape_towards(place: vec3f) -> vec3f {
    let q = shape_index(place, 1.0);
    if (SHAPE == SPHERE) { return sphere_colour(q); }
    let found = cookie_level(cookie_place(q).xy, vec2f(1.0, 0.0));
    return select(found, vec3f(0.0), SHAPE == PERSPECTIVE && q.z <= 0.0);
}

/// Evaluate the falloff at d units from the light. Twin: reference/slices.py:printed_falloff.
fn printed_falloff(d: f32) -> f32 {
    return slicing.printed.x / (d * d) + slicing.printed.y / d + slicing.printed.z;
}

/// Round a light to codes of 8 bits. Twin: reference/slices.py:codes_of.
fn codes_of(light: f32) -> f32 {
    return floor(255.0 * clamp(light, 0.0, 1.0) + 0.5);
}

/// Place a point along a light's axes in its noise maps, before they are moved. Twin: reference/slices.py:noise_place.
fn noise_place(q: vec3f) -> vec2f {
    if (CUBE) { return q.xy / max(length(q) + abs(q.z), 1e-20); }
    return picture_place(q);
}

/// Look up the share of the light that the shadow map lets through to a point at t of a ray; 1 without one.
fn shadow_towards(place: vec3f) -> f32 {
    for (var i = 0u; i < slicing.views; i++) {
        let at = light.view[i].matrix * vec4f(place, 1.0);
        let texel = floor(at.xy / at.w);
        if (at.w > 0.0 && all(texel >= vec2f(0.0)) && all(texel < vec2f(light.side))) { return shadow_test(i, texel, at.z / at.w); }
    }
    return 1.0;
}

/// Evaluate a sample at a place on a plane.
fn printed_sample(place: vec3f) -> f32 {
    let q = in_light(place);
    let d = length(q);
    var found = slicing.gain * printed_falloff(max(select(d, 0.0, DIRECTIONAL) * slicing.unit, 1e-6)) * range_window(d, light.range);
    if (CONE) {
        let ramp = cone_ramp(q.z / max(d, 1e-20), light.cone_scale, light.cone_offset);
        found *= ramp * ramp;
    }
    if (SHAPE != 0u) { found *= luminance(shape_towards(place)); }
    var noise = NOISE_CONSTANT;
    if (NOISE) {
        let at = noise_place(q);
        noise = NOISE_SCALE * interpolated(maps, at + slicing.scroll.xy).r * interpolated(maps, at + slicing.scroll.zw).g;
    }
    found *= noise;
    if (SHADOW && found > 0.0) { found *= shadow_towards(place); }
    return found;
}

/// Find the range of t in which a ray is in the box around the volume.
/// Twin: reference/slices.py:clip_to_box.
fn clip_to_box(ray: Ray, range: vec2f) -> vec2f {
    var within = clip_range(range, ray.origin.x - slicing.low.x, ray.direction.x);
    within = clip_range(within, slicing.high.x - ray.origin.x, -ray.direction.x);
    within = clip_range(within, ray.origin.y - slicing.low.y, ray.direction.y);
    return clip_range(within, slicing.high.y - ray.origin.y, -ray.direction.y);
}

/// Tell whether a place lies in the volume. Twin: reference/slices.py:in_volume.
fn in_volume(place: vec3f) -> bool {
    var least = 0.0;
    for (var i = 0u; i < light.plane_count; i++) { least = min(least, dot(light.planes[i], vec4f(place, 1.0))); }
    return least >= 0.0;
}

/// Add a light's planes to a pixel. Twin: reference/slices.py:printed.
@compute @workgroup_size(8, 8)
fn slice(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light.begin;
    if (any(pixel >= frame.size)) { return; }
    let ray = camera_ray(pixel);
    enter_shape(ray);
    // Bound the planes to those that the ray meets in the box, before a surface
    var range = clip_to_box(ray, vec2f(0.0, ray.reach));
    if (CLIP && BOUNDED) { range = clip_to_planes(ray, range); }
    let apart = (slicing.high.z - slicing.low.z) / slicing.count;
    let ends = (range * -ray.direction.z - slicing.low.z) / apart - 0.5;
    var k = clamp(ceil(ends.x), 0.0, slicing.count);
    let end = select(0.0, clamp(floor(ends.y) + 1.0, 0.0, slicing.count), range.y >= range.x);
    var buffer = vec4f(0.0); // in codes
    loop {
        if (k >= end) { break; }
        let place = ray.origin + (slicing.low.z + (k + 0.5) * apart) / -ray.direction.z * ray.direction;
        if (CLIP || !BOUNDED || in_volume(place)) {
            let found = printed_sample(place);
            if (MASK) {
                let channel = k - CHANNELS * floor(k / CHANNELS);
                buffer = min(buffer + select(vec4f(0.0), vec4f(codes_of(found)), vec4f(0.0, 1.0, 2.0, 3.0) == vec4f(channel)), vec4f(255.0));
            } else {
                buffer.x = min(buffer.x + codes_of(found / CHANNELS), 255.0);
            }
        }
        k += 1.0;
    }
    let sum = select(buffer.x, (buffer.x + buffer.y + buffer.z + buffer.w) / CHANNELS, MASK) / 255.0;
    var there = vec3f(0.0);
    if (!FIRST) { there = textureLoad(before, pixel, 0).rgb; }
    textureStore(layer, pixel, vec4f(there + sum * slicing.tint, 0.0));
}
