// Rays of the camera through the air of daylight, which ends at what is drawn, however far that is.
//! include "scatter/march/ray.wgsl"
//! include "scatter/daylight/view_table.wgsl"

/// Make the camera's ray of a pixel of the picture, to what is drawn there; NO_END where nothing is.
fn air_ray(pixel: vec2u) -> Ray {
    let at = frame.rays.xy * ((vec2f(pixel) + 0.5) / vec2f(frame.pixels)) + frame.rays.zw;
    let along = normalize(vec3f((1.0 - frame.flat) * at, -1.0));
    let depth = textureLoad(depths, pixel, 0);
    let ahead = (frame.depth.x * depth + frame.depth.y) / (frame.depth.z * depth + frame.depth.w);
    return Ray(vec3f(frame.flat * at, 0.0), select(max(ahead / -along.z, 0.0), NO_END, depth >= 1.0), along);
}
