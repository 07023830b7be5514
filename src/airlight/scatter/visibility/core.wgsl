// The exact walk for the pixels around the epipole, where rows crowd: their rays cross few texels of the map, as they go along the light's.
//! include "scatter/visibility/grid.wgsl"
//! include "scatter/march/ranges.wgsl"
override MAPS: u32 = 1u;

@group(0) @binding(7) var<uniform> core: Core;

/// Walk the texels that a ray crosses in a map, and integrate over what is lit of a range of it.
fn walk_map(i: u32, ray: Ray, range: vec2f) -> vec3f {
    let line = project_ray(i, ray, range, 0.0);
    let bias = depth_bias(i);
    let last = clamp(last_stretch(i, ray, 1.0), range.x, range.y);
    let start = clamp(line.range.x, range.x, last);
    let end = clamp(line.range.y, start, last);
    let most = vec2f(light.side - 1.0);
    let still = abs(line.a.xy) < vec2f(1e-20);
    let inverse = 1.0 / select(line.a.xy, vec2f(1.0), still);
    var sum = lit_integral(ray, vec2f(range.x, start)) + lit_integral(ray, vec2f(end, last));
    var t = start;
    var cell = clamp(floor(line.b.xy + start * line.a.xy), vec2f(0.0), most);
    loop {
        let borders = (cell + select(vec2f(0.0), vec2f(1.0), line.a.xy > vec2f(0.0)) - line.b.xy) * inverse;
        let ahead = select(borders, vec2f(3e38), still);
        let leave = clamp(min(ahead.x, ahead.y), t, end);
        let held = biased_occluder_depth(textureLoad(shadow, vec2i(cell), i, 0), bias);
        let lit = clip_range(vec2f(t, leave), line.b.z - held, line.a.z);
        sum += lit_integral(ray, vec2f(lit.x, max(lit.x, lit.y)));
        let step = select(vec2f(0.0, sign(line.a.y)), vec2f(sign(line.a.x), 0.0), ahead.x < ahead.y);
        cell = clamp(cell + step, vec2f(0.0), most);
        t = leave;
        continuing { break if t >= end; }
    }
    // Light the last stretch as it begins
    let at = line.b + last * line.a;
    let texel = floor(at.xy);
    let within = clamp(texel, vec2f(0.0), most);
    let held = biased_occluder_depth(textureLoad(shadow, vec2i(within), i, 0), bias);
    return sum + lit_integral(ray, vec2f(select(range.y, last, any(within != texel) || at.z >= held), range.y));
}

/// Write a pixel's layer anew, near the epipole.
@compute @workgroup_size(8, 8)
fn walk_core(@builtin(global_invocation_id) id: vec3u) {
    let pixel = min(core.begin + id.xy, frame.pixels - 1u);
    let away = distance(vec2f(core.begin + id.xy) + 0.5, core.middle);
    let ray = camera_ray_at(pixel);
    let whole = min(ray.reach, frame.sun_reach);
    var total = vec3f(0.0);
    var range = vec2f(0.0, whole);
    //! each k of 4: if (MAPS > 1u) { range = range_in_map(grid.map[k].near, grid.map[k].far, -ray.direction.z, whole); } if (MAPS > k) { total += walk_map(k, ray, range); }
    let sum = ambient_or_previous(pixel, ray) + in_scatter_directional(ray) * total;
    // Store what is out of the disc nowhere: software Vulkan fails at exponentials in a branch
    let is_core = away <= core.radius && all(pixel == core.begin + id.xy);
    textureStore(layer, select(frame.pixels, pixel, is_core), vec4f(sum, ray.reach));
}
