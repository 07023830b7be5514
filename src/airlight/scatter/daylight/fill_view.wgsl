// Fills the table of view rays: what they gather on their way from an eye at one altitude, for a sun at one elevation. A thread a ray.
//! include "scatter/daylight/coordinates.wgsl"
//! include "scatter/daylight/phases.wgsl"
//! include "wgsl/half.wgsl"
const STEPS = vec2f(1.0, 12.0); // of the march between two nodes, least and most
const RISE = 1500.0;            // m that a step rises or falls at most
const REACH = 30000.0;          // m, the longest step
const LEAST_SHARE = 1e-4;        // of light that is not the aerosol's, over the aerosol's without its phase function
const MOST_SHARE = 100.0;
const NEARBY = 8u;              // nodes with one share, since light grows fast from each to the next
const SUNS = 12u;               // slots of tables of further orders
const HEIGHT_NODES = 20u;
const ELEVATION_NODES = 48u;
const AZIMUTH_NODES = 17u;

struct Fill {
    rayleigh: vec4f,            // 1/m, of each wavelength: scattering
    aerosol: vec4f,             // scattering
    extinct: vec4f,             // extinction of the aerosol
    ozone: vec4f,
    to_channels: mat4x3f,       // from wavelengths to linear Rec. 709
    height: f32,                // m, of the eye
    mu_sun: f32,
    sun: f32,                   // degrees
    reach: f32,                 // degrees by which the sun may stand elsewhere along a ray
    near: f32,                  // m: way_coordinate
    dense: f32,
    scale: f32,                 // of what is stored
    columns: u32,               // of the table of optical depth
    rows: u32,
    sun_row: u32,               // of the table, where the sun is, or the horizon below it
    anisotropy: f32,            // of the aerosol
    broad: vec3f,               // view_table.wgsl
}

struct Sums {                   // what a ray gathers up to a node: radiance in channels
    air: vec3f,                 // of sunlight that Rayleigh's air scatters
    aerosol: vec3f,             // of sunlight that the aerosol scatters, over its phase function
    before: vec3f,              // of light scattered before
}

struct ViewRay {
    mu: f32,
    cosine: f32,                // between ray and sun
    sine2: f32,                 // its sine, squared
    azimuth: f32,               // radians
    first: f32,                 // m, where the earth's shadow begins and ends
    last: f32,
}

@group(0) @binding(0) var<uniform> fill: Fill;
@group(0) @binding(1) var<storage, read> rays: array<ViewRay>;
@group(0) @binding(2) var<storage, read> depths: array<vec4f>;
@group(0) @binding(3) var<storage, read> further: array<vec4f>; // logarithms of what is scattered before: sun, height, elevation, azimuth, phase
@group(0) @binding(4) var<storage, read_write> gathered: array<Sums>; // way, elevation, azimuth
@group(0) @binding(5) var once: texture_storage_3d<rgba16float, write>;
@group(0) @binding(6) var all_light: texture_storage_3d<rgba16float, write>;
@group(0) @binding(7) var through: texture_storage_2d<rgba16float, write>;

struct Turned {
    rayleigh: vec4f,
    aerosol: vec4f,
}

/// Read the transmittance from a height to the sun.
fn sunlight(height: f32, mu_sun: f32) -> vec4f {
    let at = depth_table_position(height, mu_sun) * vec2f(f32(fill.columns - 1u), f32(fill.rows - 1u));
    let first = min(vec2u(at), vec2u(fill.columns - 2u, fill.rows - 2u));
    let part = at - vec2f(first);
    let i = first.y * fill.columns + first.x;
    let low = mix(depths[i], depths[i + 1u], part.x);
    let high = mix(depths[i + fill.columns], depths[i + fill.columns + 1u], part.x);
    return exp(-mix(low, high, part.y));
}

/// Add one of the 16 nodes around a place of the table of further orders, by its share. part: of the place, between its nodes.
fn with_node(sum: Turned, i: u32, corner: vec3u, which: u32, part: vec4f) -> Turned {
    let bit = vec4u(i & 1u, (i >> 1u) & 1u, (i >> 2u) & 1u, i >> 3u);
    let share = select(1.0 - part, part, bit == vec4u(1u));
    let weight = share.x * share.y * share.z * share.w;
    let node = corner + bit.xyz;
    let index = 2u * (((((which + bit.w) % SUNS) * HEIGHT_NODES + node.x) * ELEVATION_NODES + node.y) * AZIMUTH_NODES + node.z);
    return Turned(sum.rayleigh + weight * further[index], sum.aerosol + weight * further[index + 1u]);
}

/// Read what a metre of air that scatters 1/m turns into a direction of light that was scattered before, for each phase.
fn scattered_before(height: f32, elevation: f32, azimuth: f32, sun: f32) -> Turned {
    let near = sun_position(clamp(sun, fill.sun - fill.reach, fill.sun + fill.reach));
    let at = orders_position(height, elevation, azimuth);
    let which = min(u32(near), 68u);
    let corner = min(vec3u(at), vec3u(HEIGHT_NODES - 2u, ELEVATION_NODES - 2u, AZIMUTH_NODES - 2u));
    let part = vec4f(at - vec3f(corner), near - f32(which));
    var sum = Turned(vec4f(0.0), vec4f(0.0));
    //! each i of 16: sum = with_node(sum, i, corner, which, part);
    return Turned(exp(sum.rayleigh), exp(sum.aerosol));
}

/// Evaluate where what a ray gathers up to node k of its way is kept. Twin: reference/daylight_view.py:node_index.
fn node_index(k: u32, row: u32, column: u32) -> u32 {
    return (k * ELEVATIONS + row) * AZIMUTHS + column;
}

/// March along a ray, and write what it gathered up to each node.
@compute @workgroup_size(8, 8)
fn fill_view(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= AZIMUTHS || id.y >= ELEVATIONS) { return; }
    let ray = rays[id.y * AZIMUTHS + id.x];
    let phase = 3.0 / (16.0 * HALF_TURN) * (1.0 + ray.cosine * ray.cosine); // of Rayleigh's air: broad, so that the table may hold it
    var depth = vec4f(0.0);
    var rayleigh = vec4f(0.0);
    var aerosol = vec4f(0.0);
    var multiple = vec4f(0.0);
    var start = 0.0;
    var ground = way_to_ground(fill.height, ray.mu);
    if (id.y >= BELOW || ground == 0.0) { ground = NO_END; }
    var grounded = array<vec4f, 4>(); // what is gathered up to the ground: rayleigh, aerosol, multiple, depth
    for (var k = 0u; k < DISTANCES; k++) {
        if (k == DISTANCES - 1u && start > ground) { // the last node is the end of the ray
            rayleigh = grounded[0];
            aerosol = grounded[1];
            multiple = grounded[2];
            depth = grounded[3];
        }
        gathered[node_index(k, id.y, id.x)] =
            Sums(fill.to_channels * (phase * rayleigh), fill.to_channels * aerosol, fill.to_channels * multiple);
        if (id.x == 0u) { textureStore(through, vec2u(k, id.y), vec4f(nearest_half(fill.to_channels * exp(-depth)), 1.0)); }
        let middle = way_at(f32(k) + 0.5, fill.near, fill.dense);
        let sun = degrees(arc_sine(sun_cosine_along(fill.height, ray.mu, fill.mu_sun, ray.cosine, middle)));
        let elevation = arc_sine(view_cosine_along(fill.height, ray.mu, middle));
        let turned = scattered_before(max(height_along(fill.height, ray.mu, middle), 0.0), elevation, ray.azimuth, sun);
        let next = way_at(f32(k) + 1.0, fill.near, fill.dense);
        let low = height_along(fill.height, ray.mu, start);
        let high = height_along(fill.height, ray.mu, next);
        let wanted = select(ceil(max(abs(high - low) / RISE, (next - start) / REACH)), 0.0, min(low, high) > TOP_HEIGHT);
        let stride = (next - start) / clamp(wanted, STEPS.x, STEPS.y);
        while (start < next) {
            var end = select(start + stride, next, start + 1.5 * stride > next);
            if (start < ground) { end = min(end, ground); }
            let height = max(height_along(fill.height, ray.mu, 0.5 * (start + end)), 0.0);
            let density = select(air_density(height), vec3f(0.0), height > TOP_HEIGHT);
            let extinction = density.x * fill.rayleigh + density.y * fill.extinct + density.z * fill.ozone;
            let left = exp(-depth);
            let whole = (end - start) * left * part_left(extinction * (end - start));
            // what lies before the earth's shadow, and behind it
            let enters = clamp(ray.first, start, end);
            let leaves = max(clamp(ray.last, start, end), enters);
            let lit = (enters - start) * left * part_left(extinction * (enters - start))
                + (end - leaves) * left * exp(-extinction * (leaves - start)) * part_left(extinction * (end - leaves));
            let seen = select(0.5 * (leaves + end), 0.5 * (start + enters), enters - start > end - leaves);
            let there = max(height_along(fill.height, ray.mu, seen), 0.0);
            let light = lit * sunlight(min(there, TOP_HEIGHT), sun_cosine_along(fill.height, ray.mu, fill.mu_sun, ray.cosine, seen));
            rayleigh += density.x * fill.rayleigh * light;
            aerosol += density.y * fill.aerosol * light;
            multiple += whole * (density.x * fill.rayleigh * turned.rayleigh + density.y * fill.aerosol * turned.aerosol);
            depth += extinction * (end - start);
            if (end == ground) { grounded = array<vec4f, 4>(rayleigh, aerosol, multiple, depth); }
            start = end;
        }
    }
}

/// Evaluate light that is no aerosol's over the aerosol's without its phase function and times broad, as luminances.
/// Twin: reference/daylight_view.py:broad_share.
fn broad_share(rest: vec3f, aerosol: vec3f, broad: vec3f) -> f32 {
    let luminance = vec3f(0.2126, 0.7152, 0.0722);
    let sharp = dot(luminance, broad * aerosol);
    return select(MOST_SHARE, clamp(dot(luminance, rest) / sharp, LEAST_SHARE, MOST_SHARE), sharp > 0.0);
}

/// Write the nodes of the table: quotients of light by the aerosol's phase function and what else there is towards the sun. That share goes
/// evenly, as its logarithm, to the last node, so that products of what is read between nodes are as good as the nodes.
@compute @workgroup_size(8, 8)
fn fold_view(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= AZIMUTHS || id.y >= ELEVATIONS) { return; }
    let ray = rays[id.y * AZIMUTHS + id.x];
    let peak = aerosol_phase(ray.cosine, ray.sine2, fill.anisotropy);
    let own = gathered[node_index(id.z, id.y, id.x)];
    let first = gathered[node_index(1u, fill.sun_row, 0u)];
    let last = gathered[node_index(DISTANCES - 1u, fill.sun_row, 0u)];
    let part = f32(max(id.z, NEARBY) - NEARBY) / f32(DISTANCES - 1u - NEARBY);
    let nearby = vec2f(broad_share(first.air, first.aerosol, fill.broad), broad_share(first.air + first.before, first.aerosol, fill.broad));
    let far = vec2f(broad_share(last.air, last.aerosol, fill.broad), broad_share(last.air + last.before, last.aerosol, fill.broad));
    let share = pow(nearby, vec2f(1.0 - part)) * pow(far, vec2f(part));
    let single = own.air + peak * own.aerosol;
    let at = vec3u(id.z, id.xy);
    let kept = nearest_half(vec3f(1.0 / share, 0.0)).xy;
    textureStore(once, at, vec4f(nearest_half(fill.scale * single / (fill.broad + kept.x * peak)), kept.x));
    textureStore(all_light, at, vec4f(nearest_half(fill.scale * (single + own.before) / (fill.broad + kept.y * peak)), kept.y));
}
