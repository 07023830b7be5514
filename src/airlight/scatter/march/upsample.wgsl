// From a march at a part of the picture's size to the picture: 4 x 4 neighbours, those whose rays end as far away. Twin: reference/medium.py.
//! include "scatter/march/ray.wgsl"

const SHARP = 24.0;             // how fast a neighbour loses weight with the difference of the ways, of the shorter one
const APART = 0.2;              // the same, from which a neighbour shows something else
const FURTHER = 64.0;           // are looked at where all do

struct Neighbour {
    texel: vec4f,
    off: f32,                   // difference of the ways, of the shorter one
}

fn neighbour(q: vec2i, reach: f32) -> Neighbour {
    let texel = textureLoad(before, clamp(q, vec2i(0), vec2i(frame.size) - 1), 0);
    return Neighbour(texel, abs(texel.a - reach) / max(min(texel.a, reach), 1e-6));
}

/// What a place of the smaller picture is given where none of its neighbours ends as far away as its ray, as in gaps between leaves: the
/// nearest on a spiral that does (Vogel 1979), or the likest; less of it where its way is longer.
fn from_afar(at: vec2f, reach: f32, near: Neighbour) -> vec3f {
    var best = near;
    var k = 0.0;
    loop {
        let angle = 2.3999632 * k;
        let found = neighbour(vec2i(floor(at + 0.5 + sqrt(k + 4.0) * vec2f(cos(angle), sin(angle)))), reach);
        if (found.off < best.off) { best = found; }
        k += 1.0;
        continuing { break if best.off <= APART || k >= FURTHER; }
    }
    let lost = 1.0 - exp(-max(vec2f(reach, best.texel.a) * dot(frame.sigma_t, vec3f(1.0 / 3.0)), vec2f(1e-4)));
    return best.texel.rgb * min(lost.x / lost.y, 1.0);
}

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.pixels)) { return; }
    let ray = ray_at_pixel(id.xy);
    let ratio = vec2f(frame.pixels) / vec2f(frame.size);
    let shift = vec2f(pixel_of(frame.size / 2u)) + 0.5 - (vec2f(frame.size / 2u) + 0.5) * ratio; // of what was marched, from its middle
    let at = (vec2f(id.xy) + 0.5 - shift) / ratio - 0.5;
    let base = vec2i(floor(at)) - 1;
    var sum = vec4f(0.0);
    var nearest = Neighbour(vec4f(0.0), 3e38);
    for (var k = 0; k < 16; k++) {
        let q = base + vec2i(k % 4, k / 4);
        let found = neighbour(q, ray.reach);
        let d = max(2.0 - abs(vec2f(q) - at), vec2f(0.0));
        let near = d.x * d.y;
        let weight = near * exp(-SHARP * found.off) + 1e-20;
        sum += weight * vec4f(found.texel.rgb, 1.0);
        if (found.off < nearest.off && near > 1e-3) { nearest = found; }
    }
    var color = sum.rgb / sum.a;
    if (nearest.off > APART) { color = from_afar(at, ray.reach, nearest); }
    textureStore(layer, id.xy, vec4f(color, ray.reach));
}
