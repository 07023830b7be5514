// Concentric rectangular bands (13.8): a dispatch a ring, from the light outwards; each ring starts from the one before. On a ring four
// sides (right, left, down, up) keep their moments for themselves, a lane for each pixel across. Twin: reference/bands.py.
//! include "gpu/half.wgsl"
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
@group(0) @binding(6) var<storage, read> enters: array<vec4f>;  // of a tap: its place s; weights of the powers
@group(0) @binding(7) var<storage, read> parts: array<f32>;     // of the powers: (1 - D)^(p+1)
@group(0) @binding(8) var<storage, read_write> state: array<f32>;
@group(0) @binding(9) var<storage, read_write> counter: array<i32, 2>;

fn cell(odd: bool, side: i32, lane: i32, k: u32) -> i32 {
    return 3 * (((select(0, 4, odd) + side) * frame.lanes + lane) * i32(POWERS) + i32(k));
}

fn kept(side: i32, lane: i32, k: u32) -> vec3f {
    let i = cell(ODD, side, lane, k);
    return vec3f(state[i], state[i + 1], state[i + 2]);
}

fn light_at(x: vec2f) -> vec3f {
    return textureSampleLevel(source, bilinear, (x + f32(frame.apron)) / vec2f(textureDimensions(source)), 0.0).rgb;
}

@compute @workgroup_size(1)
fn reset() {
    counter[0] = frame.first;
}

@compute @workgroup_size(64)
fn ring(@builtin(global_invocation_id) id: vec3u) {
    let ring = counter[select(0, 1, ODD)];
    if (id.x == 0u) {
        counter[select(1, 0, ODD)] = ring + 1;
    }
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
    let way = vec2f(p - frame.home) + 0.5 - frame.light;
    let own = textureLoad(source, p + frame.apron, 0).rgb;
    let far_end = select(vec3f(0.0), light_at(vec2f(p) + 0.5 - frame.density * way), FAR_END);
    let u = f32(sign) * select(way.y, way.x, across);
    let shift = select(way.x, way.y, across) / u;
    var place = f32(lane) - shift;
    let behind = major - sign;
    let enters_here = behind < 0 || behind >= select(frame.size.y, frame.size.x, across) || place < 0.0 || place > f32(length - 1);
    // the nearer ring's pixels on either side, exact where the light is far
    let low_lane = clamp(lane + i32(floor(-shift)), max(0, home - ring + 1), min(length - 1, home + ring - 1));
    let high_lane = clamp(lane + i32(floor(-shift)) + 1, max(0, home - ring + 1), min(length - 1, home + ring - 1));
    let part = fract(-shift);
    let taps = frame.taps;
    var sum = vec3f(0.0);
    for (var k = 0u; k < POWERS; k++) {
        let f = factors[u32((ring - frame.first) * 4 + side) * POWERS + k];
        var m = vec3f(0.0);
        var middle = vec3f(0.0);
        if (ring == 0) {
            m = frame.start[k] * own;
            middle = m;
        } else if (enters_here) {
            for (var t = 0u; t < taps; t++) {
                m += enters[t][k + 1u] * light_at(vec2f(p) + 0.5 - enters[t].x * way);
            }
            middle = m;
        } else {
            let nearer = mix(kept(side, low_lane, k), kept(side, high_lane, k), part);
            let fresh = own - parts[k] * far_end;
            m = f.x * nearer + f.y * fresh;
            middle = f.z * nearer + f.w * fresh;
        }
        let i = cell(!ODD, side, lane, k);
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
