// Two noise maps that tile the plane, see noise_maps.py.
@group(0) @binding(8) var maps: texture_2d<f32>; // two noise maps: red and green

/// Interpolate a map between the centres of its texels, at a place of it; it repeats.
fn interpolated(map: texture_2d<f32>, at: vec2f) -> vec4f {
    let size = vec2i(textureDimensions(map));
    let place = at * vec2f(size) - 0.5;
    let low = floor(place);
    let part = place - low;
    let a = ((vec2i(low) % size) + size) % size;
    let b = (a + 1) % size;
    let top = mix(textureLoad(map, a, 0), textureLoad(map, vec2i(b.x, a.y), 0), part.x);
    let bottom = mix(textureLoad(map, vec2i(a.x, b.y), 0), textureLoad(map, b, 0), part.x);
    return mix(top, bottom, part.y);
}
