// How far the picture sees at most around a place: the greatest depth of tiles of pixels, and of tiles about them. Rays of a table are
// summed as far as any pixel needs that lies between them and their neighbours, and no farther.
//! include "scatter/visibility/grid.wgsl"
@group(0) @binding(7) var tiles: texture_2d<f32>;
@group(0) @binding(8) var spread_tiles: texture_storage_2d<r32float, write>;
@group(0) @binding(9) var nearest: sampler;

/// Find the greatest depth of the pixels of a tile.
@compute @workgroup_size(8, 8)
fn fold(@builtin(global_invocation_id) id: vec3u) {
    let texel = 1.0 / vec2f(frame.pixels);
    var found = vec4f(0.0);
    var k = 0u;
    loop {
        let corner = vec2f(id.xy * TILE_PX + vec2u(2u * (k % (TILE_PX / 2u)), 2u * (k / (TILE_PX / 2u))) + 1u);
        found = max(found, textureGather(depths, nearest, corner * texel));
        k += 1u;
        continuing { break if k >= TILE_PX * TILE_PX / 4u; }
    }
    textureStore(spread_tiles, id.xy, vec4f(max(max(found.x, found.y), max(found.z, found.w)), 0.0, 0.0, 0.0));
}

/// Find the greatest depth of a tile and of those about it.
@compute @workgroup_size(8, 8)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    let along = i32(2u * grid.tiles_about + 1u);
    let last = vec2i((frame.pixels + TILE_PX - 1u) / TILE_PX) - 1;
    var found = 0.0;
    var k = 0;
    loop {
        let at = vec2i(id.xy) + vec2i(k % along, k / along) - i32(grid.tiles_about);
        found = max(found, textureLoad(tiles, clamp(at, vec2i(0), last), 0).r);
        k += 1;
        continuing { break if k >= along * along; }
    }
    textureStore(spread_tiles, id.xy, vec4f(found, 0.0, 0.0, 0.0));
}
