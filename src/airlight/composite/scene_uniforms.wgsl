// Inputs that the passes over the picture of a rendered scene share: uniforms of its camera and lights, the picture and its depth.
struct Cone {                   // around a light, from the eye
    direction: vec3f,           // unit, view space
    cosine: f32,                // of its half angle
    near: f32,                  // m along the ray: what lies in it between near and far is the light itself
    far: f32,
    sharp: f32,                 // source texels at its rim for a cosine
    disc: f32,                  // radiance of a disc drawn where nothing hides it
}

struct Aim {                    // a light whose shafts are seen
    direction: vec3f,           // unit, view space
    fade: f32,                  // 0..1
    color: vec3f,               // times strength
}

struct SceneUniforms {
    rays: vec4f,                // projection.py: pixel_rays
    depth: vec4f,               // projection.py: depth_terms
    region: vec4f,              // where the view lies in source and layer: left, top, width, height, of them
    pixels: vec2f,              // of the picture
    texels: vec2f,              // of the source, without its apron
    ratio: vec2f,               // of the one to the other
    pixel: vec2f,               // 1 / pixels
    clear: vec3f,               // linear RGB
    apron: i32,                 // texels
    mix: f32,                   // share of the layer that is added
    reach: f32,                 // m over which shafts gather
    adapt: f32,                 // share of light adaptation
    follow: f32,                // share of the way to what adaptation measures now
    exposure: f32,              // factor of the picture for a display, before adaptation
    extinction_share: f32,      // of the dimming of surfaces by the medium
    cones: u32,                 // how many of `cone` are in use
    aims: u32,                  // how many of `aim` are in use; the rest is dark
    cone: array<Cone, 8>,
    aim: array<Aim, 8>,
}

// Whoever includes this declares `view`, at binding 0: a uniform, which software Vulkan reads faster, or, where a loop or branch hangs on
// its values, storage: of uniforms that driver compiles the shader anew for each value, and keeps it.
@group(0) @binding(1) var scene: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_depth_2d;

/// Make the view ray of picture position uv, at -z = 1; the axis without perspective. Twin: reference/scene.py:view_ray.
fn view_ray(uv: vec2f) -> vec3f {
    return vec3f(view.rays.xy * uv + view.rays.zw, -1.0);
}

/// Convert a depth to the distance along the view's axis, m. Twin: reference/scene.py:axial.
fn axial(depth: f32) -> f32 {
    return (view.depth.x * depth + view.depth.y) / (view.depth.z * depth + view.depth.w);
}
