// The sRGB transfer curve, IEC 61966-2-1.

/// Decodes sRGB codes to linear light. Twin: reference/colour.py:srgb_decode.
fn srgb_decode(code: vec3f) -> vec3f {
    return select(pow((max(code, vec3f(0.0)) + 0.055) / 1.055, vec3f(2.4)), code / 12.92, code <= vec3f(0.04045));
}

/// Encodes linear light 0..1 to sRGB codes. Twin: reference/colour.py:srgb_encode.
fn srgb_encode(linear: vec3f) -> vec3f {
    return select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
}
