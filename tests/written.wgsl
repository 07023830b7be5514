// Writes an image as depths, which cannot be uploaded.
//! include "wgsl/fullscreen.wgsl"
@group(0) @binding(0) var picture: texture_2d<f32>;

struct Written { @location(0) colour: vec4f, @builtin(frag_depth) depth: f32 }

@fragment
fn write(@builtin(position) at: vec4f) -> Written {
    return Written(vec4f(0.0), textureLoad(picture, vec2u(at.xy), 0).r);
}
