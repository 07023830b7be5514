// The way back: each pixel finds its line and node, and fetches S with one bilinear sample.
// The host sorts tiles of TILE_WIDTH x STRIP pixels: `across` lies in the right or left quadrant, where a column has one
// node; `down` in the lower or upper quadrant, in one zone and with one size of step; `mixed` is any other. Selecting per pixel among the quadrants costs three times the fetch.
override STRIP: u32 = 8u;     // pixels of a column an invocation
override ZONES: u32 = 2u;     // 1..2
override ADD: bool = false;   // add to what earlier lights gave
override BASE: bool = false;  // Listing 13-1: the pixel itself, unweighted
const TILE_WIDTH = 32u;
const NEAR = 12u;             // pixels around the light that take the direct sum
const TAPS = 64u;

struct Quadrant {
    minor: vec4f,             // line = (n - x - y t) / (z + w t), with t, n the pixel's major and minor coordinate
    node: vec4f,              // node = min over pieces of x, y, z, plus the rates below; w: t where the far zone begins
    rate: vec4f,              // node index per pixel of t, by piece; w: texture row of node 0
    last: vec4f,              // x: last line; y, z: node = y + z t before node 1, a step that ends at a pixel's border
}

struct Frame {
    size: vec2u,
    light: vec2f,             // in pixels
    diagonal: vec2f,          // x - y and x + y of the light
    scale: vec2f,             // 1 / size of the sums' texture
    base: vec4f,              // gain of the pixel itself; w: the source's apron in pixels
    ray: vec4f,               // density, lambda; z: weight of a tap that makes the sum of all exact for constant light
    gain: vec4f,
    quadrants: array<Quadrant, 4>, // right, left, down, up
}

struct Tile {
    corner: vec2u,
    minor: vec4f,             // as a quadrant's; for `down` with the zone's stride
    node: vec4f,              // as a quadrant's; for `down` the row is node.x + rate.x t
    rate: vec4f,
    last: vec4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var sums: texture_2d<f32>;
@group(0) @binding(2) var bilinear: sampler;
@group(0) @binding(3) var layer: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var<storage, read> tiles: array<Tile>;
@group(0) @binding(5) var before: texture_2d<f32>;
@group(0) @binding(6) var source: texture_2d<f32>;

fn fetch(line: f32, row: f32) -> vec3f {
    return textureSampleLevel(sums, bilinear, (vec2f(line, row) + 0.5) * frame.scale, 0.0).rgb;
}

/// The texture row at t, and the factor of the line's index in its zone.
fn along(node: vec4f, rate: vec4f, last: vec4f, t: f32, positive: bool) -> vec2f {
    let k3 = node.xyz + rate.xyz * t;
    let k = rate.w + max(min(min(k3.x, k3.y), min(k3.z, last.y + last.z * t)), 0.0);
    if (ZONES == 1u) {
        return vec2f(k, 1.0);
    }
    let far = (t > node.w) == positive;
    return select(vec2f(k, 0.5), vec2f(k + 1.0, 1.0), far);
}

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

@compute @workgroup_size(TILE_WIDTH)
fn across(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = tiles[group.x];
    let corner = tile.corner + vec2u(lane, 0u);
    let t = f32(corner.x) + 0.5;
    let place = along(tile.node, tile.rate, tile.last, t, tile.minor.w > 0.0);
    let per = place.y / (tile.minor.z + tile.minor.w * t);
    let line = (f32(corner.y) + 0.5 - tile.minor.x - tile.minor.y * t) * per;
    for (var i = 0u; i < STRIP; i++) {
        put(corner + vec2u(0u, i), fetch(line + f32(i) * per, place.x));
    }
}

@compute @workgroup_size(TILE_WIDTH)
fn down(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = tiles[group.x];
    let corner = tile.corner + vec2u(lane, 0u);
    let n = f32(corner.x) + 0.5 - tile.minor.x;
    for (var i = 0u; i < STRIP; i++) {
        let t = f32(corner.y + i) + 0.5;
        let line = (n - tile.minor.y * t) / (tile.minor.z + tile.minor.w * t);
        put(corner + vec2u(0u, i), fetch(line, tile.node.x + tile.rate.x * t));
    }
}

fn choose(along_x: bool, positive: bool, right: vec4f, left: vec4f, down: vec4f, up: vec4f) -> vec4f {
    return select(select(up, down, positive), select(left, right, positive), along_x);
}

fn sum_at(p: vec2f) -> vec3f {
    let along_x = (p.x - p.y - frame.diagonal.x) * (p.x + p.y - frame.diagonal.y) >= 0.0;
    let t = select(p.y, p.x, along_x);
    let n = select(p.x, p.y, along_x);
    let positive = t >= select(frame.light.y, frame.light.x, along_x);
    let minor = choose(along_x, positive, frame.quadrants[0].minor, frame.quadrants[1].minor, frame.quadrants[2].minor, frame.quadrants[3].minor);
    let node = choose(along_x, positive, frame.quadrants[0].node, frame.quadrants[1].node, frame.quadrants[2].node, frame.quadrants[3].node);
    let rate = choose(along_x, positive, frame.quadrants[0].rate, frame.quadrants[1].rate, frame.quadrants[2].rate, frame.quadrants[3].rate);
    let last = choose(along_x, positive, frame.quadrants[0].last, frame.quadrants[1].last, frame.quadrants[2].last, frame.quadrants[3].last);
    let place = along(node, rate, last, t, positive);
    let line = clamp(place.y * (n - minor.x - minor.y * t) / max(minor.z + minor.w * t, 1e-20), 0.0, last.x);
    return fetch(line, place.x);
}

@compute @workgroup_size(TILE_WIDTH)
fn mixed(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let corner = tiles[group.x].corner + vec2u(lane, 0u);
    for (var i = 0u; i < STRIP; i++) {
        let p = corner + vec2u(0u, i);
        put(p, sum_at(vec2f(p) + 0.5));
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
