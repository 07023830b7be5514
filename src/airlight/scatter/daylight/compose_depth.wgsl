// Puts daylight on a picture that has a depth buffer.
//! include "scatter/daylight/compose.wgsl"
@group(0) @binding(1) var depths: texture_depth_2d;
const ALONG_RAY = 1u;
const ALONG_AXIS = 2u;
const IN_METRES = 0u;

/// Read the depth buffer.
fn stored_depth(p: vec2u) -> f32 {
    return textureLoad(depths, p, 0);
}
