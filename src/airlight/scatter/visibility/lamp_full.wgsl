// Fills the table of what a lamp scatters where all is lit, see in_full.wgsl: a row for each place of angles at the lamp, a column for each angle
// at the eye, at even places of its root.
//! include "scatter/visibility/in_full.wgsl"
const PIECES = 4u;              // of each place

@group(0) @binding(7) var full: texture_storage_2d<rgba16float, write>;
@group(0) @binding(8) var<uniform> lamp: Lamp;

/// Sum a column.
@compute @workgroup_size(8)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    let u = f32(id.x) / (FULL_SIDE - 1.0);
    let angle = PI * u * u;
    let eye = unit_at(angle);
    let each = max(PI - angle - lamp.begin, 0.0) / (FULL_SIDE - 1.0);
    let first = scattered_at(eye, unit_at(lamp.begin), lamp.away);
    textureStore(full, vec2u(id.x, 0u), vec4f(first, 1.0));
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        var part = 0u;
        loop {
            sum += scattered_at(eye, unit_at(lamp.begin + each * (f32(k) + (f32(part) + 0.5) / f32(PIECES))), lamp.away);
            part += 1u;
            continuing { break if part >= PIECES; }
        }
        k += 1u;
        textureStore(full, vec2u(id.x, k), vec4f(sum / f32(k * PIECES), 1.0));
        continuing { break if k >= u32(FULL_SIDE) - 1u; }
    }
}
