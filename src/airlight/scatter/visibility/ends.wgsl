// Finds where the rays of a table of visibility end: at the surfaces that are seen there.
//! include "scatter/visibility/grid.wgsl"
@group(0) @binding(7) var<storage, read> rows: array<Row>;
@group(0) @binding(8) var<storage, read_write> ray_ends: array<f32>; // texels; all rows' first rays first
@group(0) @binding(9) var<storage, read_write> word_ends: array<f32>; // texels, of 32 rays; all rows' first words first
@group(0) @binding(10) var farthest_tiles: texture_2d<f32>; // see farthest.wgsl

/// Find the ends of a row's rays, at surfaces, and how far its words are needed.
@compute @workgroup_size(64)
fn ends(@builtin(global_invocation_id) id: vec3u) {
    let row = rows[min(id.x, grid.count - 1u)];
    let map = grid.map[row.map];
    let before = rows[max(min(id.x, grid.count - 1u), 1u) - 1u].ends;
    let after = rows[min(id.x + 1u, grid.count - 1u)].ends;
    let fastest = max(row.ends, max(before, after)).xz;
    var i = 0u;
    loop {
        var farthest = 0.0;
        var k = 0u;
        loop {
            let s = f32(i) / (row.rays - 1.0);
            let pixel = clamp(vec2i(floor(mix(row.begin, row.end, s))), vec2i(0), vec2i(frame.pixels) - 1);
            let depth = textureLoad(depths, pixel, 0);
            let ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
            let at = frame.rays.xy * (mix(row.begin, row.end, s) / vec2f(frame.pixels)) + frame.rays.zw;
            let long = sqrt(dot(at, at) + 1.0);
            let pace = max(mix(row.ends.x, row.ends.z, s), LEAST_PACE); // texels while the ray goes on by 1 along the camera's axis
            let hit = depth < 1.0 && ahead * long < frame.max_distance;
            if (id.x < grid.count) { ray_ends[i * grid.count + id.x] = select(NO_SURFACE, max(ahead, 0.0) * pace, hit); }
            // Let it reach as far as any pixel sees between it and its neighbours, which pass over more texels
            let beside = mix(fastest.x, fastest.y, s) + abs(fastest.y - fastest.x) / (row.rays - 1.0);
            let far = textureLoad(farthest_tiles, vec2u(pixel) / TILE_PX, 0).r;
            let most = min(frame.max_distance, frame.sun_reach) / long;
            let farthest_ahead = (frame.depth.x * far + frame.depth.y) / (frame.depth.z * far + frame.depth.w);
            let seen = select(clamp(farthest_ahead, 0.0, most), most, far >= 1.0);
            farthest = max(farthest, min(seen, map.far) * max(beside, LEAST_PACE));
            i += 1u;
            k += 1u;
            continuing { break if k >= 32u; }
        }
        if (id.x < grid.count) { word_ends[(i / 32u - 1u) * grid.count + id.x] = min(farthest, map.stop); }
        continuing { break if f32(i) >= row.rays; }
    }
}
