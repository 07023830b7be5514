// Shapes of lights: what a light's intensity is multiplied by, direction by direction. A cookie is a picture that a light sends out: with
// perspective, or, of a directional light, side by side again and again; photometry a table of all directions. Light may be bounded by planes.
//! include "scatter/march/ray.wgsl"
override SHAPE: u32 = 0u;       // none, or one of these, as SHAPES of cookies.py
override PLANES: u32 = 12u;     // that bound it, or more: one of zeros bounds nothing

const PERSPECTIVE = 1u;
const PARALLEL = 2u;
const SPHERE = 3u;
const TEXEL_SLACK = 1e-3;       // texels: a line of texels' centres so near before a place is taken to be passed

const EXPONENT = 0x7f800000u;   // bits of an f32
const ONE = 0x3f800000u;        // 1.0

@group(0) @binding(18) var cookie: texture_2d<f32>;
@group(0) @binding(19) var cookie_sampler: sampler;

var<private> shape_line: mat2x3f; // the ray's place in the shape at t, as shape_index has it, is its first column + t times the second
var<private> shape_pixel: vec2f; // m that a pixel is wide, and more for each metre of the ray
var<private> shape_texel: vec2f; // of the texture, as a share of it

/// Find a direction q along a shape's axes, right, up and ahead, in a table of all: 0..1 from the left and the top, and beyond. size: texels.
/// Twin: reference/shape.py:sphere_place.
fn sphere_place(q: vec3f, size: vec2f) -> vec2f {
    let turn = atan2(q.y, q.x) / (2.0 * PI);
    let tilt = atan2(length(q.xy), q.z) / PI;
    return vec2f(fract(turn) + 0.5 / size.x, (tilt * (size.y - 1.0) + 0.5) / size.y);
}

/// Find a place q, as shape_index has it, in a cookie: texels from the left and the top, and in z how many lie on a metre there.
/// Twin: reference/shape.py:cookie_place.
fn cookie_place(q: vec3f) -> vec3f {
    if (SHAPE == PARALLEL) { return vec3f(light.shape_size * fract(q.xy / light.shape_size), light.shape_most); }
    let each = 1.0 / max(q.z, 1e-9);
    return vec3f(q.xy, light.shape_most) * each;
}

/// Choose the level of a cookie whose texels are so many of level 0 wide, or less: 2^-level and the level, up to the last.
/// Twin: reference/shape.py:level_of.
fn level_of(texels: f32, last: u32) -> vec2f {
    let power = clamp(bitcast<u32>(texels) & EXPONENT, ONE, ONE + (last << 23u));
    return vec2f(bitcast<f32>(2u * ONE - power), f32(power >> 23u) - 127.0);
}

/// Find where a level of a cookie begins in its texture, texels. size: of level 0. Twin: reference/shape.py:level_corner.
fn level_corner(level: vec2f, size: vec2f) -> vec2f {
    let down = floor(size.y * (1.0 - 2.0 * level.x)) + 4.0 * level.y - 3.0;
    return vec2f(select(size.x + 3.0, 1.0, level.y == 0.0), max(down, 1.0));
}

/// Look up a place, in texels of level 0, in a level of the cookie.
fn cookie_level(place: vec2f, level: vec2f) -> vec3f {
    let at = level_corner(level, light.shape_size) + place * level.x;
    return textureSampleLevel(cookie, cookie_sampler, at * shape_texel, 0.0).rgb;
}

/// Look up a direction q along the shape's axes in photometry.
fn sphere_colour(q: vec3f) -> vec3f {
    return textureSampleLevel(cookie, cookie_sampler, sphere_place(q, light.shape_size), 0.0).rgb;
}

/// Measure how wide a pixel of what is computed is at the ray's origin, m, and how much wider a metre further. Twin: reference/shape.py:pixel_width.
fn pixel_width() -> vec2f {
    return abs(frame.rays.x) / f32(frame.size.x) * vec2f(frame.flat, 1.0 - frame.flat);
}

/// Evaluate a light's shape at t of the ray: what its intensity is multiplied by, averaged over `spread` metres, or a pixel.
fn shape_colour(t: f32, spread: f32) -> vec3f {
    if (SHAPE == 0u) { return vec3f(1.0); }
    let q = shape_line * vec2f(1.0, t);
    if (SHAPE == SPHERE) { return sphere_colour(q); }
    let at = cookie_place(q);
    let texels = max(spread, shape_pixel.x + t * shape_pixel.y) * at.z;
    let less = level_of(texels, light.shape_last);
    let more = level_of(2.0 * texels, light.shape_last);
    let share = 2.0 - 2.0 / clamp(texels * less.x, 1.0, 2.0); // how often shape_sample chooses the larger texels
    return mix(cookie_level(at.xy, less), cookie_level(at.xy, more), share);
}

/// Evaluate that by one look-up, on the mean over o, 0..1, which chooses between two levels.
fn shape_sample(t: f32, spread: f32, o: f32) -> vec3f {
    if (SHAPE == 0u) { return vec3f(1.0); }
    let q = shape_line * vec2f(1.0, t);
    if (SHAPE == SPHERE) { return sphere_colour(q); }
    let at = cookie_place(q);
    let texels = max(spread, shape_pixel.x + t * shape_pixel.y) * at.z;
    return cookie_level(at.xy, level_of(texels * (1.0 + o), light.shape_last));
}

/// Begin a ray, whose places in the shape lie on a line.
fn enter_shape(ray: Ray) {
    if (SHAPE == 0u) { return; }
    shape_line = mat2x3f(shape_index(ray.origin, 1.0), shape_index(ray.direction, 0.0));
    shape_pixel = pixel_width();
    shape_texel = 1.0 / vec2f(textureDimensions(cookie));
}

/// Transform a place (w 1) or a step (w 0) to the shape: m along its axes; of a cookie in x and y texels, times the metres ahead in z where it
/// has perspective. Twin: reference/shape.py:shape_index.
fn shape_index(v: vec3f, w: f32) -> vec3f {
    let at = vec4f(v, w);
    return vec3f(dot(light.shape_rows[0], at), dot(light.shape_rows[1], at), dot(light.shape_rows[2], at));
}

/// Find where the line b + t a next meets a whole number, from t on, or where it has no more; of a quotient, w is its divisor's line.
/// Twin: reference/shape.py:next_whole.
fn next_whole(b: f32, a: f32, w: vec2f, t: f32) -> f32 {
    let divisor = w.x + t * w.y;
    let value = (b + t * a) / divisor;
    let rises = a * divisor > (b + t * a) * w.y;
    let whole = select(ceil(value - TEXEL_SLACK) - 1.0, floor(value + TEXEL_SLACK) + 1.0, rises);
    let rate = a - whole * w.y;
    let found = (whole * w.x - b) / select(rate, 1e-30, rate == 0.0);
    return select(3e38, found, rate != 0.0 && found > t);
}

/// Find where the ray next crosses a line of texels' centres of the cookie, between which it is smooth, from t on.
fn next_texel(t: f32) -> f32 {
    if (SHAPE == 0u || SHAPE == SPHERE) { return 3e38; }
    let at = cookie_place(shape_line * vec2f(1.0, t));
    let level = level_of((shape_pixel.x + t * shape_pixel.y) * at.z, light.shape_last).x;
    var w = vec2f(1.0, 0.0);
    if (SHAPE == PERSPECTIVE) { w = vec2f(shape_line[0].z, shape_line[1].z); }
    let b = shape_line[0].xy * level - 0.5 * w.x;
    let a = shape_line[1].xy * level - 0.5 * w.y;
    let x = next_whole(b.x, a.x, w, t);
    let y = next_whole(b.y, a.y, w, t);
    return max(min(x, y), t + 1e-6 * max(t, 1e-3));
}

/// Clip a range of t to where all planes of the light let it be. Twin: reference/shape.py:clip_to_planes.
fn clip_to_planes(ray: Ray, range: vec2f) -> vec2f {
    let origin = vec4f(ray.origin, 1.0);
    var within = range;
    //! each i of 12: if (PLANES > i) { let n = light.planes[i]; within = clip_range(within, dot(n, origin), dot(n.xyz, ray.direction)); }
    return within;
}
