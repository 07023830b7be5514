// What a point light scatters into a ray where all of it is lit, up to each angle at the lamp: the mean over angles from the first block's
// begin on of phase function times transmittance. It is smooth, so that a small table of each frame serves all pixels at full resolution.
//! include "scatter/visibility/lamps.wgsl"

const LEAST_SINE = 1e-5;        // of where a ray is seen from its end
const FULL_SIDE = 128.0;        // of that table, texels

/// Evaluate phase function times transmittance at an angle at the lamp, beyond the way from the lamp to the eye itself, whose transmittance is
/// left out; 0 beyond the ray's end. eye, at: cosine and sine of the angle at the eye, and of that at the lamp; away: m between them.
/// Twin: reference/visibility_lamps.py:scattered_at.
fn scattered_at(eye: vec2f, at: vec2f, away: f32) -> vec3f {
    let sine = at.y * eye.x + at.x * eye.y;
    let way = away * (at.y + eye.y) / max(sine, LEAST_SINE);
    let scattered = phase(at.x * eye.x - at.y * eye.y, light.lobes) * exp(-frame.sigma_t * max(way - away, 0.0));
    return select(vec3f(0.0), scattered, sine > LEAST_SINE);
}
