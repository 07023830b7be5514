// Slices in a medium: planes at right angles to the view cut a light's volume, and a ray adds up, plane by plane, the integral that the march
// has, from shadow maps and shape at one sample:
//
//     L = sum over planes of  V(sample) shape(sample) sigma_s p e^(-sigma_t (t + d)) * integral of the falloff over the plane's part of the ray
//
// The box's planes reach from the first to the last place that any ray sees of the light; a ray visits those in its own part of the volume, or
// none. Pixel by pixel over a cell of m x m planes lie at other places, as of m^2 times as many (Keller and Heidrich 2001).
//! include "scatter/slices/volume.wgsl"
//! include "scatter/march/glass.wgsl"
override CASCADES: bool = false; // of a directional light, several
override SHADOW: bool = true;

struct Extent {                 // bits of m ahead: the least and the most that is seen of the light
    least: atomic<u32>,
    most: atomic<u32>,
}

@group(0) @binding(8) var<storage, read_write> extent: Extent;

const SPREAD = 0.5;             // of a plane's part of a ray, over which the shape of a light is averaged
const BEND = 0.02;             // of what is seen of a light, m: how near to it planes draw together

struct Planes {
    first: f32,                 // m ahead where the first one's part begins, and of each; of a lamp asinh of these from it, in bends
    apart: f32,
    lamp: f32,                  // m ahead of the eye
    bend: f32,                  // m
}

var<workgroup> nearest: atomic<u32>;
var<workgroup> farthest: atomic<u32>;

/// Find the range of t of a ray in a light's volume; empty where its end is not behind its start. Twin: reference/slices.py:volume_range.
fn volume_range(ray: Ray) -> vec2f {
    var range = vec2f(0.0, ray.reach);
    if (DIRECTIONAL) { return vec2f(0.0, min(ray.reach, frame.sun_reach)); }
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    if (BOUNDED) { range = clip_to_planes(ray, range); }
    if (light.range > 0.0) { range = clip_to_ball(nearest_approach(ray), range, light.range); }
    return range;
}

/// Find from where to where, ahead of the eye, a light's volume is seen.
@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) own: u32) {
    if (own == 0u) {
        atomicStore(&nearest, 0x7f7fffffu);
        atomicStore(&farthest, 0u);
    }
    workgroupBarrier();
    if (all(id.xy < frame.size)) {
        let ray = camera_ray(id.xy);
        let range = volume_range(ray);
        if (range.y > range.x) {
            atomicMin(&nearest, bitcast<u32>(abs(range.x * ray.direction.z)));
            atomicMax(&farthest, bitcast<u32>(abs(range.y * ray.direction.z)));
        }
    }
    workgroupBarrier();
    if (own == 0u) {
        atomicMin(&extent.least, atomicLoad(&nearest));
        atomicMax(&extent.most, atomicLoad(&farthest));
    }
}

/// Lay so many planes from the least to the most that is seen of a light, m ahead: evenly, or, of a light so far ahead, closer to each other near
/// it. Twin: reference/slices.py:laid_planes.
fn laid_planes(least: f32, most: f32, count: f32, lamp: f32) -> Planes {
    if (DIRECTIONAL || FALLS) { return Planes(least, (most - least) / count, 0.0, 0.0); }
    let bend = max(BEND * (most - least), 1e-6);
    let first = asinh((least - lamp) / bend);
    return Planes(first, (asinh((most - lamp) / bend) - first) / count, lamp, bend);
}

/// Place where the k-th plane's part begins, m ahead. Twin: reference/slices.py:plane_place.
fn plane_place(k: f32, planes: Planes) -> f32 {
    let at = planes.first + k * planes.apart;
    if (DIRECTIONAL || FALLS) { return at; }
    let grown = exp(at);
    return planes.lamp + 0.5 * planes.bend * (grown - 1.0 / grown);
}

/// Find in which plane's part a place so many m ahead lies. Twin: reference/slices.py:plane_at.
fn plane_at(ahead: f32, planes: Planes) -> f32 {
    var at = ahead;
    if (!DIRECTIONAL && !FALLS) { at = asinh((ahead - planes.lamp) / planes.bend); }
    return (at - planes.first) / max(planes.apart, 1e-20);
}

/// Choose where in its part a pixel's planes lie, 0..1: each pixel of a cell elsewhere. Twin: reference/slices.py:plane_offset.
fn plane_offset(p: vec2u, cell: u32) -> f32 {
    let at = p % cell;
    // Neighbours lie far apart
    let own = (at.y * cell + at.x) * select(1u, 7u, cell * cell % 7u != 0u) % (cell * cell);
    return (f32(own) + 0.5) / f32(cell * cell);
}

/// Evaluate density times transmittance at t of a ray through fog, of a directional light. Twin: reference/slices.py:directional_share.
fn directional_share(ray: Ray, t: f32) -> vec3f {
    let y = height(ray.origin + t * ray.direction);
    var way = optical_length(ray, t);
    if (FADES) { way += height_column(y, layer_of_fog()) / max(light.climb, 1e-6); }
    return height_density(y, layer_of_fog()) * exp(-frame.sigma_t * way);
}

/// Weigh a sample of a cascade by its nearness to others. Twin: reference/slices.py:share_of_cascade.
fn share_of_cascade(i: u32, ahead: f32) -> f32 {
    let own = light.view[i];
    let last = light.view[max(i, 1u) - 1u];
    let gains = cascade_weight(ahead, last.near, last.far, light.blend);
    return select(1.0 - cascade_weight(ahead, own.near, own.far, light.blend), gains, ahead < own.near);
}

/// Look up the visibility of a sample at t in view i.
fn visibility_at(i: u32, line: ProjectedRay, t: f32, o: f32) -> f32 {
    let at = line.b + t * line.a;
    if (DIRECTIONAL) { return visibility(i, at.xy, at.z, o); }
    return select(visibility(i, at.xy / at.w, at.z / at.w, o), 1.0, at.w <= 0.0);
}

/// Look up what glass leaves of the light at a sample at t in view i.
fn left_at(i: u32, line: ProjectedRay, t: f32) -> vec3f {
    let at = line.b + t * line.a;
    if (DIRECTIONAL) { return light_left(i, at.xy, at.z); }
    return select(light_left(i, at.xy / at.w, at.z / at.w), vec3f(1.0), at.w <= 0.0);
}

/// Add up the planes of a range of t that are lit in view i.
fn slice_view(i: u32, ray: Ray, whole: vec2f, nearest: vec2f, planes: Planes, o: f32) -> vec3f {
    let line = project_ray(i, ray, whole, 1.0);
    var range = whole;
    if (CUBE && slicing.views > 0u) { range = line.range; }
    let slope = -1.0 / ray.direction.z; // m of the ray to one ahead
    if (CASCADES) {
        let last = light.view[max(i, 1u) - 1u];
        let begin = select(0.0, light.view[i].near - light.blend * (light.view[i].near - last.near), i > 0u);
        range = vec2f(max(range.x, begin * slope), min(range.y, light.view[i].far * slope));
    }
    let last = max(last_stretch(i, ray, line.b.w + ray.reach * line.a.w), line.range.x);
    var k = clamp(floor(plane_at(range.x / slope, planes)), 0.0, slicing.count - 1.0);
    let end = select(0.0, clamp(ceil(plane_at(range.y / slope, planes)), k + 1.0, slicing.count), range.y > range.x);
    var part = vec2f(0.0, clamp(plane_place(k, planes) * slope, whole.x, range.x));
    if (k == 0.0) { part.y = whole.x; }
    var away = sqrt(nearest.y * nearest.y + (part.y - nearest.x) * (part.y - nearest.x));
    var from_angle = equiangular_angle(nearest, part.y);
    // Of a directional light in even air, transmittance falls by a factor from plane to plane
    let fade = exp(-frame.sigma_t * planes.apart * slope);
    var through = exp(-frame.sigma_t * plane_place(k + o, planes) * slope);
    var total = vec3f(0.0);
    loop {
        if (k >= end) { break; }
        // Cut the plane's part of the ray to the volume
        k += 1.0;
        part = vec2f(part.y, clamp(plane_place(k, planes) * slope, part.y, whole.y));
        if (k >= slicing.count) { part.y = whole.y; }
        var t = mix(part.x, part.y, o);
        // Evaluate what is scattered at its sample
        var found = vec3f(0.0);
        if (DIRECTIONAL && FOG == EVEN) {
            found = (part.y - part.x) * through;
            through *= fade;
        } else if (DIRECTIONAL) {
            found = (part.y - part.x) * directional_share(ray, t);
        } else {
            // Near a light the plane bends around it: the sample has its share of the part's angle there
            let ends = part - nearest.x;
            let from_away = away;
            away = sqrt(nearest.y * nearest.y + ends.y * ends.y);
            let along = ((1.0 - o) * ends.x * away + o * ends.y * from_away) / ((1.0 - o) * away + o * from_away);
            t = nearest.x + along;
            let d = sqrt(nearest.y * nearest.y + along * along);
            let to_angle = equiangular_angle(nearest, part.y);
            let weight = (to_angle - from_angle) / nearest.y;
            from_angle = to_angle;
            let axis_cosine = dot(ray.origin + t * ray.direction - light.position, light.axis) / d;
            found = weight * in_scatter_punctual(ray, t, d, -along / d, axis_cosine);
        }
        if (SHAPE != 0u) { found *= shape_colour(t, SPREAD * (part.y - part.x) / f32(slicing.cell)); }
        // Look up its visibility
        if (SHADOW && slicing.views > 0u) {
            var share = visibility_at(i, line, min(t, last), o);
            if (CASCADES) { share *= share_of_cascade(i, t * -ray.direction.z); }
            found *= share;
            if (GLASS) { found *= left_at(i, line, min(t, last)); }
        }
        if (CUBE || CASCADES) { found = select(vec3f(0.0), found, t >= range.x && (t < range.y || range.y == whole.y)); }
        total += found;
    }
    return total;
}

/// Add a light's planes to the ray of a pixel, and write its layer.
@compute @workgroup_size(8, 8)
fn slice(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light.begin;
    if (any(pixel >= frame.size)) { return; }
    let ray = camera_ray(pixel);
    var sum = ambient_or_previous(pixel, ray);
    if (LIT) {
        let range = volume_range(ray);
        if (range.y > range.x) {
            let least = bitcast<f32>(atomicLoad(&extent.least));
            let planes = laid_planes(least, bitcast<f32>(atomicLoad(&extent.most)), slicing.count, -light.position.z);
            let o = plane_offset(pixel, slicing.cell);
            let closest = nearest_approach(ray);
            enter_shape(ray);
            var total = vec3f(0.0);
            for (var i = 0u; i < max(slicing.views, 1u); i++) { total += slice_view(i, ray, range, closest, planes, o); }
            if (DIRECTIONAL) { total *= in_scatter_directional(ray); }
            sum += total;
        }
    }
    textureStore(layer, pixel, vec4f(sum, ray.reach));
}
