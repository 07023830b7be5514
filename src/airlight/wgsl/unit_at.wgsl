/// Computes the unit vector at an angle of up to 1000 radians, its cosine and sine, to 2e-7: those of a driver may be off by 2^-11.
/// Twin: reference/angles.py:unit_at.
fn unit_at(angle: f32) -> vec2f {
    // Take off the nearest multiple of pi / 2, in two parts, the first of which has few digits
    let quarters = round(angle * 0.63661977);
    let r = (angle - quarters * 1.5703125) - quarters * 4.8382679e-4;
    // Sum Taylor's series of both
    let q = r * r;
    let c = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0)));
    let s = r * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))));
    // Turn by the quarters
    let turns = i32(quarters);
    let turned = select(vec2f(c, s), vec2f(-s, c), (turns & 1) == 1);
    return select(turned, -turned, (turns & 2) == 2);
}
