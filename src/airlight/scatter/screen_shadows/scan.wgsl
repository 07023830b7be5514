// Walks along the rows of the picture, away from the light, and writes for each of a row's rays which share of the light up to some
// distances is hidden by what the walk has passed.
//! include "scatter/screen_shadows/coordinate.wgsl"
override SUB: u32 = 3u;         // samples of the picture from ray to ray
override FINER: u32 = 4u;       // times as many to the first rays, beside the light, where what is small hides much
override BODIES: bool = false;  // there are some
const STEEPEST = 16.0;           // of a surface, relative change of depth over an angle, where the samples before do not tell
const FIRST_RAYS = 6.0;
const BENT = 0.3;               // share of a change of inverse depth, up to which the next may differ from it on one surface
const DEPTH_ERROR = 0.01;       // relative, of far bodies

struct Row {
    begin: vec2f,               // pixels: the first ray
    end: vec2f,                 // the last ray
    rays: f32,
}

@group(0) @binding(7) var<storage, read> rows: array<Row>;
@group(0) @binding(8) var shares: texture_storage_2d<rgba16float, write>;

var<private> hidden: array<vec4f, 9>; // of each bin, the share that is
var<private> shown: array<vec4f, 9>; // the same for the ray that is written
var<private> whole: f32;        // light of the ray up to a bin, if nothing hid it, in some unit
var<private> dark: f32;         // and what of that is hidden

/// Measure how much of each of four bins lies in a range. range: in bins; first: the bins' numbers.
/// Twin: reference/screen_shadows.py:covered_part.
fn covered_part(range: vec2f, first: vec4f) -> vec4f {
    return max(clamp(range.y - first, vec4f(0.0), vec4f(1.0)) - clamp(range.x - first, vec4f(0.0), vec4f(1.0)), vec4f(0.0));
}

/// Hide the rays of light from one coordinate up to another, if that is larger.
fn hide(begin: f32, end: f32) {
    let range = vec2f(begin, end) * f32(BINS);
    //! each k of 9: hidden[k] = min(hidden[k] + covered_part(range, 4.0 * f32(k) + vec4f(0.0, 1.0, 2.0, 3.0)), vec4f(1.0));
}

/// Make the direction of the view's ray through a place of the picture, px, 1 long along the camera's axis.
/// Twin: reference/screen_shadows.py:ray_through.
fn ray_through(p: vec2f) -> vec3f {
    return vec3f(frame.rays.xy * (p / vec2f(frame.pixels)) + frame.rays.zw, -1.0);
}

/// Tell whether a place, view space, is on a body of light, whose sphere is seen in its direction, about as far away.
/// Twin: reference/screen_shadows.py:is_on_body.
fn is_on_body(place: vec3f, sphere: vec4f) -> bool {
    let away = length(place);
    let middle = length(sphere.xyz);
    return length(cross(place, sphere.xyz)) < sphere.w * away && abs(away - middle) < sphere.w + DEPTH_ERROR * middle;
}

/// Tell whether a surface goes on from a sample of the picture to the next: their depths are alike, or go on as a plane's, whose inverse
/// changes evenly. inverse: of the depths of the sample before, of it and of the next one, 1/m; 0: none. angle: between samples, radians.
/// Twin: reference/screen_shadows.py:is_joined.
fn is_joined(inverse: vec3f, angle: f32) -> bool {
    let step = inverse.z - inverse.y;
    let is_alike = abs(step) <= STEEPEST * angle * max(inverse.y, inverse.z);
    let is_plane = inverse.x > 0.0 && abs(step - (inverse.y - inverse.x)) <= BENT * abs(step);
    return min(inverse.y, inverse.z) > 0.0 && (is_alike || is_plane);
}

/// Read how far along the camera's axis the surface at a place of the picture is, m; 0 where there is none that hides light.
fn surface_at(p: vec2f) -> f32 {
    let depth = textureLoad(depths, clamp(vec2i(floor(p)), vec2i(0), vec2i(frame.pixels) - 1), 0);
    var ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
    if (BODIES) {
        let place = ahead * ray_through(p);
        for (var i = 0u; i < scan.bodies; i++) { ahead = select(ahead, 0.0, is_on_body(place, scan.body[i])); }
    }
    return select(max(ahead, 0.0), 0.0, depth >= 1.0);
}

/// Weigh what a sun adds to a range of t of a ray. Twin: reference/screen_shadows.py:sun_weight.
fn sun_weight(ray: Ray, range: vec2f) -> f32 {
    if (FOG == EVEN) { return (transmittance_integral(range.y, frame.sigma_t) - transmittance_integral(range.x, frame.sigma_t)).g; }
    return directional_integral(ray, range).g;
}

/// Weigh what a lamp adds to a ray where its own ray has an angle at the lamp, with this cosine and sine, to the eye.
/// Twin: reference/screen_shadows.py:lamp_weight.
fn lamp_weight(ray: Ray, cosine: f32, sine: f32) -> f32 {
    // The angle to the nearest approach (t0, h), from the one between that and the eye
    let away = length(light.position);
    let t0 = dot(light.position, ray.direction);
    let h = max(length(light.position - t0 * ray.direction), 1e-6 * away + 1e-9);
    let sine_there = (sine * h - cosine * t0) / away;
    let cosine_there = (cosine * h + sine * t0) / away;
    if (cosine_there <= 1e-3) { return 0.0; }
    let d = h / cosine_there;
    let t = max(t0 + d * sine_there, 0.0);
    return in_scatter_punctual(ray, t, d, -sine_there, dot(t * ray.direction - light.position, light.axis) / d).g;
}

/// Add a bin to what is whole and what is dark; gives the share that is dark.
fn add_bin(k: u32, ray: Ray, sine: f32) -> f32 {
    var weight = 0.0;
    if (DIRECTIONAL) {
        weight = sun_weight(ray, min(vec2f(scan.edge[k].x, scan.edge[k + 1u].x) / max(sine, 1e-6), vec2f(frame.max_distance)));
    } else {
        weight = lamp_weight(ray, scan.edge[k].y, scan.edge[k].z);
    }
    whole += weight;
    dark += weight * shown[k / 4u][k % 4u];
    return select(0.0, dark / whole, whole > 0.0);
}

/// Write what is hidden of a ray of a row. further: what a surface that goes on hides up to the next ray, as pixels between them see it, and
/// all of the bin in which that ends, since they interpolate in it.
fn write_ray(row: u32, i: f32, rays: f32, p: vec2f, further: vec2f) {
    let range = further * f32(BINS);
    //! each k of 9: shown[k] = min(hidden[k] + covered_part(range, 4.0 * f32(k) + vec4f(0.0, 1.0, 2.0, 3.0)), vec4f(1.0));
    let ray = Ray(vec3f(0.0), frame.max_distance, normalize(ray_through(p)));
    let sine = length(cross(ray.direction, light.position));
    whole = 0.0;
    dark = 0.0;
    var at = vec4f(shown[0].x);
    //! each k of 12: at = vec4f(at.w, add_bin(3u * k, ray, sine), add_bin(3u * k + 1u, ray, sine), 0.0); at.w = add_bin(3u * k + 2u, ray, sine); textureStore(shares, vec2u(u32(f32(k) * rays + i), row), at);
}

/// Walk along a row.
@compute @workgroup_size(64)
fn walk(@builtin(global_invocation_id) id: vec3u) {
    let own = min(id.x, scan.count - 1u);
    let row = rows[own];
    let apart = (row.end - row.begin) / (row.rays - 1.0);
    //! each k of 9: hidden[k] = vec4f(0.0);
    var p = row.begin;
    var z = surface_at(p);
    var inverse = vec2f(0.0, select(1.0 / z, 0.0, z <= 0.0)); // of the sample before, and of the last
    var begin = coordinate(z * ray_through(p));
    var most = begin;           // from which a lit surface falls, that goes on
    var is_dark = z > 0.0;      // the surface hides what it sweeps
    var i = 0.0;
    loop {
        let further = coordinate(z * ray_through(p + apart));
        write_ray(own, i, row.rays, p, vec2f(begin, select(0.0, ceil(further * f32(BINS)) / f32(BINS), is_dark)));
        let samples = select(SUB, FINER * SUB, i < FIRST_RAYS);
        let step = apart / f32(samples);
        let angle = length(frame.rays.xy * (step / vec2f(frame.pixels)));
        var k = 0u;
        loop {
            // Go on along the surface half way to the next sample, and from there along that one's
            p += step;
            let next = surface_at(p);
            let ahead = select(1.0 / next, 0.0, next <= 0.0);
            let goes_on = is_joined(vec3f(inverse, ahead), angle);
            let mean = 2.0 / max(inverse.y + ahead, 1e-30);
            let middle = ray_through(p - 0.5 * step);
            let end = coordinate(select(z, mean, goes_on) * middle);
            // Hide what it sweeps: at once where that is dark, else when it ends, since it hides nothing before itself
            let is_hidden = z > 0.0 && (end > begin || !goes_on);
            most = max(most, begin);
            hide(min(begin, end), select(0.0, max(most, end), is_hidden));
            begin = coordinate(select(next, mean, goes_on) * middle);
            most = select(most, begin, is_hidden || !goes_on);
            z = next;
            inverse = vec2f(inverse.y, ahead);
            k += 1u;
            continuing { break if k >= samples; }
        }
        // Hide what a dark surface sweeps up to the ray itself
        let end = coordinate(z * ray_through(p));
        is_dark = z > 0.0 && end > begin;
        hide(begin, select(0.0, end, is_dark));
        begin = end;
        i += 1.0;
        continuing { break if i >= row.rays; }
    }
}
