// Luminance of linear Rec. 709 RGB (ITU-R BT.709).
const REC709 = vec3f(0.2126, 0.7152, 0.0722);

/// Weighs linear Rec. 709 to luminance. Twin: reference/colour.py:luminance.
fn luminance(color: vec3f) -> f32 {
    return dot(color, REC709);
}
