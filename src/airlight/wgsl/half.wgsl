/// Rounds to the nearest half floats: stores to rgba16float may cut off instead (software Vulkan does), a bias of up to 0.1 %.
/// Twin: reference/colour.py:nearest_half.
fn nearest_half(v: vec3f) -> vec3f {
    return bitcast<vec3f>((bitcast<vec3u>(clamp(v, vec3f(-65504.0), vec3f(65504.0))) + 0x1000u) & vec3u(0xffffe000u));
}
