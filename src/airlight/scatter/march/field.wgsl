// Density that varies, along a ray of a march: air by height and noise, joined by grids. A cursor moves along the ray, panel by panel, and
// knows the optical length up to it, the integral of density over metres. Exact: panels end at all planes through voxels' centres, as between
// them density is a cubic along a line, which Gauss's rule of two nodes integrates exactly; and at half the noise's shortest wavelength.
// In steps: a panel a step, in which all but the air's closed form is that of one sample.
//! include "scatter/march/ray.wgsl"
//! include "medium/grid.wgsl"
//! include "medium/noise.wgsl"
override EXACT: bool = true;    // panels end where density has kinks
override NOISE: bool = false;   // the air varies
override GRIDS: u32 = 1u;       // how many join it
override ATLAS: bool = false;   // their voxels are in one texture, too
override ADDS: bool = false;    // and all of them by adding
override RETURNS: bool = true;  // the cursor goes back

struct Field {
    pixel: f32,                 // m that a pixel is wide, a metre away
    flat_pixel: f32,            // and without perspective
    noise: Noise,
    noise_rows: array<vec4f, 3>, // of the matrix from a place to m along the world's axes from the noise's origin
    atlas_texel: vec3f,         // of the atlas, which is 1 wide, high and deep
    grids: array<Grid, MAX_GRIDS>,
}

struct Crossing {               // of a ray with a grid: its index there at t is begin + t step
    begin: vec3f,
    step: vec3f,
    range: vec2f,               // of t, where the grid may change anything
}

struct Panel {                  // of a ray, from the cursor on
    end: f32,                   // m
    varies: bool,               // its density is no closed form
}

@group(0) @binding(8) var<uniform> field: Field;
@group(0) @binding(9) var<storage, read> voxels: array<f32>;
@group(0) @binding(15) var atlas: texture_3d<f32>;
@group(0) @binding(16) var linear: sampler;

const MARKS = 16u;              // along a ray, to which the cursor can go back
const NOISE_CHANGE = 0.7;       // of the noise's exponent, over which a panel may reach
const GAUSS_OFF = 0.28867513;   // sqrt(1 / 12): of two nodes from a panel's middle, of its length
const DENSE_DEPTHS = 14.0;      // of exponential fog, above which there is next to nothing

var<private> cursor: vec2f;     // m of the ray, and the optical length up to there
var<private> marks: array<vec2f, MARKS>; // cursors that were
var<private> marked: u32;
var<private> crossings: array<Crossing, MAX_GRIDS>;
var<private> noise_line: mat2x3f; // the ray's place in the noise at t is its first column + t times the second

/// Find a ray's place at t. Twin: reference/march_field.py:place_at.
fn place_at(ray: Ray, t: f32) -> vec3f {
    return ray.origin + t * ray.direction;
}

/// Interpolate the density of the voxels around an index of the i-th grid.
fn grid_density(at: vec3f, i: u32) -> f32 {
    let count = field.grids[i].count;
    let first = field.grids[i].first;
    let most = vec3i(count) - 1;
    let held = clamp(at, vec3f(0.0), vec3f(most));
    if (ATLAS) { return textureSampleLevel(atlas, linear, held * field.atlas_texel + field.grids[i].corner, 0.0).r; }
    let low = min(vec3i(floor(held)), max(most - 1, vec3i(0)));
    let part = held - vec3f(low);
    let step = vec3i(1, i32(count.x), i32(count.x * count.y)) * min(most - low, vec3i(1));
    let base = i32(first) + low.x + i32(count.x) * (low.y + i32(count.y) * low.z);
    let near = vec4f(voxels[base], voxels[base + step.x], voxels[base + step.y], voxels[base + step.x + step.y]);
    let far = base + step.z;
    let deep = vec4f(voxels[far], voxels[far + step.x], voxels[far + step.y], voxels[far + step.x + step.y]);
    let plane = mix(near, deep, part.z);
    let row = mix(plane.xy, plane.zw, part.y);
    return mix(row.x, row.y, part.x);
}

/// Evaluate the air's density at a place by its height alone. Twin: reference/march_field.py:even_density.
fn even_density(place: vec3f) -> f32 {
    if (FOG == EVEN) { return frame.air; }
    return frame.air * height_density(height(place), layer_of_fog());
}

/// Average the air's density, by height alone, between two places. Twin: reference/march_field.py:mean_even_density.
fn mean_even_density(a: vec3f, b: vec3f) -> f32 {
    if (FOG == EVEN) { return frame.air; }
    return frame.air * mean_height_density(height(a), height(b), layer_of_fog());
}

/// Join the i-th grid with the density at a place.
fn with_grid(place: vec3f, before: f32, i: u32) -> f32 {
    let at = grid_index(field.grids[i].rows, place);
    return select(before, joined(at, before, i), in_grid_box(at, field.grids[i].count, field.grids[i].edge));
}

/// Join the i-th grid, at an index in it.
fn joined(at: vec3f, before: f32, i: u32) -> f32 {
    let own = field.grids[i].factor * grid_density(at, i);
    if (ADDS) { return before + own; }
    return blended(before, own, field.grids[i].blend);
}

/// Join the i-th grid with the density at t of the ray.
fn with_crossed(t: f32, before: f32, i: u32) -> f32 {
    let crossing = crossings[i];
    return select(before, joined(crossing.begin + t * crossing.step, before, i), t >= crossing.range.x && t <= crossing.range.y);
}

/// Join all grids with the air's density at a place.
fn with_grids(place: vec3f, air: f32) -> f32 {
    var found = air;
    // Not in a loop, where drivers would read the uniforms anew for each invocation
    //! each i of 8: if (GRIDS > i) { found = with_grid(place, found, i); }
    return found;
}

/// Evaluate the density at a place, its noise averaged over a footprint of so many m. In float64: reference/field.py, density.
fn density(place: vec3f, footprint: f32) -> f32 {
    var air = even_density(place);
    if (NOISE) { air *= noise_density(grid_index(field.noise_rows, place), footprint, field.noise); }
    return with_grids(place, air);
}

/// Evaluate the density at t of the ray, in the same way.
fn density_along(ray: Ray, t: f32, footprint: f32) -> f32 {
    var found = even_density(place_at(ray, t));
    if (NOISE) { found *= noise_density(noise_line * vec2f(1.0, t), footprint, field.noise); }
    //! each i of 8: if (GRIDS > i) { found = with_crossed(t, found, i); }
    return found;
}

/// Find the metres that a pixel is wide at t of a ray, or, in steps, that a panel is long. Twin: reference/march_field.py:footprint.
fn footprint(t: f32, panel: f32) -> f32 {
    return max(field.flat_pixel + field.pixel * t, select(panel, 0.0, EXACT));
}

/// Begin a ray: find where it is in which grid.
fn enter_field(ray: Ray) {
    cursor = vec2f(0.0);
    marks[0] = cursor;
    marked = 1u;
    if (NOISE) { noise_line = mat2x3f(grid_index(field.noise_rows, ray.origin), grid_step(field.noise_rows, ray.direction)); }
    //! each i of 8: if (GRIDS > i) { enter_grid(ray, i); }
}

/// Find where a ray is in the i-th grid.
fn enter_grid(ray: Ray, i: u32) {
    let rows = field.grids[i].rows;
    let b = grid_index(rows, ray.origin);
    let a = grid_step(rows, ray.direction);
    let range = clip_to_grid(b, a, vec2f(0.0, ray.reach), field.grids[i].count, field.grids[i].edge);
    let summed = clip_to_slabs(b + b.yzx, a + a.yzx, range, field.grids[i].low_sums, field.grids[i].high_sums);
    let within = clip_to_slabs(b - b.yzx, a - a.yzx, summed, field.grids[i].low_differences, field.grids[i].high_differences);
    crossings[i] = Crossing(b, a, within);
}

/// Find how far from t a ray's height leaves the part of fog over which a panel may reach. Twin: reference/march_field.py:fog_ahead.
fn fog_ahead(ray: Ray, t: f32) -> f32 {
    let y = height(place_at(ray, t));
    let climb = dot(frame.up, ray.direction);
    let depth = frame.fog_depth;
    let top = depth * select(1.0, DENSE_DEPTHS, FOG == EXPONENTIAL);
    let rate = max(abs(climb), 1e-12);
    let away = (y <= 0.0 && climb <= 0.0) || (y >= top && climb >= 0.0);
    let outside = select(max(y - top, 0.0), max(-y, 0.0), y < 0.0);
    return select(max(outside, select(0.5 * depth, 1e-3 * depth, outside > 0.0)) / rate, FAR, away);
}

/// Choose the panel from the cursor on, up to `most`.
fn next_panel(ray: Ray, most: f32) -> Panel {
    let t = cursor.x;
    var end = most;
    var varies = NOISE;
    if (GRIDS > 0u) {
        var i = 0u;
        loop {
            let crossing = crossings[i];
            let range = crossing.range;
            let within = t >= range.x && t < range.y;
            let plane = t + to_next_plane(crossing.begin + t * crossing.step, crossing.step);
            varies = varies || within;
            end = min(end, select(select(3e38, range.x, t < range.x && range.y > range.x), min(range.y, plane), within));
            i += 1u;
            continuing { break if i >= GRIDS; }
        }
    }
    if (FOG != EVEN && (varies || FOG == LINEAR || !DIRECTIONAL)) { end = min(end, t + fog_ahead(ray, t)); }
    if (NOISE) {
        // Half of the shortest wave, and less where that is strong
        let wave = noise_wavelength(footprint(t, 0.0), field.noise);
        let strong = NOISE_CHANGE / (field.noise.amplitude * field.noise.frequency);
        end = min(end, t + select(min(0.5 * wave, strong), wave, wave >= NOISE_FAR));
    }
    // Always move on, by more than the digits of t lose
    return Panel(max(end, min(most, t + 1e-6 * max(t, 1e-3))), varies);
}

/// Integrate density from the cursor to the end of a panel: m; the densities at its two nodes; 1 where these were read.
fn panel_length(ray: Ray, panel: Panel) -> vec4f {
    let long = panel.end - cursor.x;
    if (!panel.varies) { return vec4f(long * mean_even_density(place_at(ray, cursor.x), place_at(ray, panel.end)), 0.0, 0.0, 0.0); }
    let middle = 0.5 * (cursor.x + panel.end);
    let off = GAUSS_OFF * long;
    let first = density_along(ray, middle - off, footprint(middle, long));
    let second = density_along(ray, middle + off, footprint(middle, long));
    return vec4f(0.5 * long * (first + second), first, second, 1.0);
}

/// Move the cursor, over so much of optical length.
fn move_cursor(ray: Ray, end: f32, length: f32) {
    cursor = vec2f(end, cursor.y + length);
    if (RETURNS && marked < MARKS && end * f32(MARKS) >= f32(marked) * ray.reach && end > marks[marked - 1u].x) {
        marks[marked] = cursor;
        marked += 1u;
    }
}

/// Integrate density from the cursor to `end`, in equal pieces with a sample in each, at a part of it: m; and the mean density of the samples,
/// less that of the air's closed form there. detail: m, over which noise is averaged at the least.
fn step_length(ray: Ray, end: f32, part: f32, pieces: f32, detail: f32) -> vec2f {
    let piece = (end - cursor.x) / pieces;
    var more = 0.0;
    var k = 0.0;
    loop {
        let t = cursor.x + (k + part) * piece;
        more += density_along(ray, t, footprint(t, detail)) - even_density(place_at(ray, t));
        k += 1.0;
        continuing { break if k >= pieces; }
    }
    more /= pieces;
    let even = mean_even_density(place_at(ray, cursor.x), place_at(ray, end));
    return vec2f((end - cursor.x) * max(even + more, 0.0), more);
}

/// Move the cursor back, to a place at t or before it where it was.
fn move_back(t: f32) {
    if (t >= cursor.x) { return; }
    var k = marked - 1u;
    loop {
        cursor = marks[k];
        k = max(k, 1u) - 1u;
        continuing { break if cursor.x <= t; }
    }
}

/// Move the cursor to t, back or forth. each: metres of a step.
fn seek(ray: Ray, t: f32, each: f32) {
    move_back(t);
    loop {
        if (EXACT) {
            let panel = next_panel(ray, max(t, cursor.x));
            move_cursor(ray, panel.end, panel_length(ray, panel).x);
        } else {
            let end = max(select(t, cursor.x + each, cursor.x + 1.01 * each < t), cursor.x);
            move_cursor(ray, end, step_length(ray, end, 0.5, 1.0, select(0.0, end - cursor.x, DIRECTIONAL)).x);
        }
        continuing { break if cursor.x >= t; }
    }
}

/// Finish a pixel: its radiance, and what the ray's optical length is more than the air's closed form. The first light's pass adds what is
/// scattered of ambient light, the others keep what it found.
fn finished(p: vec2u, ray: Ray, radiance: vec3f) -> vec4f {
    if (!VARIES) { return vec4f(radiance, ray.reach); }
    if (!FIRST) { return vec4f(radiance, textureLoad(before, p, 0).a); }
    seek(ray, ray.reach, ray.reach / max(f32(light.steps), 1.0));
    let ambient = frame.sigma_s * frame.ambient * transmittance_integral(cursor.y, frame.sigma_t);
    return vec4f(radiance + ambient, cursor.y - ray.reach * mean_even_density(ray.origin, place_at(ray, ray.reach)));
}
