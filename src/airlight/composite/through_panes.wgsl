// The layer of a medium with what is seen through blended onto it; where nothing is, as it was.
@group(0) @binding(0) var before: texture_2d<f32>;
@group(0) @binding(1) var blended: texture_2d<f32>; // its alpha is 0 where nothing is blended
@group(0) @binding(2) var layer: texture_storage_2d<rgba32float, write>;

/// Write a pixel of the layer.
@compute @workgroup_size(8, 8)
fn through(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(before))) { return; }
    let own = textureLoad(before, id.xy, 0);
    let over = textureLoad(blended, id.xy, 0);
    textureStore(layer, id.xy, vec4f(select(over.rgb, own.rgb, over.a == 0.0), own.a));
}
