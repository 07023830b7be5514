// The exact walk: the integral over a ray with no error but the shadow map's own. Lit segments of t are collected, see segments.wgsl, and
// their integrals are closed, or by quadrature: see lights.wgsl.
//! include "scatter/march/parts.wgsl"
//! include "scatter/march/chosen.wgsl"
//! include "scatter/march/segments.wgsl"

/// Integrate over the lit segments that wait, and drop them: transmittance for a directional light, else in-scattered radiance.
fn flush_segments(ray: Ray, nearest: vec2f, full: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    var k = 0u;
    var begin = segments[0].x;
    loop {
        if (k >= segment_count) { break; }
        var segment = segments[k];
        var left = vec3f(1.0);
        if (GLASS) {
            let part = next_part(segment_views[k], ray, segment, begin);
            left = part.left;
            segment = vec2f(begin, part.end);
        }
        if (DIRECTIONAL) {
            sum += left * integrate_directional(ray, segment);
        } else {
            sum += left * integrate_in_fog(ray, nearest, full, segment);
        }
        begin = segment.y;
        if (!GLASS || begin >= segments[k].y) {
            k += 1u;
            begin = segments[k].x;
        }
    }
    segment_count = 0u;
    return sum;
}

/// Integrate what the light adds to a ray, or to a part of one, `around` which the whole ray ranges.
fn in_scattered(ray: Ray, pixel: vec2u, around: vec2f) -> vec3f {
    var nearest = vec2f(0.0);
    var range = vec2f(0.0, ray.reach);
    if (VARIES) { enter_shade(ray); }
    if (!DIRECTIONAL) { nearest = nearest_approach(ray); }
    if (DIRECTIONAL) { range.y = min(range.y, frame.sun_reach + around.x); }
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    if (BOUNDED) { range = clip_to_planes(ray, range); }
    range.y = max(range.x, range.y);
    enter_shape(ray);
    if (VARIES) { cone_range = range; }
    let full = full_cone_range(ray, range);
    var total = vec3f(0.0);
    segment_count = 0u;
    if (light_storage.views == 0u) { push_segment(range.x, range.y); }
    for (var i = 0u; i < light_storage.views; i++) {
        var seen = range;
        if (DIRECTIONAL) {
            let ahead = max(-ray.direction.z, 1e-6);
            let view = light.view[i];
            seen = clamp((vec2f(view.near, view.far) + ray.origin.z) / ahead, range.xx, range.yy);
        }
        total += integrate_view(i, ray, nearest, full, seen);
        if (segment_count >= MAX_SEGMENTS) { total += flush_segments(ray, nearest, full); }
    }
    total += flush_segments(ray, nearest, full);
    if (DIRECTIONAL) { total *= in_scatter_directional(ray); }
    return total;
}

/// March the ray of a pixel exactly, and write its layer.
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
    if (LIT) { sum += in_scattered(ray, pixel, vec2f(0.0, ray.reach)); }
    textureStore(layer, pixel, finished(pixel, ray, sum));
}
