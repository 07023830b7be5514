// What the passes of a rendered scene share: the camera, its lights, and what emits (GPU Gems 3, 13.5.2).
override CONES: u32 = 0u;       // lights that have discs or are bodies
override CLEAR: bool = false;   // nothing drawn counts as the clear colour

const KEPT = 0.25;              // of the occluders' contrast, with contrast; KEPT in reference/radial.py

struct Cone {                   // around a light, from the eye
    direction: vec3f,           // unit, view space
    cosine: f32,                // of its half angle
    near: f32,                  // what lies in it between near and far is the light itself
    far: f32,
    sharp: f32,                 // source texels at its rim for a cosine
    disc: f32,                  // radiance of a disc drawn where nothing hides it
}

struct Aim {                    // a light whose shafts are seen
    direction: vec3f,           // unit, view space
    fade: f32,
    color: vec3f,               // times strength
}

struct View {
    rays: vec4f,                // projection.py: pixel_rays
    depth: vec4f,               // depth_terms
    region: vec4f,              // where the view lies in source and layer: left, top, width, height, of them
    pixels: vec2f,              // of the picture
    texels: vec2f,              // of the source, without its apron
    ratio: vec2f,               // of the one to the other
    pixel: vec2f,               // 1 / pixels
    clear: vec3f,
    apron: i32,
    mix: f32,                   // share of the layer that is added
    reach: f32,                 // distance over which shafts gather
    adapt: f32,
    follow: f32,                // share of the way to what adaptation measures now
    counts: vec2u,              // of cones and aims; the rest of each is dark
    cone: array<Cone, 8>,
    aim: array<Aim, 8>,
}

// Whoever includes this declares `view`, at binding 0: a uniform, which software Vulkan reads faster, or, where a loop or branch hangs on
// its values, storage: of uniforms that driver compiles the shader anew for each value, and keeps it.
@group(0) @binding(1) var scene: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_depth_2d;

/// Finds the view ray of picture position uv, at -z = 1; the axis without perspective. Twin: reference/scene.py:view_ray.
fn view_ray(uv: vec2f) -> vec3f {
    return vec3f(view.rays.xy * uv + view.rays.zw, -1.0);
}

/// Finds the distance along the view's axis of a depth. Twin: reference/scene.py:axial.
fn axial(depth: f32) -> f32 {
    return (view.depth.x * depth + view.depth.y) / (view.depth.z * depth + view.depth.w);
}

/// Adds a light to what `cones_at` found so far: its disc, and its body where it covers more than those before.
/// inverse: of the ray's length. Twin: reference/scene.py:add_cone.
fn add_cone(found: vec4f, cone: Cone, ray: vec3f, inverse: f32) -> vec4f {
    let cover = clamp((dot(ray, cone.direction) * inverse - cone.cosine) * cone.sharp + 0.5, 0.0, 1.0);
    let discs = max(found.x, cone.disc * cover);
    let nearer = cone.far > 0.0 && cover > found.y;
    return vec4f(discs, select(found.yzw, vec3f(cover, inverse * vec2f(cone.near, cone.far)), nearer));
}

/// Finds the discs at a picture position, and the light that is a body there: (radiance of discs, cover of the body, its near and far
/// along the axis). Twin: reference/scene.py:cones_at.
fn cones_at(uv: vec2f) -> vec4f {
    let ray = view_ray(uv);
    let inverse = inverseSqrt(dot(ray, ray));
    var found = vec4f(0.0);
    //! each k of 8: if (CONES > k) { found = add_cone(found, view.cone[k], ray, inverse); }
    return found;
}

/// Finds m of a pixel: 1 where nothing writes depth, or where a light is. light: `cones_at`. Twin: reference/scene.py:pixel_emission.
fn pixel_emission(depth: f32, light: vec4f) -> f32 {
    if (CONES == 0u) { return select(0.0, 1.0, depth >= 1.0); }
    let over = view.depth.x * depth + view.depth.y; // the distance, as a fraction
    let under = view.depth.z * depth + view.depth.w;
    let at_body = over >= light.z * under && over <= light.w * under;
    return select(select(0.0, light.y, at_body), 1.0, depth >= 1.0);
}

/// Bounds the radiance of a pixel to what a source may hold, with discs and the clear colour where nothing is drawn (open).
/// Twin: reference/scene.py:emitted_radiance.
fn emitted_radiance(color: vec3f, open: bool, light: vec4f) -> vec3f {
    var found = clamp(color, vec3f(0.0), vec3f(65504.0));
    if (CLEAR) { found = select(found, mix(view.clear, found, light.y), open); }
    if (CONES > 0u) { found = select(found, max(found, vec3f(light.x)), open); }
    return found;
}

/// Reads a pixel of the scene: RGB and m.
fn emitter_at(p: vec2i, depth: f32, light: vec4f) -> vec4f {
    return vec4f(emitted_radiance(textureLoad(scene, p, 0).rgb, depth >= 1.0, light), pixel_emission(depth, light));
}
