// The volume rendering equation's last step: what a medium between eye and surface makes of the surface's radiance.

/// Attenuate a surface's radiance by the transmittance before it, and add a share of what is scattered in there:
/// L = T L_surface + mix L_scattered. Twin: reference/scene.py:through_medium.
fn through_medium(surface: vec3f, transmittance: vec3f, in_scattered: vec3f, mix: f32) -> vec3f {
    return surface * transmittance + mix * in_scattered;
}

/// Weaken the dimming of surfaces to a share of it, which is artistic: 1 - share (1 - T). Twin: reference/scene.py:share_of_dimming.
fn share_of_dimming(transmittance: vec3f, share: f32) -> vec3f {
    return (1.0 - share) + share * transmittance;
}
