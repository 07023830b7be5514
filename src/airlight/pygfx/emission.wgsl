// Emission of a rendered scene (13.5.2): what nothing writes depth at, the discs of lights, and the bodies of lights.
//! include "composite/scene_uniforms.wgsl"
override CONES: u32 = 0u;       // lights that have discs or are bodies
override CLEAR: bool = false;   // nothing drawn counts as the clear colour

const KEPT = 0.25;              // of the occluders' contrast, with contrast; as KEPT in reference/radial.py

/// Add a light's cone to what was found at a ray: (radiance of discs, cover of the body, its near and far along the axis). inverse: of the
/// ray's length. Twin: reference/scene.py:with_light.
fn with_light(found: vec4f, cone: Cone, ray: vec3f, inverse: f32) -> vec4f {
    let cover = clamp((dot(ray, cone.direction) * inverse - cone.cosine) * cone.sharp + 0.5, 0.0, 1.0);
    let discs = max(found.x, cone.disc * cover);
    let nearer = cone.far > 0.0 && cover > found.y;
    return vec4f(discs, select(found.yzw, vec3f(cover, inverse * vec2f(cone.near, cone.far)), nearer));
}

/// Find the discs and the body of light at a picture position: see with_light. Twin: reference/scene.py:lights_at.
fn lights_at(uv: vec2f) -> vec4f {
    let ray = view_ray(uv);
    let inverse = inverseSqrt(dot(ray, ray));
    var found = vec4f(0.0);
    //! each k of 8: if (CONES > k) { found = with_light(found, view.cone[k], ray, inverse); }
    return found;
}

/// Evaluate m of a pixel: 1 where nothing writes depth, or where a light is. light: see lights_at. Twin: reference/scene.py:emits.
fn emits(depth: f32, light: vec4f) -> f32 {
    if (CONES == 0u) { return select(0.0, 1.0, depth >= 1.0); }
    let over = view.depth.x * depth + view.depth.y; // the distance, as a fraction
    let under = view.depth.z * depth + view.depth.w;
    let at_body = over >= light.z * under && over <= light.w * under;
    return select(select(0.0, light.y, at_body), 1.0, depth >= 1.0);
}

/// Convert a colour of the scene to what it emits; open: nothing is drawn there. light: see lights_at. Twin: reference/scene.py:radiance.
fn radiance(color: vec3f, open: bool, light: vec4f) -> vec3f {
    var found = clamp(color, vec3f(0.0), vec3f(65504.0));
    if (CLEAR) { found = select(found, mix(view.clear, found, light.y), open); }
    if (CONES > 0u) { found = select(found, max(found, vec3f(light.x)), open); }
    return found;
}

/// Read RGB and m of a pixel.
fn seen(p: vec2i, depth: f32, light: vec4f) -> vec4f {
    return vec4f(radiance(textureLoad(scene, p, 0).rgb, depth >= 1.0, light), emits(depth, light));
}
