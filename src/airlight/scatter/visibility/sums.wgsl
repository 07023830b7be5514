// Sums of shares of light along the rays of a table of visibility, four rays at once. V = C / U: U sums the weights of blocks, C those of
// what is lit of them. A ray ends at the surface that is seen there, but pixels beside it may see farther: what they are given is the ray's
// visibility before its surface carried on through what is solid, and behind it the true sum again.
override COLOURS: bool = false; // extinction differs between red, green and blue
override WARY: bool = false;    // what is lit of a ray's last block counts as before its surface by no more than the ray was lit till then

const ROUNDING = 0.07;          // of a lit share, by samples
const HALF_SAMPLE = 0.0333;     // share, that counts of fewer samples lack on the mean where some are lit
const LEAST_SHARE = 0.06;       // of a block before a surface

struct Sums {
    surface: vec4f,             // where rays end, in the unit of blocks' ends
    u: vec4f,
    lit: vec4f,                 // C, true
    stored: vec4f,              // C, as pixels beside read it
    lengths: vec4f,             // integral as U, times the optical length
    lit_lengths: vec4f,
    stored_lengths: vec4f,
    before: vec4f,              // running visibility
}

/// Begin sums of rays that end at such surfaces. Twin: reference/visibility.py:begin_sums.
fn begin_sums(surface: vec4f) -> Sums {
    let zero = vec4f(0.0);
    return Sums(surface, vec4f(1e-30), zero, zero, zero, zero, zero, vec4f(-1.0));
}

/// Add a block, from `begin` on and so wide, in which such shares of four rays are lit. weight: of the block; middle: its optical length;
/// strength: factor of the light, that U does not hold. Twin: reference/visibility.py:add_weighed.
fn add_weighed(sums: Sums, share: vec4f, weight: vec4f, middle: vec4f, strength: vec4f, begin: f32, wide: f32) -> Sums {
    var out = sums;
    out.u += weight;
    let whole = weight * strength;
    let added = whole * share;
    out.lit += added;
    // Carry on visibility behind the ray's own surface
    let part = clamp((sums.surface - begin) / wide, vec4f(0.0), vec4f(1.0));
    let ahead = part >= vec4f(1.0);
    let behind = part <= vec4f(0.0);
    let known = select(sums.before, share, sums.before < vec4f(0.0));
    let some = select(vec4f(0.0), vec4f(HALF_SAMPLE), share > vec4f(0.0));
    let own = min((share + some) / max(part, vec4f(LEAST_SHARE)), vec4f(1.0));
    let before_surface = select(own, min(own, known), WARY);
    let held = select(known, before_surface, !behind & (share <= part + ROUNDING));
    let returns = ahead | (behind & (share > vec4f(0.0)));
    out.stored = select(sums.stored + whole * held, out.lit, returns);
    out.surface = select(sums.surface, vec4f(NO_SURFACE), returns & behind);
    let met = select(known, 0.5 * (known + share), ahead);
    out.before = select(sums.before, met, strength > vec4f(0.0));
    if (COLOURS) {
        out.lengths += weight * middle;
        out.lit_lengths += added * middle;
        out.stored_lengths = select(sums.stored_lengths + whole * held * middle, out.lit_lengths, returns);
    }
    return out;
}

/// Find dV / d sigma times the spread of the extinctions. Twin: reference/visibility.py:slopes.
fn slopes(sums: Sums) -> vec4f {
    return grid.spread * (sums.stored / sums.u * sums.lengths - sums.stored_lengths) / sums.u;
}
