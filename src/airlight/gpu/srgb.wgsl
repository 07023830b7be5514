// The sRGB transfer curve, IEC 61966-2-1. Twins: srgb_decode, srgb_encode in files/colour.py.

fn srgb_decode(code: vec3f) -> vec3f {
    return select(pow((max(code, vec3f(0.0)) + 0.055) / 1.055, vec3f(2.4)), code / 12.92, code <= vec3f(0.04045));
}

fn srgb_encode(linear: vec3f) -> vec3f { // of values in 0..1
    return select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
}
