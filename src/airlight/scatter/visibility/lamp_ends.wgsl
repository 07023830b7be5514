// Finds where the rays of a lamp's table of visibility end: at the surfaces that are seen there.
//! include "scatter/visibility/lamps.wgsl"
@group(0) @binding(7) var<storage, read> rows: array<LampRow>;
@group(0) @binding(8) var<storage, read_write> ray_ends: array<f32>; // blocks; all rows' first rays first
@group(0) @binding(9) var<storage, read_write> word_ends: array<f32>; // blocks, of 32 rays; all rows' first words first
@group(0) @binding(10) var farthest_tiles: texture_2d<f32>; // see farthest.wgsl
@group(0) @binding(11) var<uniform> lamp: Lamp;

/// Convert a depth to m along the camera's axis. Twin: reference/visibility_lamps.py:ahead_at.
fn ahead_at(depth: f32) -> f32 {
    return (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
}

/// Find the block of a place that lies `ahead` m along the camera's axis on a ray. across, towards: of the ray that goes by 1 along it.
/// Twin: reference/visibility_lamps.py:block_ahead.
fn block_ahead(ahead: f32, across: f32, towards: f32) -> f32 {
    return (angle_from(lamp.away - ahead * towards, ahead * max(across, 0.0)) - lamp.begin) / lamp.wide;
}

/// Find the ends of a row's rays, at surfaces, and how far its words are needed.
@compute @workgroup_size(64)
fn ends(@builtin(global_invocation_id) id: vec3u) {
    let own = min(id.x, grid.count - 1u);
    let row = rows[own];
    let before = rows[max(own, 1u) - 1u].ends;
    let after = rows[min(own + 1u, grid.count - 1u)].ends;
    let low = min(row.ends, min(before, after));
    let high = max(row.ends, max(before, after));
    let last = row.rays - 1.0;
    var i = 0u;
    loop {
        var farthest = 0.0;
        var k = 0u;
        loop {
            let s = f32(i * i) / (last * last);
            let place = mix(row.begin, row.end, s);
            let pixel = clamp(vec2i(floor(place)), vec2i(0), vec2i(frame.pixels) - 1);
            let depth = textureLoad(depths, pixel, 0);
            let at = frame.rays.xy * (place / vec2f(frame.pixels)) + frame.rays.zw;
            let long = sqrt(dot(at, at) + 1.0);
            let ahead = max(ahead_at(depth), 0.0);
            let hit = depth < 1.0 && ahead * long < frame.max_distance;
            let surface = block_ahead(ahead, mix(row.ends.x, row.ends.z, s), mix(row.ends.y, row.ends.w, s));
            if (id.x < grid.count) { ray_ends[i * grid.count + id.x] = select(NO_SURFACE, surface, hit); }
            // Let it reach as far as any pixel sees between it and its neighbours, which lie elsewhere from the lamp
            let apart = f32(2u * i + 1u) / (last * last);
            let towards = max(mix(high.y, high.w, s), 0.0) + abs(high.w - high.y) * apart;
            let nearer = mix(low.x, low.z, s) - abs(low.z - low.x) * apart;
            let farther = mix(high.x, high.z, s) + abs(high.z - high.x) * apart;
            let far = textureLoad(farthest_tiles, vec2u(pixel) / TILE_PX, 0).r;
            let most = ROOM * frame.max_distance / long;
            let seen = select(clamp(ROOM * ahead_at(far), 0.0, most), most, far >= 1.0);
            farthest = max(farthest, max(block_ahead(seen, nearer, towards), block_ahead(seen, farther, towards)));
            i += 1u;
            k += 1u;
            continuing { break if k >= 32u; }
        }
        if (id.x < grid.count) { word_ends[(i / 32u - 1u) * grid.count + id.x] = farthest; }
        continuing { break if f32(i) >= row.rays; }
    }
}
