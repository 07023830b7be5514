// The smart look's rays, unpublished (docs/look.md): instead of the sum of GPU Gems 3, Eq. 4, its contrast between neighbouring rays.
//
//     C(r, a) = int_0^r g(q) E(q, a) dq / int_0^r g(q) dq,    g(q) = 1 / (1 + (q / 0.15)^2)
//
// is the share of emitters E from the light to a distance r along an angle a, the near ones weighing more. matte_*.wgsl finds E g on a
// small copy of the picture. bands.wgsl sums it along LINES lines of equal angle, smooths C over lines, and takes away its narrow and
// its wide mean over angles, so that what stands out is left. amounts.wgsl makes of that a signed amount of light, and field.wgsl of the
// amounts of all lights what a pixel is given and loses, which codes.wgsl and layer.wgsl put on the picture.
//! include "wgsl/smooth_step.wgsl"
override INSIDE: bool = true; // the light lies in the picture: its lines go all round
const LINES = 1024u;          // these are those of look/grid.py and reference/look.py
const RADII = 128u;
const STEPS = 4u;
const COARSE = 4u;            // lines that the wide means take together
const HALF_WEIGHT_DIAGONALS = 0.15; // distance from the light at which an emitter counts half
const EMITS = vec2f(0.45, 0.85);
const TURN = 6.283185307179586;

struct Rays {                 // distances in picture diagonals
    box: vec2f,               // of the picture
    light: vec2f,
    start: f32,               // angle of the first line, radians
    span: f32,                // of all lines
    nearest: f32,             // distance of the picture from the light
    step: f32,                // between kept distances
    surroundings: f32,        // luminances about the light
    tone_span: f32,           // ln(light / surroundings)
    fine: f32,                // sigma over lines
    thinnest: f32,            // the same times the distance, at least
    broadest: f32,            // but no more of that
    narrow: f32,              // sigmas over groups of lines
    wide: f32,
    own: f32,                 // share of the picture's own fine rays beside drawn ones; 0: none are drawn
    drawn: f32,
    deviation: f32,           // rms of what stands out
    rest: f32,
    length: f32,
    mist: f32,
    soft: f32,                // nearer to the light rays run together
    color: vec3f,             // times the light's weight
}

/// Finds the emission of a pixel of luminance y, 0..1. Twin: reference/look.py:emission.
fn emission(y: f32, rays: Rays) -> f32 {
    return smooth_step(log(max(y, 1e-5) / rays.surroundings) / rays.tone_span, EMITS.x, EMITS.y);
}

/// Weighs an emitter by its distance from the light, or from where its ray enters the picture, diagonals.
/// Twin: reference/look.py:nearness_weight.
fn nearness_weight(distance: f32) -> f32 {
    let q = distance / HALF_WEIGHT_DIAGONALS;
    return 1.0 / (1.0 + q * q);
}

/// Finds the distance at which a ray of this unit direction enters the picture, diagonals. Twin: reference/rays.py:entry_distance.
fn entry_distance(direction: vec2f, rays: Rays) -> f32 {
    if (INSIDE) { return 0.0; }
    var at = 0.0;
    if (direction.x != 0.0) { at = max(at, min(-rays.light.x / direction.x, (rays.box.x - rays.light.x) / direction.x)); }
    if (direction.y != 0.0) { at = max(at, min(-rays.light.y / direction.y, (rays.box.y - rays.light.y) / direction.y)); }
    return at;
}

/// Finds a point's distance from the light, diagonals, and the number of its line. Twin: reference/rays.py:polar.
fn polar(p: vec2f, rays: Rays) -> vec2f {
    let d = p - rays.light;
    var turn = atan2(d.y, d.x) - rays.start;
    turn -= TURN * floor(turn / TURN);
    if (!INSIDE && turn > 0.5 * rays.span + 0.5 * TURN) { turn -= TURN; }
    return vec2f(length(d), turn * (f32(LINES) / rays.span) - 0.5);
}

/// Finds texture coordinates of a point's bands; the texture repeats its last line before the first and its first after the last.
/// at: `polar`. Twin: reference/rays.py:band_uv.
fn band_uv(at: vec2f, rays: Rays) -> vec2f {
    let row = clamp((at.x - rays.nearest) / rays.step - 1.0, 0.0, f32(RADII - 1u));
    return vec2f((at.y + 1.5) / f32(LINES + 2u), (row + 0.5) / f32(RADII));
}
