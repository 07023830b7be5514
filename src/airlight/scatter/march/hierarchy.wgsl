// Layout of a shadow map's two-level min-max depth hierarchy: tiles of 8 x 8 texels, and tiles of 8 x 8 of these, for each view.
const FINE = 3u;                // log2 of the texels along a tile, and of the tiles along a tile of tiles
const COARSE = 6u;              // log2 of the texels along a tile of tiles
const TILE = 8u;

/// Count the tiles of a level, log2 of their texels, along a side of a map. Twin: reference/march.py:tiles_along.
fn tiles_along(side: u32, level: u32) -> u32 {
    return (side + (1u << level) - 1u) >> level;
}

/// Find the index of a tile of view i's map in the buffer. Twin: reference/march.py:tile_index.
fn tile_index(side: u32, i: u32, level: u32, tile: vec2u) -> u32 {
    let fine = tiles_along(side, FINE);
    let coarse = tiles_along(side, COARSE);
    let begin = i * (fine * fine + coarse * coarse) + select(fine * fine, 0u, level == FINE);
    return begin + tile.y * select(coarse, fine, level == FINE) + tile.x;
}
