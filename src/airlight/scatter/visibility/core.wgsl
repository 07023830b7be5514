// The exact walk for the pixels around the epipole, where rows crowd: their rays cross few texels of the map, as they go along the light's.
//! include "scatter/visibility/grid.wgsl"
//! include "scatter/march/ranges.wgsl"
override MAPS: u32 = 1u;
override RADIUS: f32 = 24.0;    // pixels

struct Core {
    middle: vec2f,              // pixels: the epipole
    begin: vec2u,               // of the pixels that are walked
}

@group(0) @binding(7) var<uniform> core: Core;

/// Walk the texels that a ray crosses in a map, and integrate over what is lit of a range of it.
fn walk_map(i: u32, ray: Ray, range: vec2f) -> vec3f {
    let line = project_ray(i, ray, range, 0.0);
    let bias = depth_bias(i);
    let last = clamp(last_stretch(i, ray, 1.0), range.x, range.y);
    let start = clamp(line.range.x, range.x, last);
    let end = clamp(line.range.y, start, last);
    let most = vec2f(light.side - 1.0);
    let inverse = 1.0 / select(line.a.xy, vec2f(1e-20), abs(line.a.xy) < vec2f(1e-20));
    var sum = lit_integral(ray, vec2f(range.x, start)) + lit_integral(ray, vec2f(end, last));
    var t = start;
    var cell = clamp(floor(line.b.xy + start * line.a.xy), vec2f(0.0), most);
    loop {
        let ahead = (cell + select(vec2f(0.0), vec2f(1.0), line.a.xy > vec2f(0.0)) - line.b.xy) * inverse;
        let leave = clamp(min(ahead.x, ahead.y), t, end);
        let held = biased_occluder_depth(textureLoad(shadow, vec2i(cell), i, 0), bias);
        let lit = clip_range(vec2f(t, leave), line.b.z - held, line.a.z);
        if (lit.y > lit.x) { sum += lit_integral(ray, lit); }
        cell = clamp(cell + select(vec2f(0.0, sign(line.a.y)), vec2f(sign(line.a.x), 0.0), ahead.x < ahead.y), vec2f(0.0), most);
        t = leave;
        continuing { break if t >= end; }
    }
    // Light the last stretch as it begins
    let at = line.b + last * line.a;
    let texel = floor(at.xy);
    let within = clamp(texel, vec2f(0.0), most);
    let held = biased_occluder_depth(textureLoad(shadow, vec2i(within), i, 0), bias);
    if (any(within != texel) || at.z >= held) { sum += lit_integral(ray, vec2f(last, range.y)); }
    return sum;
}

/// Write a pixel's layer anew, near the epipole.
@compute @workgroup_size(8, 8)
fn walk_core(@builtin(global_invocation_id) id: vec3u) {
    let pixel = core.begin + id.xy;
    if (any(pixel >= frame.pixels) || distance(vec2f(pixel) + 0.5, core.middle) > RADIUS) { return; }
    let ray = camera_ray_at(pixel);
    let whole = min(ray.reach, frame.sun_reach);
    var total = vec3f(0.0);
    var i = 0u;
    loop {
        var range = vec2f(0.0, whole);
        if (MAPS > 1u) { range = clamp(vec2f(grid.map[i].near, grid.map[i].far) / max(-ray.direction.z, 1e-6), vec2f(0.0), vec2f(whole)); }
        total += walk_map(i, ray, range);
        i += 1u;
        continuing { break if i >= MAPS; }
    }
    textureStore(layer, pixel, vec4f(ambient_or_previous(pixel, ray) + in_scatter_directional(ray) * total, ray.reach));
}
