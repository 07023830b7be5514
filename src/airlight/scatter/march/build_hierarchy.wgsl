// Build the two-level min-max depth hierarchy of a shadow map, by which the walk passes over tiles that are lit or dark as a whole.
@group(0) @binding(0) var shadow: texture_depth_2d_array;
@group(0) @binding(1) var<storage, read_write> tiles: array<u32>;
@group(0) @binding(2) var<uniform> first: vec4u;   // x: the row of tiles at which the pass begins
//! include "scatter/march/hierarchy.wgsl"

const SMALLEST_HALF = 6.2e-5;   // a half float that is not subnormal, which a device may take for 0

/// Pack the least and greatest depth as half floats, the one rounded down and the other up, so that no depth is outside.
/// Twin: reference/march.py:pack_conservative.
fn pack_conservative(range: vec2f) -> u32 {
    let least = range.x * (1.0 - 1.0 / 1024.0);
    let greatest = max(range.y * (1.0 + 1.0 / 1024.0), 2.0 * SMALLEST_HALF);
    return pack2x16float(vec2f(select(0.0, least, least > SMALLEST_HALF), select(0.0, greatest, range.y > 0.0)));
}

/// Find least and greatest depth of a tile of texels.
@compute @workgroup_size(8, 8)
fn fine(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation + vec3u(0u, first.x, 0u);
    let side = textureDimensions(shadow).x;
    let count = tiles_along(side, FINE);
    if (any(id.xy >= vec2u(count))) { return; }
    var range = vec2f(1.0, 0.0);
    var k = 0u;
    loop {
        let texel = min(TILE * id.xy + vec2u(k % TILE, k / TILE), vec2u(side - 1u));
        let depth = textureLoad(shadow, texel, id.z, 0);
        range = vec2f(min(range.x, depth), max(range.y, depth));
        k += 1u;
        continuing { break if k >= TILE * TILE; }
    }
    tiles[tile_index(side, id.z, FINE, id.xy)] = pack_conservative(range);
}

/// Find least and greatest depth of a tile of tiles.
@compute @workgroup_size(8, 8)
fn coarse(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation + vec3u(0u, first.x, 0u);
    let side = textureDimensions(shadow).x;
    if (any(id.xy >= vec2u(tiles_along(side, COARSE)))) { return; }
    let most = tiles_along(side, FINE) - 1u;
    var range = vec2f(1.0, 0.0);
    var k = 0u;
    loop {
        let part = min(TILE * id.xy + vec2u(k % TILE, k / TILE), vec2u(most));
        let depths = unpack2x16float(tiles[tile_index(side, id.z, FINE, part)]);
        range = vec2f(min(range.x, depths.x), max(range.y, depths.y));
        k += 1u;
        continuing { break if k >= TILE * TILE; }
    }
    tiles[tile_index(side, id.z, COARSE, id.xy)] = pack2x16float(range);
}
