// The way back: each pixel finds its line and node, and fetches S with one bilinear sample.
// A workgroup serves one tile for one quadrant: each invocation has one coordinate on the quadrant's major axis, so that its
// way to the sums is looked up once, and runs along the minor axis. A tile that several quadrants share is dispatched
// once for each (SHARED), and each stores its own pixels.
override STRIP: u32 = 32u;    // pixels of an invocation
override DOWN: bool = false;  // the quadrant's major axis is y
override SHARED: bool = false;
override ADD: bool = false;   // add to what earlier lights gave
override BASE: bool = false;  // Listing 13-1: the pixel itself, unweighted
const LANES = 64u;
const NEAR = 12u;             // pixels around the light that take the direct sum
const TAPS = 64u;

struct Frame {
    size: vec2u,
    light: vec2f,             // in pixels
    diagonal: vec2f,          // x - y and x + y of the light
    scale: vec2f,             // 1 / size of the sums' texture
    base: vec4f,              // gain of the pixel itself; w: the source's apron in pixels
    ray: vec4f,               // density, lambda; z: weight of a tap that makes the sum of all exact for constant light
    gain: vec4f,
}

struct Tile {
    corner: vec2u,
    way: u32,                 // of the tile's first pixel on the major axis
    positive: u32,            // the quadrant lies right of the light, or below it
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var sums: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var layer: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var<storage, read> tiles: array<Tile>;
@group(0) @binding(5) var before: texture_2d<f32>;
@group(0) @binding(6) var source: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> ways: array<vec4f>; // at a major coordinate: row of the sums; line = y n + z

fn put(p: vec2u, sum: vec3f) { // pixels beyond the image are dropped by the store
    var out = sum;
    if (BASE) {
        out += frame.base.rgb * textureLoad(source, p + u32(frame.base.w), 0).rgb;
    }
    if (ADD) {
        out += textureLoad(before, p, 0).rgb;
    }
    textureStore(layer, p, vec4f(out, 1.0));
}

@compute @workgroup_size(LANES)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = tiles[group.x];
    let corner = tile.corner + vec2u(lane, 0u);
    let x = f32(corner.x) + 0.5;
    let y = f32(corner.y) + 0.5;
    var way = ways[tile.way + select(lane, 0u, DOWN)];
    for (var i = 0u; i < STRIP; i++) {
        let p = corner + vec2u(0u, i);
        if (DOWN) {
            way = ways[tile.way + i];
        }
        let line = way.y * select(y + f32(i), x, DOWN) + way.z;
        let place = (vec2f(line, way.x) + 0.5) * frame.scale;
        let sum = textureSampleLevel(sums, bilinear, place, 0.0).rgb;
        if (SHARED) {
            let q = vec2f(p) + 0.5;
            let down = (q.x - q.y - frame.diagonal.x) * (q.x + q.y - frame.diagonal.y) < 0.0;
            let positive = select(q.x >= frame.light.x, q.y >= frame.light.y, DOWN);
            if (down != DOWN || positive != (tile.positive == 1u)) {
                continue;
            }
        }
        put(p, sum);
    }
}

/// The few pixels around the light by the direct sum: there S varies faster than any grid.
@compute @workgroup_size(2 * NEAR, 1)
fn near(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = vec2i(floor(frame.light)) - i32(NEAR) + vec2i(i32(lane), i32(group.x));
    if (any(p < vec2i(0)) || any(p >= vec2i(frame.size))) {
        return;
    }
    let x = vec2f(p) + 0.5;
    let way = frame.ray.x * (x - frame.light);
    var sum = vec3f(0.0);
    for (var i = 0u; i < TAPS; i++) {
        let s = (f32(i) + 0.5) / f32(TAPS);
        let at = (x - s * way + frame.base.w) / vec2f(textureDimensions(source));
        sum += exp(-frame.ray.y * s) * textureSampleLevel(source, bilinear, at, 0.0).rgb;
    }
    put(vec2u(p), frame.gain.rgb * frame.ray.z * sum);
}
