"""Colour in float64: twins of the functions of wgsl/ that weigh, encode and round colours, and of those that put a layer on a picture."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]
REC709 = np.array([0.2126, 0.7152, 0.0722])  # weights of the luminance of linear Rec. 709
WHITE = 0.9911  # of screen: code 254 of 255


def luminance(color: Array) -> Array:
    """Weigh linear Rec. 709 (..., 3) to luminance (...)."""
    return np.asarray(color @ REC709)


def srgb_decode(code: Array) -> Array:
    """Decode sRGB codes 0..1 to linear light (IEC 61966-2-1)."""
    return np.where(code <= 0.04045, code / 12.92, ((np.maximum(code, 0) + 0.055) / 1.055) ** 2.4)


def srgb_encode(linear: Array) -> Array:
    """Encode linear light 0..1 to sRGB codes 0..1 (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


def smooth_step(x: Any, low: Any, high: Any) -> Array:
    """Rise from 0 at `low` to 1 at `high` by 3t^2 - 2t^3."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(3 * t**2 - 2 * t**3)


def nearest_half(v: Array) -> Array:
    """Round to the nearest half float, at most 65504 in size; below 2^-14 to as many binary digits."""
    v = np.clip(np.asarray(v, float), -65504, 65504)
    mantissa, exponent = np.frexp(v)  # 0.5 <= mantissa < 1: 11 binary digits of it are kept
    return np.asarray(np.ldexp(np.floor(np.abs(mantissa) * 2048 + 0.5) * np.sign(v), exponent - 11))


def subtract_haze(color: Array, peak: Any, floor: Any) -> Array:
    """Take the faint even haze from a layer (..., 3): color t / (t + floor), t = (luminance / peak)^4; floor: the veil's fourth power."""
    t = np.minimum(luminance(color) / peak, 1e4) ** 4
    return np.asarray(color * (t / np.maximum(t + floor, 1e-30))[..., None])


def screened(before: Array, added: Array) -> Array:
    """Screen a layer over a linear picture: what is added, max(white - before, 0) added / (1 + added)."""
    return np.asarray(np.maximum(WHITE - before, 0) * (added / (1 + added)))


def adapted(color: Array, scale: float, white: float, strength: float) -> Array:
    """Adapt linear colours (..., 3) by Reinhard's curve: times gain^strength, gain = scale (1 + y / white^2) / (1 + y), y of the scaled."""
    y = scale * np.maximum(luminance(color), 0)
    return np.asarray(color * (scale * (1 + y / white**2) / (1 + y))[..., None] ** strength)


def log_luminance(c: Array) -> Array:
    """Take the natural logarithm of the luminance of (..., 3), which is held within 1e-5 and 1e5."""
    return np.asarray(np.log(np.clip(luminance(c), 1e-5, 1e5)))


def sound(color: Array) -> Array:
    """Clean a fragment's RGBA (..., 4): NaN and infinity to 0, the rest to what a half float and an opacity may be."""
    finite = np.where(np.isfinite(color), color, 0.0)
    return np.clip(finite, 0, np.array([65504.0, 65504.0, 65504.0, 1.0]))
