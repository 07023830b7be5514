// Geometry of rays through a round atmosphere, its densities, and where its tables hold them. Lengths in m, heights above the ground.
const GROUND_RADIUS = 6360000.0;
const TOP_HEIGHT = 100000.0;
const LEVEL_TO_TOP = 1132254.3883774055; // from the ground's horizon to the end of the air
const LEAST_SQUARE = 1.0; // m2: of the distance to the earth's centre
const HALF_TURN = 3.14159265358979;

/// Evaluate the distance to the earth's centre, m, t m along a ray that leaves a height under a cosine mu.
/// Twin: reference/daylight.py:radius_along.
fn radius_along(height: f32, mu: f32, t: f32) -> f32 {
    let radius = GROUND_RADIUS + height;
    return sqrt(max(radius * radius + t * (2.0 * radius * mu + t), LEAST_SQUARE));
}

/// Evaluate the height, m, t m along a ray, without taking large numbers from each other. Twin: reference/daylight.py:height_along.
fn height_along(height: f32, mu: f32, t: f32) -> f32 {
    let radius = GROUND_RADIUS + height;
    let rise = t * (2.0 * radius * mu + t);
    return height + rise / (radius_along(height, mu, t) + radius);
}

/// Evaluate the cosine between a ray and the vertical of the point t m along it. Twin: reference/daylight.py:view_cosine_along.
fn view_cosine_along(height: f32, mu: f32, t: f32) -> f32 {
    return clamp(((GROUND_RADIUS + height) * mu + t) / radius_along(height, mu, t), -1.0, 1.0);
}

/// Evaluate the cosine between the sun and the vertical of the point t m along a ray. mu_sun: at its start; cosine: between ray and sun.
/// Twin: reference/daylight.py:sun_cosine_along.
fn sun_cosine_along(height: f32, mu: f32, mu_sun: f32, cosine: f32, t: f32) -> f32 {
    return clamp(((GROUND_RADIUS + height) * mu_sun + t * cosine) / radius_along(height, mu, t), -1.0, 1.0);
}

/// Evaluate the way, m, from a height within the air to its end, the ground left out of account.
/// Twin: reference/daylight.py:distance_to_top.
fn distance_to_top(height: f32, mu: f32) -> f32 {
    let along = (GROUND_RADIUS + height) * mu;
    let above = max((TOP_HEIGHT - height) * (TOP_HEIGHT + 2.0 * GROUND_RADIUS + height), 0.0);
    let root = sqrt(along * along + above);
    return select(root - along, above / max(root + along, 1.0), along > 0.0); // of two forms the one that does not cancel
}

/// Evaluate the way, m, from a height to the ground; 0 for rays that miss it. Twin: reference/daylight_view.py:way_to_ground.
fn way_to_ground(height: f32, mu: f32) -> f32 {
    let along = (GROUND_RADIUS + height) * mu;
    let clear = height * (2.0 * GROUND_RADIUS + height);
    let squared = along * along - clear;
    if (along >= 0.0 || squared < 0.0) { return 0.0; }
    return clear / (sqrt(squared) - along);
}

/// Evaluate the densities of Rayleigh's air, the aerosol and ozone at a height. Twin: reference/daylight.py:air_density.
fn air_density(height: f32) -> vec3f {
    let h = max(height, 0.0);
    return vec3f(exp(-h / 8000.0), exp(-h / 1200.0), max(1.0 - abs(h - 25000.0) / 15000.0, 0.0));
}

/// Evaluate where in the table of optical depth, 0 to 1 along cosine and height, a ray lies.
/// Twin: reference/daylight.py:depth_table_position.
fn depth_table_position(height: f32, mu: f32) -> vec2f {
    let horizon = sqrt(max(height * (2.0 * GROUND_RADIUS + height), 0.0));
    let least = TOP_HEIGHT - height;
    let most = horizon + LEVEL_TO_TOP;
    return clamp(vec2f((distance_to_top(height, mu) - least) / (most - least), horizon / LEVEL_TO_TOP), vec2f(0.0), vec2f(1.0));
}

/// Evaluate where in the table of further orders, in nodes from 0, a direction at a height lies. elevation, azimuth: radians; the azimuth
/// counts from the sun's, 0 to half a turn. Twin: reference/daylight.py:orders_position.
fn orders_position(height: f32, elevation: f32, azimuth: f32) -> vec3f {
    let u = pow(clamp(abs(elevation) / (0.5 * HALF_TURN), 0.0, 1.0), 1.0 / 1.7);
    let x = sqrt(sqrt(clamp(height / TOP_HEIGHT, 0.0, 1.0)));
    return vec3f(x * 19.0, (select(u, -u, elevation < 0.0) + 1.0) * 23.5, abs(azimuth) / HALF_TURN * 16.0);
}

/// Evaluate the angle, radians, whose sine is x, to 3e-7: a driver's own may be off by more than the horizon is wide. Abramowitz and Stegun
/// 1964, 4.4.46. Twin: reference/daylight_view.py:arc_sine.
fn arc_sine(x: f32) -> f32 {
    let a = min(abs(x), 1.0);
    let upper = 0.0308918810 + a * (-0.0170881256 + a * (0.0066700901 - a * 0.0012624911));
    let rest = 1.5707963050 + a * (-0.2145988016 + a * (0.0889789874 + a * (-0.0501743046 + a * upper)));
    return sign(x) * (0.5 * HALF_TURN - sqrt(1.0 - a) * rest);
}

/// Evaluate where among the suns that are solved, from 0, a sun at an elevation, degrees, lies: they stand 2 degrees apart, and 1 between
/// -10 and 8. Twin: reference/daylight_view.py:sun_position.
fn sun_position(elevation: f32) -> f32 {
    return 0.5 * (min(elevation, -10.0) + 30.0) + clamp(elevation + 10.0, 0.0, 18.0) + 0.5 * max(elevation - 8.0, 0.0);
}

/// Evaluate the part (1 - e^-x) / x of what a step sends out that reaches its start, x its optical depth.
/// Twin: reference/daylight_view.py:part_left.
fn part_left(x: vec4f) -> vec4f {
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)));
    return select((1.0 - exp(-x)) / max(x, vec4f(1e-6)), series, x < vec4f(0.2));
}
