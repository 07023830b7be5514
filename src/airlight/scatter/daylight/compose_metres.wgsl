// Puts daylight on a picture whose distances are known in metres.
//! include "scatter/daylight/compose.wgsl"
@group(0) @binding(1) var depths: texture_2d<f32>;
const ALONG_RAY = 1u;
const ALONG_AXIS = 2u;
override IN_METRES: u32 = 1u;   // one of these

/// Read the distance, m.
fn stored_depth(p: vec2u) -> f32 {
    return textureLoad(depths, p, 0).r;
}
