// From a march at a part of the picture's size to the picture: 4 x 4 neighbours, those whose rays end as far away. Twin: reference/medium.py.
//! include "scatter/march/ray.wgsl"
@group(0) @binding(6) var layer_transmittance: texture_storage_2d<rgba32float, write>;

const SHARP = 24.0;             // how fast a neighbour loses weight with the difference of the ways, of the shorter one
const APART = 0.2;              // the same, from which a neighbour shows something else
const FURTHER = 64.0;           // are looked at where all do

fn texel_at(q: vec2i) -> vec4f {
    return textureLoad(before, clamp(q, vec2i(0), vec2i(frame.size) - 1), 0);
}

/// The difference of two ways, of the shorter one.
fn apart(a: f32, b: f32) -> f32 {
    return abs(a - b) / max(min(a, b), 1e-6);
}

/// What a place of the smaller picture is given where none of its neighbours ends as far away as its ray, as in gaps between leaves: the
/// nearest on a spiral that does (Vogel 1979), or the likest; less of it where its way is longer.
fn from_afar(at: vec2f, reach: f32, likest: vec4f) -> vec3f {
    var best = likest;
    var off = apart(best.a, reach);
    var k = 0.0;
    loop {
        if (off <= APART || k >= FURTHER) { break; }
        let angle = 2.3999632 * k;
        let found = texel_at(vec2i(floor(at + 0.5 + sqrt(k + 4.0) * vec2f(cos(angle), sin(angle)))));
        if (apart(found.a, reach) < off) {
            best = found;
            off = apart(found.a, reach);
        }
        k += 1.0;
    }
    return best.rgb * min(until(reach) / max(until(best.a), vec3f(1e-20)), vec3f(1.0));
}

/// One invocation does the pixels between four of what was marched, since these have the same neighbours.
@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy > frame.size)) { return; }
    let ratio = vec2f(frame.pixels) / vec2f(frame.size);
    let shift = vec2f(pixel_of(frame.size / 2u)) + 0.5 - (vec2f(frame.size / 2u) + 0.5) * ratio; // of what was marched, from its middle
    let cell = vec2f(id.xy) - 1.0;
    let first = vec2u(clamp(ceil((cell + 0.5) * ratio + shift - 0.5), vec2f(0.0), vec2f(frame.pixels)));
    let end = vec2u(clamp(ceil((cell + 1.5) * ratio + shift - 0.5), vec2f(0.0), vec2f(frame.pixels)));
    let count = end - first;
    let base = vec2i(id.xy) - 2;
    var held = array<vec4f, 16>();
    //! each k of 16: held[k] = texel_at(base + vec2i(vec2u(k % 4u, k / 4u)));
    var n = 0u;
    loop {
        if (n >= count.x * count.y) { break; }
        let pixel = first + vec2u(n % count.x, n / count.x);
        let reach = ray_at_pixel(pixel).reach;
        let at = (vec2f(pixel) + 0.5 - shift) / ratio - 0.5;
        let near_x = max(2.0 - abs(f32(base.x) + vec4f(0.0, 1.0, 2.0, 3.0) - at.x), vec4f(0.0));
        let near_y = max(2.0 - abs(f32(base.y) + vec4f(0.0, 1.0, 2.0, 3.0) - at.y), vec4f(0.0));
        var sum = vec4f(0.0);
        var likest = vec4f(0.0);
        var least = 3e38;
        var near = 0.0;
        var off = 0.0;
        //! each k of 16: near = near_x[k % 4u] * near_y[k / 4u]; off = apart(held[k].a, reach); sum += (near * exp(-SHARP * off) + 1e-20) * vec4f(held[k].rgb, 1.0); if (off < least && near > 1e-3) { least = off; likest = held[k]; }
        var color = sum.rgb / sum.a;
        if (least > APART) { color = from_afar(at, reach, likest); }
        textureStore(layer, pixel, vec4f(color, reach));
        textureStore(layer_transmittance, pixel, vec4f(transmittance(reach), 1.0));
        n += 1u;
    }
}
