// One light's rays: the share of emitters on the way from the light along lines of equal angle, what of it stands out against the means
// over neighbouring lines, and what of that a pixel is given. Twins: the functions of the same names in reference/look.py.
override INSIDE: bool = true; // the light lies in the picture: its lines go all the way round
const LINES = 1024u;          // twins of these: look/grid.py, reference/look.py
const RADII = 128u;
const STEPS = 4u;
const COARSE = 4u;            // lines that the wide means take together
const NEAR = 0.15;            // diagonals
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

fn smooth_step(x: f32, low: f32, high: f32) -> f32 {
    let t = clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// Finds the emission of a pixel of luminance y, 0..1.
fn emission(y: f32, rays: Rays) -> f32 {
    return smooth_step(log(max(y, 1e-5) / rays.surroundings) / rays.tone_span, EMITS.x, EMITS.y);
}

/// Weighs an emitter by its distance.
fn nearness_weight(distance: f32) -> f32 {
    let q = distance / NEAR;
    return 1.0 / (1.0 + q * q);
}

/// Finds the distance at which a ray of this unit direction enters the picture.
fn entry(direction: vec2f, rays: Rays) -> f32 {
    if (INSIDE) { return 0.0; }
    var at = 0.0;
    if (direction.x != 0.0) { at = max(at, min(-rays.light.x / direction.x, (rays.box.x - rays.light.x) / direction.x)); }
    if (direction.y != 0.0) { at = max(at, min(-rays.light.y / direction.y, (rays.box.y - rays.light.y) / direction.y)); }
    return at;
}

/// Finds a point's distance from the light and the number of its line.
fn polar(p: vec2f, rays: Rays) -> vec2f {
    let d = p - rays.light;
    var turn = atan2(d.y, d.x) - rays.start;
    turn -= TURN * floor(turn / TURN);
    if (!INSIDE && turn > 0.5 * rays.span + 0.5 * TURN) { turn -= TURN; }
    return vec2f(length(d), turn * (f32(LINES) / rays.span) - 0.5);
}

/// Finds the place of a point's bands in their texture, which repeats its last line before the first and its first after the last.
fn band_place(at: vec2f, rays: Rays) -> vec2f {
    let row = clamp((at.x - rays.nearest) / rays.step - 1.0, 0.0, f32(RADII - 1u));
    return vec2f((at.y + 1.5) / f32(LINES + 2u), (row + 0.5) / f32(RADII));
}
