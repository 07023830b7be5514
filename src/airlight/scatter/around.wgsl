// The layer of one light whose cookie lets unlike light through in unlike directions: what its method gave is multiplied pixel by pixel,
// and earlier lights are added.
//! include "wgsl/half.wgsl"
//! include "wgsl/around.wgsl"
override ADD: bool = false;   // to what earlier lights gave

struct Place {
    light: vec2f,             // in pixels
}

@group(0) @binding(0) var<uniform> place: Place;
@group(0) @binding(1) var<storage, read> around: array<vec4f>;
@group(0) @binding(2) var own: texture_2d<f32>;
@group(0) @binding(3) var before: texture_2d<f32>;
@group(0) @binding(4) var layer: texture_storage_2d<rgba16float, write>;

/// Multiplies a pixel of the layer.
@compute @workgroup_size(64)
fn shape_layer(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(layer))) { return; }
    let factor = around_factor(around_span(vec2f(id.xy) + 0.5 - place.light));
    var out = factor * textureLoad(own, id.xy, 0).rgb;
    if (ADD) { out += textureLoad(before, id.xy, 0).rgb; }
    textureStore(layer, id.xy, vec4f(nearest_half(out), 1.0));
}
