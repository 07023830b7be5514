// Shapes of lights: what a light's intensity is multiplied by, direction by direction. A cookie is a picture that a light sends out: with
// perspective, or, of a directional light, side by side again and again; photometry a table of all directions. Light may be bounded by planes.
//! include "scatter/march/ray.wgsl"
override SHAPE: u32 = 0u;       // none, or one of these, as SHAPES of cookies.py

const PERSPECTIVE = 1u;
const PARALLEL = 2u;
const SPHERE = 3u;
const TEXEL_SLACK = 1e-3;       // texels: a line of texels' centres so near before a place is taken to be passed

@group(0) @binding(18) var cookie: texture_2d<f32>;
@group(0) @binding(19) var cookie_sampler: sampler;

var<private> shape_line: mat2x3f; // the ray's place along the shape's axes at t is its first column + t times the second

/// Find a place q along a shape's axes, right, up and ahead, in its texture: 0..1 from the left and the top, and beyond. scale: of a cookie,
/// its width and height in the picture, a metre away, are 1 / scale. Twin: reference/shape.py:shape_place.
fn shape_place(q: vec3f, scale: vec2f, size: vec2f) -> vec2f {
    if (SHAPE == SPHERE) {
        let turn = atan2(q.y, q.x) / (2.0 * PI);
        let tilt = atan2(length(q.xy), q.z) / PI;
        return vec2f(fract(turn) + 0.5 / size.x, (tilt * (size.y - 1.0) + 0.5) / size.y);
    }
    let across = vec2f(q.x, -q.y) * scale;
    return 0.5 + select(across / max(q.z, 1e-9), across, SHAPE == PARALLEL);
}

/// Count the texels of a shape that lie on a metre at a place q along its axes. Twin: reference/shape.py:texels_a_metre.
fn texels_a_metre(q: vec3f, scale: vec2f, size: vec2f) -> f32 {
    let texels = scale * size;
    if (SHAPE == PARALLEL) { return max(texels.x, texels.y); }
    if (SHAPE == SPHERE) { return 0.0; } // it has one level alone
    return max(texels.x, texels.y) / max(q.z, 1e-9);
}

/// Measure how wide a pixel of what is computed is at t of its ray, m. Twin: reference/shape.py:pixel_width.
fn pixel_width(t: f32) -> f32 {
    return abs(frame.rays.x) / f32(frame.size.x) * mix(t, 1.0, frame.flat);
}

/// Evaluate a light's shape at t of the ray: what its intensity is multiplied by, averaged over `spread` metres, or a pixel.
fn shape_colour(t: f32, spread: f32) -> vec3f {
    if (SHAPE == 0u) { return vec3f(1.0); }
    let q = shape_line * vec2f(1.0, t);
    let wide = max(spread, pixel_width(t));
    let level = log2(max(wide * texels_a_metre(q, light.shape_scale, light.shape_size), 1.0));
    let found = textureSampleLevel(cookie, cookie_sampler, shape_place(q, light.shape_scale, light.shape_size), level).rgb;
    return select(found, vec3f(0.0), SHAPE == PERSPECTIVE && q.z <= 0.0);
}

/// Begin a ray, whose places in the shape lie on a line.
fn enter_shape(ray: Ray) {
    if (SHAPE == 0u) { return; }
    shape_line = mat2x3f(shape_index(ray.origin, 1.0), shape_index(ray.direction, 0.0));
}

/// Transform a place (w 1) or a step (w 0) to the shape's axes. Twin: reference/shape.py:shape_index.
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
    let b = shape_line[0];
    let a = shape_line[1];
    let q = shape_line * vec2f(1.0, t);
    let level = exp2(floor(log2(max(pixel_width(t) * texels_a_metre(q, light.shape_scale, light.shape_size), 1.0))));
    let texels = light.shape_scale * light.shape_size / level;
    let middle = 0.5 * light.shape_size / level - 0.5;
    var w = vec2f(1.0, 0.0);
    if (SHAPE == PERSPECTIVE) { w = vec2f(b.z, a.z); }
    // (middle w + x texels) / w
    let x = next_whole(middle.x * w.x + b.x * texels.x, middle.x * w.y + a.x * texels.x, w, t);
    let y = next_whole(middle.y * w.x - b.y * texels.y, middle.y * w.y - a.y * texels.y, w, t);
    return max(min(x, y), t + 1e-6 * max(t, 1e-3));
}

/// Clip a range of t to where all planes of the light let it be. Twin: reference/shape.py:clip_to_planes.
fn clip_to_planes(ray: Ray, range: vec2f) -> vec2f {
    var within = range;
    var i = 0u;
    loop {
        let plane = light.planes[i];
        within = clip_range(within, dot(plane, vec4f(ray.origin, 1.0)), dot(plane.xyz, ray.direction));
        i += 1u;
        continuing { break if i >= light.plane_count; }
    }
    return within;
}
