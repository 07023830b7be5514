// Draws earlier practice, as the chapter "Light Shaft Rendering" (Mitchell 2004) names it: polygons that extrude a window's outline, textured with moving
// noise; the same diced into more polygons; and thickness, from the depths of the volume's front and back faces. None knows what is in shadow;
// thickness has no colour and no texture, and polygons seen from their edge are lines. The amounts are our own.
//! include "scatter/slices/volume.wgsl"
//! include "scatter/slices/maps.wgsl"
override DICES: u32 = 1u;       // strips into which the window is cut, each way

const GLOW = 0.6;               // of a polygon where both noise maps are 1
const GRAIN = 0.08;             // noise maps a metre along the light
const HAZE = 0.12;              // of the thickness, 1/m
const STRIPS = 0.5;             // power of the number of polygons, by which each is weaker

/// Find t at which a ray meets the plane that a line across the window, at a part -1 to 1 of its half width, is extruded to; -1: nowhere before t.
/// q, along: the ray's begin and direction along the light's axes, and the half width a metre ahead, of the axis across.
/// Twin: reference/slices.py:polygon_distance.
fn polygon_distance(q: vec2f, along: vec2f, part: f32) -> f32 {
    let under = along.x - part * along.y;
    return select(-(q.x - part * q.y) / select(under, 1.0, under == 0.0), -1.0, under == 0.0);
}

/// Evaluate what a polygon shows at t of a ray, 0 where it is not. other: whether it lies across the other axis.
fn polygon_glow(ray: Ray, t: f32, other: bool) -> f32 {
    let q = in_light(ray.origin + t * ray.direction);
    let place = picture_place(q);
    let own = select(place.y, place.x, other);
    let inside = t > 0.0 && t < ray.reach && q.z >= slicing.span.x && q.z <= slicing.span.y && own >= 0.0 && own <= 1.0;
    let at = vec2f(own, GRAIN * q.z);
    let noise = interpolated(maps, at + slicing.scroll.xy).r * interpolated(maps, at + slicing.scroll.zw).g;
    let fade = 1.0 - (q.z - slicing.span.x) / (slicing.span.y - slicing.span.x);
    return select(0.0, GLOW * noise * fade, inside);
}

/// Add what was before, and write.
fn store_earlier(p: vec2u, light: vec3f) {
    var there = vec3f(0.0);
    if (!FIRST) { there = textureLoad(before, p, 0).rgb; }
    textureStore(layer, p, vec4f(there + light, 0.0));
}

/// Add the polygons of a window. Twin: reference/slices.py:polygons.
@compute @workgroup_size(8, 8)
fn polygons(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light.begin;
    if (any(pixel >= frame.size)) { return; }
    let ray = camera_ray(pixel);
    var sum = 0.0;
    let q = in_light(ray.origin);
    let along = in_light(ray.origin + ray.direction) - q;
    for (var k = 0u; k <= DICES && LIT; k++) {
        let part = 2.0 * f32(k) / f32(DICES) - 1.0;
        let across = polygon_distance(vec2f(q.x, q.z * slicing.tangents.x), vec2f(along.x, along.z * slicing.tangents.x), part);
        let upwards = polygon_distance(vec2f(q.y, q.z * slicing.tangents.y), vec2f(along.y, along.z * slicing.tangents.y), part);
        sum += polygon_glow(ray, across, false) + polygon_glow(ray, upwards, true);
    }
    store_earlier(pixel, sum / pow(f32(DICES), STRIPS) * slicing.tint);
}

/// Add the thickness of the volume before a surface. Twin: reference/slices.py:thickness.
@compute @workgroup_size(8, 8)
fn thickness(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy + light.begin;
    if (any(pixel >= frame.size)) { return; }
    let ray = camera_ray(pixel);
    var range = vec2f(0.0, ray.reach);
    if (CONE) { range = clip_to_cone(ray, range, light.cone_cosine); }
    if (BOUNDED) { range = clip_to_planes(ray, range); }
    if (light.range > 0.0) { range = clip_to_ball(nearest_approach(ray), range, light.range); }
    store_earlier(pixel, vec3f(select(0.0, HAZE * max(range.y - range.x, 0.0), LIT)));
}
