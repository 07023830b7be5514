// Concentric rectangular bands (GPU Gems 3, 13.8): one new sample a pixel, from the light outwards.
//
//     S_c = ((c - 1) S_{c-1} + I) / c
//
// is the mean of the ray's light up to ring c (density 1, decay 1). In general a ring keeps a moment M of the ray's window for each power
// p of the fitted weight (moments.py): M(c) = g M(c-1) + k (I(x) - (1-D)^(p+1) I(far end)), g = (1 - 1/c)^(p+1), k = (1 - g) / ((p+1) D).
// M(c-1) lies between two pixels of the nearer ring. A dispatch does a ring; on it four sides (right, left, down, up) keep their moments
// for themselves, a lane for each pixel across. Where a ray enters the image it starts from the direct sum.
// Twin: reference/bands.py:bands.
//! include "wgsl/half.wgsl"
override POWERS: u32 = 1u;
override ODD: bool = false;   // of two dispatches one reads the first half of state and counter, the other the second
override ADD: bool = false;   // add to what earlier lights gave
override FAR_END: bool = false; // whether the far end counts

struct Frame {
    light: vec2f,             // from the corner of its pixel
    density: f32,
    apron: i32,
    home: vec2i,              // the light's pixel
    size: vec2i,
    first: i32,               // the first ring that meets the image
    taps: u32,                // of the direct sum with which a ray enters
    lanes: i32,               // the longer side
    c: vec4f,                 // of the powers, times density
    start: vec4f,             // M over I on the light's pixel
    gain: vec4f,
}

@group(0) @binding(0) var<storage, read> frame: Frame; // lavapipe compiles anew for each value of a uniform that ends a loop
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var layer: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var before: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> factors: array<vec4f>; // of ring, side, power: g, k to the band's border; g, k to its middle
@group(0) @binding(6) var<storage, read> enters: array<vec4f>;  // of a tap: its position s; weights of the powers
@group(0) @binding(7) var<storage, read> parts: array<f32>;     // of the powers: (1 - D)^(p+1)
@group(0) @binding(8) var<storage, read_write> state: array<f32>;
@group(0) @binding(9) var<storage, read_write> counter: array<i32, 2>;

/// Indexes the state: red of power k of a lane. odd: the half that odd rings write. Twin: reference/bands.py:state_index.
fn state_index(odd: bool, side: i32, lane: i32, k: u32) -> i32 {
    return 3 * (((select(0, 4, odd) + side) * frame.lanes + lane) * i32(POWERS) + i32(k));
}

/// Loads the moment of power k that the ring before left on a lane.
fn load_moment(side: i32, lane: i32, k: u32) -> vec3f {
    let i = state_index(ODD, side, lane, k);
    return vec3f(state[i], state[i + 1], state[i + 2]);
}

/// Samples the source; x in its pixels without the apron.
fn source_at(x: vec2f) -> vec3f {
    return textureSampleLevel(source, bilinear, (x + f32(frame.apron)) / vec2f(textureDimensions(source)), 0.0).rgb;
}

/// Begins at the first ring that meets the image.
@compute @workgroup_size(1)
fn reset() {
    counter[0] = frame.first;
}

/// Moves the moments of a pixel on to its ring, and writes its sum.
@compute @workgroup_size(64)
fn ring(@builtin(global_invocation_id) id: vec3u) {
    let ring = counter[select(0, 1, ODD)];
    if (id.x == 0u) {
        counter[select(1, 0, ODD)] = ring + 1;
    }
    // Find the side and the lane, and the pixel there
    let n = i32(id.x);
    let side = select(n / frame.size.y, 2 + (n - 2 * frame.size.y) / frame.size.x, n >= 2 * frame.size.y);
    if (side > 3) {
        return;
    }
    let across = side < 2;    // the major axis is x
    let sign = select(1, -1, (side & 1) == 1);
    let lane = select((n - 2 * frame.size.y) % frame.size.x, n % frame.size.y, across);
    let major = select(frame.home.y, frame.home.x, across) + sign * ring;
    let length = select(frame.size.x, frame.size.y, across);
    let home = select(frame.home.x, frame.home.y, across);
    let away = abs(lane - home);
    if (major < 0 || major >= select(frame.size.y, frame.size.x, across) || away > ring) {
        return;
    }
    let p = select(vec2i(lane, major), vec2i(major, lane), across);
    let from_light = vec2f(p - frame.home) + 0.5 - frame.light;
    // Take the new sample, and the one that leaves the window
    let own = textureLoad(source, p + frame.apron, 0).rgb;
    let far_end = select(vec3f(0.0), source_at(vec2f(p) + 0.5 - frame.density * from_light), FAR_END);
    let u = f32(sign) * select(from_light.y, from_light.x, across);
    let shift = select(from_light.x, from_light.y, across) / u;
    let position = f32(lane) - shift; // across, on the ring before
    let behind = major - sign;
    let enters_here = behind < 0 || behind >= select(frame.size.y, frame.size.x, across) || position < 0.0 || position > f32(length - 1);
    // the nearer ring's pixels on either side, exact where the light is far
    let low_lane = clamp(lane + i32(floor(-shift)), max(0, home - ring + 1), min(length - 1, home + ring - 1));
    let high_lane = clamp(lane + i32(floor(-shift)) + 1, max(0, home - ring + 1), min(length - 1, home + ring - 1));
    let part = fract(-shift);
    let taps = frame.taps;
    var sum = vec3f(0.0);
    for (var k = 0u; k < POWERS; k++) {
        // Step the moment of power k from the ring before to this one
        let f = factors[u32((ring - frame.first) * 4 + side) * POWERS + k];
        var m = vec3f(0.0);
        var middle = vec3f(0.0);
        if (ring == 0) {
            m = frame.start[k] * own;
            middle = m;
        } else if (enters_here) {
            for (var t = 0u; t < taps; t++) {
                m += enters[t][k + 1u] * source_at(vec2f(p) + 0.5 - enters[t].x * from_light);
            }
            middle = m;
        } else {
            let nearer = mix(load_moment(side, low_lane, k), load_moment(side, high_lane, k), part);
            let fresh = own - parts[k] * far_end;
            m = f.x * nearer + f.y * fresh;
            middle = f.z * nearer + f.w * fresh;
        }
        let i = state_index(!ODD, side, lane, k);
        state[i] = m.x;
        state[i + 1] = m.y;
        state[i + 2] = m.z;
        sum += frame.c[k] * middle;
    }
    // corners lie on two sides, the light's pixel on four: one of them writes
    if (select((away < ring), (ring > 0 || side == 0), across)) {
        var out = frame.gain.rgb * max(sum, vec3f(0.0));
        if (ADD) {
            out += textureLoad(before, p, 0).rgb;
        }
        textureStore(layer, p, vec4f(nearest_half(out), 1.0));
    }
}
