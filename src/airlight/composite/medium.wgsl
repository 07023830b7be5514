// The volume rendering equation's last step: what a medium between eye and surface makes of the surface's radiance.

/// Attenuate a surface's radiance by the transmittance before it, and add a share of what is scattered in there:
/// L = T L_surface + mix L_scattered. Twin: reference/scene.py:through_medium.
fn through_medium(surface: vec3f, transmittance: vec3f, in_scattered: vec3f, mix: f32) -> vec3f {
    return surface * transmittance + mix * in_scattered;
}
