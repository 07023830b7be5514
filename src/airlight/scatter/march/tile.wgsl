// Where the tiles of a shadow map's texels lie in their buffer.
const FINE = 3u;                // log2 of the texels along a tile, and of a tile of tiles
const COARSE = 6u;
const TILE = 8u;
const SMALLEST = 6.2e-5;        // a half float that is not subnormal

/// How many tiles of a level a map of `side` texels has along a side.
fn tiles_along(side: u32, level: u32) -> u32 {
    return (side + (1u << level) - 1u) >> level;
}

/// Index of a tile of view i's map.
fn tile_at(side: u32, i: u32, level: u32, tile: vec2u) -> u32 {
    let fine = tiles_along(side, FINE);
    let coarse = tiles_along(side, COARSE);
    let begin = i * (fine * fine + coarse * coarse) + select(fine * fine, 0u, level == FINE);
    return begin + tile.y * select(coarse, fine, level == FINE) + tile.x;
}
