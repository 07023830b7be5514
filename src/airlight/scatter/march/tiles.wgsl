// Least and greatest depth in tiles of a shadow map, two levels of them: what the walk passes over in one go.
@group(0) @binding(0) var shadow: texture_depth_2d_array;
@group(0) @binding(1) var<storage, read_write> tiles: array<u32>;
//! include "scatter/march/tile.wgsl"

/// Half floats, the least rounded down and the greatest up, and none so small that a device may take it for 0.
fn rounded(range: vec2f) -> u32 {
    let least = range.x * (1.0 - 1.0 / 1024.0);
    let greatest = max(range.y * (1.0 + 1.0 / 1024.0), 2.0 * SMALLEST);
    return pack2x16float(vec2f(select(0.0, least, least > SMALLEST), select(0.0, greatest, range.y > 0.0)));
}

@compute @workgroup_size(8, 8)
fn fine(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(shadow).x;
    let count = tiles_along(side, FINE);
    if (any(id.xy >= vec2u(count))) { return; }
    var range = vec2f(1.0, 0.0);
    var k = 0u;
    loop {
        let texel = min(TILE * id.xy + vec2u(k % TILE, k / TILE), vec2u(side - 1u));
        let held = textureLoad(shadow, texel, id.z, 0);
        range = vec2f(min(range.x, held), max(range.y, held));
        k += 1u;
        continuing { break if k >= TILE * TILE; }
    }
    tiles[tile_at(side, id.z, FINE, id.xy)] = rounded(range);
}

@compute @workgroup_size(8, 8)
fn coarse(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(shadow).x;
    if (any(id.xy >= vec2u(tiles_along(side, COARSE)))) { return; }
    let most = tiles_along(side, FINE) - 1u;
    var range = vec2f(1.0, 0.0);
    var k = 0u;
    loop {
        let part = min(TILE * id.xy + vec2u(k % TILE, k / TILE), vec2u(most));
        let held = unpack2x16float(tiles[tile_at(side, id.z, FINE, part)]);
        range = vec2f(min(range.x, held.x), max(range.y, held.y));
        k += 1u;
        continuing { break if k >= TILE * TILE; }
    }
    tiles[tile_at(side, id.z, COARSE, id.xy)] = pack2x16float(range);
}
