// Looks the visibility of each pixel up in a lamp's table, with its own ray's length, and writes the layer: with what the lamp scatters where
// all is lit, which is of the picture's own resolution.
//! include "scatter/visibility/in_full.wgsl"
//! include "scatter/visibility/place.wgsl"
override COLOURS: bool = false; // extinction differs between red, green and blue
override AMBIENT: bool = true;  // there is ambient light
override LAST: bool = true;     // writes transmittance too

@group(0) @binding(7) var atlas: texture_2d<f32>;
@group(0) @binding(8) var linear: sampler;
@group(0) @binding(9) var layer_transmittance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(10) var full: texture_2d<f32>;
@group(0) @binding(11) var<uniform> lamp: Lamp;

/// Read the visibility of a place in the grid up to a block and a part of it, in red, green and blue. What grows evenly in a block is
/// visibility times its number.
fn visibility_at(place: PlaceInGrid, block: f32) -> vec3f {
    let step = select(3.0, 2.0, COLOURS);
    let layer_index = clamp(floor(block / step), 0.0, f32(grid.layers) - 1.0);
    let part = clamp(block - layer_index * step, 0.0, step);
    let at = vec2f(layer_index * place.rays + place.ray, place.row) + 0.5;
    let values = textureSampleLevel(atlas, linear, at * grid.atlas_texel, 0.0);
    let numbers = layer_index * step + vec4f(0.0, 1.0, 2.0, 3.0);
    let inverse = 1.0 / max(layer_index * step + part, 1e-6);
    let share = between_planes(select(values, values.xyzz, COLOURS) * numbers, part) * inverse;
    // In the first block the plane before it holds nothing yet
    let seen = select(share, values.y, block < 1.0);
    if (!COLOURS) { return vec3f(seen); }
    return max(seen + values.w * (frame.sigma_t - grid.middle) / max(grid.spread, 1e-30), vec3f(0.0));
}

/// Write a pixel's layer. Rows of pixels are a fifth faster than squares on software Vulkan, which stores them one after the other.
@compute @workgroup_size(64, 1)
fn apply(@builtin(global_invocation_id) id: vec3u) {
    let ray = camera_ray_at(id.xy);
    let place = place_in_grid(vec2f(id.xy) + 0.5, vec2f(frame.pixels), grid.slope, grid.offset, grid.rate, grid.first, grid.rays);
    // Find the angles at the eye and at the lamp
    let cosine = dot(ray.direction, lamp.towards);
    let aside = cross(ray.direction, lamp.towards);
    let sine = max(sqrt(dot(aside, aside)), 1e-6 + 1e-9 / lamp.away);
    let at_eye = angle_from(cosine, sine);
    let at_lamp = min(angle_from(lamp.away - ray.reach * cosine, ray.reach * sine), lamp.end) - lamp.begin;
    // Look up
    let where_full = vec2f(sqrt(at_eye / PI), clamp(at_lamp / max(PI - at_eye - lamp.begin, 1e-6), 0.0, 1.0));
    let mean = textureSampleLevel(full, linear, (where_full * (FULL_SIDE - 1.0) + 0.5) / FULL_SIDE, 0.0).rgb;
    let seen = visibility_at(place, max(at_lamp / lamp.wide, 0.0));
    var sum = lamp.power * mean * seen * (max(at_lamp, 0.0) / (lamp.away * sine));
    if (!FIRST || AMBIENT) { sum += ambient_or_previous(id.xy, ray); }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
    if (LAST) { textureStore(layer_transmittance, id.xy, vec4f(transmittance(ray.reach, frame.sigma_t), 1.0)); }
}
