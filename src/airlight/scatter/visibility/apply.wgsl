// Looks the visibility of each pixel up in the table, with its own ray's length, and writes the layer.
//! include "scatter/visibility/grid.wgsl"
//! include "scatter/visibility/place.wgsl"
override COLOURS: bool = false; // extinction differs between red, green and blue
override MAPS: u32 = 1u;
override BEYOND: bool = true;   // rays may leave the map before they end
override SHORT: bool = true;    // suns light less far than the medium reaches
override GLOWS: bool = true;    // there is a glow around suns
override AMBIENT: bool = true;  // there is ambient light
override LAST: bool = true;     // writes transmittance too

@group(0) @binding(7) var atlas: texture_2d<f32>;
@group(0) @binding(8) var linear: sampler;
@group(0) @binding(9) var layer_transmittance: texture_storage_2d<rgba32float, write>;

/// Read the visibility of a place in a map's grid up to so many texels, in red, green and blue.
fn visibility_at(map: u32, place: PlaceInGrid, texels: f32, texel: vec2f) -> vec3f {
    let step = select(3.0, 2.0, COLOURS);
    let block = block_at(texels);
    let layer_index = clamp(floor(block / step), 0.0, f32(grid.layers) - 1.0);
    let part = clamp(block - layer_index * step, 0.0, step);
    let at = vec2f(layer_index * place.rays + place.ray, place.row + f32(grid.map[map].first_row)) + 0.5;
    let values = textureSampleLevel(atlas, linear, at * texel, 0.0);
    if (!COLOURS) { return vec3f(between_planes(values, part)); }
    let seen = between_planes(values.xyzz, part);
    return clamp(seen + values.w * (frame.sigma_t - grid.middle) / max(grid.spread, 1e-30), vec3f(0.0), vec3f(1.0));
}

/// Measure the texels of a map that a ray passes in a metre. Twin: reference/visibility.py:pace_in_map.
fn pace_in_map(map: u32, ray: Ray) -> f32 {
    return max(length((light.view[map].matrix * vec4f(ray.direction, 0.0)).xy), LEAST_PACE);
}

/// Integrate what is lit of a ray in one map. pace: texels a metre; whole: m; full: the integral up to there where all of it is lit.
fn lit_in_map(map: u32, ray: Ray, place: PlaceInGrid, pace: f32, texel: vec2f, whole: f32, full: vec3f) -> vec3f {
    if (MAPS == 1u && !BEYOND) { return visibility_at(map, place, whole * pace, texel) * full; }
    var range = vec2f(0.0, whole);
    if (MAPS > 1u) { range = range_in_map(grid.map[map].near, grid.map[map].far, -ray.direction.z, whole); }
    let stop = clamp(grid.map[map].stop / pace, range.x, range.y);
    let known = visibility_at(map, place, stop * pace, texel) * lit_integral(ray, vec2f(range.x, stop));
    if (MAPS == 1u) { return known + full - lit_integral(ray, vec2f(0.0, stop)); }
    return known + lit_integral(ray, vec2f(stop, range.y));
}

/// Write a pixel's layer. Rows of pixels are a fifth faster than squares on software Vulkan, which stores them one after the other.
@compute @workgroup_size(64, 1)
fn apply(@builtin(global_invocation_id) id: vec3u) {
    let ray = camera_ray_at(id.xy);
    let place = place_in_grid(vec2f(id.xy) + 0.5, vec2f(frame.pixels), grid.slope, grid.offset, grid.rate, grid.first, grid.rays);
    let whole = select(ray.reach, min(ray.reach, frame.sun_reach), SHORT);
    let full = lit_integral(ray, vec2f(0.0, whole));
    var total = vec3f(0.0);
    //! each k of 4: if (MAPS > k) { total += lit_in_map(k, ray, place, pace_in_map(k, ray), grid.atlas_texel, whole, full); }
    var sum = total * frame.sigma_s * light.intensity * phase_between(ray.direction, light.position, light.lobes);
    if (GLOWS) { sum = total * in_scatter_directional(ray); }
    if (!FIRST || AMBIENT) { sum += ambient_or_previous(id.xy, ray); }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
    if (LAST) {
        var seen = transmittance(optical_length(ray, ray.reach), frame.sigma_t);
        if (FOG == EVEN && !SHORT) { seen = max(1.0 - frame.sigma_t * full, vec3f(0.0)); }
        textureStore(layer_transmittance, id.xy, vec4f(seen, 1.0));
    }
}
