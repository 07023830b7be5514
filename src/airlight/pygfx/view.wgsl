// What the passes of a rendered scene share: the camera, its lights, and what emits (13.5.2). Twins: reference/scene.py.
override CONES: bool = false;   // some lights have discs or are bodies
override CLEAR: bool = false;   // nothing drawn counts as the clear colour

const KEPT = 0.25;              // of the occluders' contrast, with contrast; twin: KEPT in reference/radial.py

struct Cone {                   // around a light, from the eye
    direction: vec3f,           // unit, view space
    cosine: f32,                // of its half angle
    near: f32,                  // what lies in it between near and far is the light itself
    far: f32,
    soft: f32,                  // cosines of a source texel at its rim
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
    cones: u32,
    aims: u32,
    cone: array<Cone, 8>,
    aim: array<Aim, 8>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_depth_2d;

/// The view ray of picture position uv, at -z = 1; the axis without perspective.
fn view_ray(uv: vec2f) -> vec3f {
    return vec3f(view.rays.xy * uv + view.rays.zw, -1.0);
}

/// Distance along the view's axis.
fn axial(depth: f32) -> f32 {
    return (view.depth.x * depth + view.depth.y) / (view.depth.z * depth + view.depth.w);
}

/// The discs at a ray, and the light that is a body there: (radiance of discs, cover of the body, its near and far along the axis).
fn lights_at(uv: vec2f) -> vec4f {
    let ray = view_ray(uv);
    let inverse = inverseSqrt(dot(ray, ray));
    var found = vec4f(0.0);
    for (var i = 0u; i < view.cones; i++) {
        let cone = view.cone[i];
        let cover = clamp((dot(ray, cone.direction) * inverse - cone.cosine) / cone.soft + 0.5, 0.0, 1.0);
        found.x = max(found.x, cone.disc * cover);
        if (cone.far > 0.0 && cover > found.y) {
            found = vec4f(found.x, cover, inverse * vec2f(cone.near, cone.far));
        }
    }
    return found;
}

/// RGB and m of a pixel: m is 1 where nothing writes depth, or where a light is.
fn seen(p: vec2i, depth: f32, light: vec4f) -> vec4f {
    var color = clamp(textureLoad(picture, p, 0).rgb, vec3f(0.0), vec3f(65504.0));
    let open = depth >= 1.0;
    var m = select(0.0, 1.0, open);
    if (CLEAR && open) {
        color = mix(view.clear, color, light.y);
    }
    if (CONES) {
        color = select(color, max(color, vec3f(light.x)), open);
        let over = view.depth.x * depth + view.depth.y; // the distance, as a fraction
        let under = view.depth.z * depth + view.depth.w;
        let at_body = over >= light.z * under && over <= light.w * under;
        m = select(select(0.0, light.y, at_body), 1.0, open);
    }
    return vec4f(color, m);
}
