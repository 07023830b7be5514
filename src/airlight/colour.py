"""The sRGB transfer curve, and codes of 8 and 16 bit: to linear light and back."""

from functools import cache
from typing import Any, Protocol

import numpy as np

from airlight.noise import dither as dither_tile
from airlight.planes import by_rows


class Profile(Protocol):
    """Converts contiguous (h, W, 3) float32 in place between codes 0..1 of a colour space and linear Rec. 709."""

    def decode(self, pixels: np.ndarray, /) -> None: ...
    def encode(self, pixels: np.ndarray, /) -> None: ...


def srgb_decode(value: np.ndarray) -> np.ndarray:
    """Decode sRGB codes 0..1 to linear light 0..1 (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4)


def srgb_encode(value: np.ndarray) -> np.ndarray:
    """Encode linear light, which must lie in 0..1, to sRGB codes 0..1, in its own precision."""
    kind = value.dtype.type
    curved = np.power(value, kind(1 / 2.4))
    curved *= kind(1.055)
    curved -= kind(0.055)
    return np.where(value <= kind(0.0031308), value * kind(12.92), curved)


@cache
def _table(dtype: str, linear: bool) -> np.ndarray:
    most = np.iinfo(dtype).max
    values = np.arange(most + 1) / most
    return (values if linear else srgb_decode(values)).astype(np.float32)


def decode_codes(codes: np.ndarray, profile: Profile | None = None, linear: bool = False) -> np.ndarray:
    """Decode (H, W, 1 or 3) uint8 or uint16 to linear Rec. 709 (H, W, 3) float32; floats are linear as they are."""
    height, width = codes.shape[:2]
    result = np.empty((height, width, 3), np.float32)
    if codes.dtype.kind == "f":
        result[...] = codes
        return result
    table = _table(codes.dtype.name, linear or profile is not None)

    def work(first: int, last: int) -> None:
        result[first:last] = table[codes[first:last]]
        if profile is not None:
            profile.decode(result[first:last])

    by_rows(work, height)
    return result


def encode_codes(
    pixels: np.ndarray, dtype: Any, profile: Profile | None = None, linear: bool = False, dither: bool | None = None
) -> np.ndarray:
    """Encode linear Rec. 709 (H, W, 3) to codes (H, W, 3) of `dtype` (uint8 or uint16), clipped; NaN becomes 0.

    8 bit is dithered unless `dither` is False: blue noise of half a code either way, fixed by position.
    """
    dtype = np.dtype(dtype)
    most = np.float32(np.iinfo(dtype).max)
    height, width = pixels.shape[:2]
    result = np.empty((height, width, 3), dtype)
    noise: Any = np.float32(0.5)
    if dither or (dither is None and dtype == np.uint8):
        noise = np.tile(dither_tile(), (1, -(-width // 256), 1))[:, :width]

    def work(first: int, last: int) -> None:
        value = np.array(pixels[first:last], np.float32, order="C")
        if profile is not None:
            np.nan_to_num(value, copy=False, nan=0.0)
            profile.encode(value)
        np.fmax(value, 0, out=value)
        np.fmin(value, 1, out=value)
        if profile is None and not linear:
            value = srgb_encode(value)
        value *= most
        value += noise if noise.ndim == 0 else noise[first % 256 : first % 256 + last - first]
        np.minimum(value, most, out=value)
        result[first:last] = value.astype(dtype)

    by_rows(work, height)
    return result


def alpha_of(codes: np.ndarray) -> np.ndarray:
    """Scale alpha codes (H, W) to float32 in 0..1."""
    value = codes.astype(np.float32)
    return np.clip(value, 0, 1) if codes.dtype.kind == "f" else value / np.float32(np.iinfo(codes.dtype).max)


def is_neutral(colour: np.ndarray) -> bool:
    """Compare the three channels of (H, W, 3): True where they are the same everywhere."""
    return bool(np.array_equal(colour[..., 0], colour[..., 1]) and np.array_equal(colour[..., 0], colour[..., 2]))
