// From a march at a part of the picture's size to the picture: 4 x 4 neighbours, those whose rays end as far away.
//! include "scatter/march/ray.wgsl"

const SHARP = 24.0;             // how fast a neighbour loses weight with the difference of the ways, of the shorter one

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    let ray = ray_at_pixel(id.xy);
    let ratio = vec2f(frame.pixels) / vec2f(frame.size);
    let shift = vec2f(pixel_of(frame.size / 2u)) + 0.5 - (vec2f(frame.size / 2u) + 0.5) * ratio; // of what was marched, from its middle
    let at = (vec2f(id.xy) + 0.5 - shift) / ratio - 0.5;
    let base = vec2i(floor(at)) - 1;
    var sum = vec4f(0.0);
    var nearest = vec4f(0.0, 0.0, 0.0, 3e38);
    for (var k = 0; k < 16; k++) {
        let q = base + vec2i(k % 4, k / 4);
        let found = textureLoad(before, clamp(q, vec2i(0), vec2i(frame.size) - 1), 0);
        let off = abs(found.a - ray.reach) / max(min(found.a, ray.reach), 1e-6);
        let d = max(2.0 - abs(vec2f(q) - at), vec2f(0.0));
        let near = d.x * d.y;
        let weight = near * exp(-SHARP * off) + 1e-20;
        sum += weight * vec4f(found.rgb, 1.0);
        if (off < nearest.a && near > 0.0) { nearest = vec4f(found.rgb, off); }
    }
    let color = select(sum.rgb / sum.a, nearest.rgb, nearest.a > 0.2);
    textureStore(layer, id.xy, vec4f(color, ray.reach));
}
