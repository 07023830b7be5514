// A layer made ready to be added to a picture, linear. Twins: lift_veil and blend in blend.py.
const WHITE = 0.9911;         // code 254

/// peak: luminance of the brightest shafts; veil: veil^4.
fn lift_veil(color: vec3f, peak: f32, veil: f32) -> vec3f {
    let q = min(dot(color, vec3f(0.2126, 0.7152, 0.0722)) / peak, 1e4);
    let t = q * q * q * q;
    return color * (t / max(t + veil, 1e-30));
}

fn screened(before: vec3f, added: vec3f) -> vec3f {
    return max(WHITE - before, vec3f(0.0)) * (added / (1.0 + added));
}
