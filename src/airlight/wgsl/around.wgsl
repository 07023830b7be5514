// The factor of a light's cookie over the angle around it in the picture. Who includes this declares `around`, array<vec4f>, the table of
// lights/around.py:around_table: factors of AROUND directions, then the means of pairs of them, and so on down to one.
const AROUND = 4096u;         // a power of 2
const AROUND_LEVELS = 12.0;   // above the finest
const AROUND_TURN = 6.283185307179586;

/// Finds at which part of a turn, clockwise from straight up, a pixel lies that is d pixels from the light, and how much of a turn it covers.
/// Twin: reference/around.py:around_span.
fn around_span(d: vec2f) -> vec2f {
    let distance = max(length(d), 1e-6);
    let turn = atan2(select(d.x, 0.0, distance <= 1e-6), select(-d.y, 1.0, distance <= 1e-6)) / AROUND_TURN;
    return vec2f(turn - floor(turn), min(1.0 / (AROUND_TURN * distance), 1.0));
}

/// Interpolates the means of a level, 0 the finest, between their middles, all the way round. Twin: reference/around.py:around_at.
fn around_at(level: u32, turn: f32) -> vec3f {
    let count = AROUND >> level;
    let at = turn * f32(count) - 0.5;
    let whole = floor(at);
    let first = 2u * AROUND - 2u * count;
    let i = u32(i32(whole)) & (count - 1u);
    let a = around[first + i].rgb;
    return a + (at - whole) * (around[first + ((i + 1u) & (count - 1u))].rgb - a);
}

/// Averages the factors over what a pixel covers: between the levels whose steps are as wide. Twin: reference/around.py:around_factor.
fn around_factor(span: vec2f) -> vec3f {
    let level = clamp(log2(f32(AROUND) * span.y), 0.0, AROUND_LEVELS);
    let low = floor(level);
    let a = around_at(u32(low), span.x);
    return a + (level - low) * (around_at(u32(min(low + 1.0, AROUND_LEVELS)), span.x) - a);
}
