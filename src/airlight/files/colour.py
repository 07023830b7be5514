"""Convert codes to scene-linear Rec. 709 and back: sRGB by tables, ICC profiles by OpenColorIO."""

import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.files.repair import repair
from airlight.noise import dither as dither_tile

ROWS = 64  # rows of a chunk; divides the dither tile
# XYZ (D65) to linear Rec. 709.
XYZ_TO_709 = np.linalg.inv(
    [[0.4123907993, 0.3575843394, 0.1804807884], [0.2126390059, 0.7151686788, 0.0721923154], [0.0193308187, 0.1191947798, 0.9505321522]]
)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def by_rows(work: Callable[[int, int], None], height: int) -> None:
    """Call work(first row, row after the last) for chunks of rows, on two threads where the picture is large."""
    spans = [(y, min(y + ROWS, height)) for y in range(0, height, ROWS)]
    if len(spans) < 4:
        for span in spans:
            work(*span)
        return
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        for _ in pool.map(lambda span: work(*span), spans):
            pass


def srgb_decode(value: np.ndarray) -> np.ndarray:
    """Decode the sRGB transfer curve (IEC 61966-2-1), code 0..1 to linear 0..1."""
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4)


def srgb_encode(value: np.ndarray) -> np.ndarray:
    """Encode by the inverse of `srgb_decode`, in the precision of `value`, which must lie in 0..1."""
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


class Profile:
    """An RGB ICC profile; `decode` and `encode` work in place on contiguous (h, W, 3) float32, codes as 0..1."""

    def __init__(self, icc: bytes):
        """Read the profile. Raises ValueError where OpenColorIO cannot use it (tables instead of curves and a matrix, damage, not RGB)."""
        import PyOpenColorIO as ocio

        if icc[16:20] != b"RGB ":
            raise ValueError("not an RGB profile")
        handle, name = tempfile.mkstemp(suffix=".icc")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(icc)
            matrix = np.eye(4)
            matrix[:3, :3] = XYZ_TO_709
            both = ocio.GroupTransform()
            both.appendTransform(ocio.FileTransform(src=name, direction=ocio.TRANSFORM_DIR_INVERSE))
            both.appendTransform(ocio.MatrixTransform(matrix=matrix.ravel().tolist()))
            config = ocio.Config.CreateRaw()
            directions = (ocio.TRANSFORM_DIR_FORWARD, ocio.TRANSFORM_DIR_INVERSE)
            ways = [config.getProcessor(both, way).getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS) for way in directions]
        except ocio.Exception as error:
            raise ValueError(str(error).strip().splitlines()[-1]) from error
        finally:
            os.unlink(name)
        self.decode: Callable[[np.ndarray], None] = ways[0].applyRGB
        self.encode: Callable[[np.ndarray], None] = ways[1].applyRGB

    def is_srgb(self) -> bool:
        """Tell whether the profile is sRGB to within half an 8-bit code."""
        steps = np.linspace(0, 1, 9, dtype=np.float32)
        codes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(1, -1, 3)
        linear = codes.copy()
        self.decode(linear)
        if not np.isfinite(linear).all():
            raise ValueError("gives no finite colours")
        return bool(np.abs(srgb_encode(np.clip(linear, 0, 1)) - codes).max() <= 1 / 512)


def decode_codes(codes: np.ndarray, profile: Profile | None = None, linear: bool = False) -> np.ndarray:
    """Decode codes (H, W, 1 or 3) uint8, uint16 or float to linear Rec. 709 (H, W, 3) float32; float is linear as it is."""
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
    """Encode linear Rec. 709 (H, W, 3) as codes (H, W, 3) of `dtype` (uint8 or uint16), clipped; NaN becomes 0.

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


def to_linear(array: Any) -> tuple[np.ndarray, np.ndarray | None]:
    """Decode an image in memory to scene-linear Rec. 709: ((H, W, 3) float32, alpha (H, W) float32 or None).

    `array` is (H, W), (H, W, 1) or (H, W, 3 or 4); uint8 and uint16 are sRGB codes, float is scene-linear already.
    Raises AirlightError for any other shape or type and for empty arrays; bad float pixels are mended as in `repair`.
    """
    array = np.asarray(array)
    if array.dtype.kind != "f" and array.dtype not in (np.uint8, np.uint16):
        raise AirlightError(f"image of type {array.dtype}: give uint8 or uint16 (sRGB) or float (scene-linear)")
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (1, 3, 4)):
        raise AirlightError(f"image of shape {array.shape}: give (H, W), (H, W, 1), (H, W, 3) or (H, W, 4)")
    if array.size == 0:
        raise AirlightError(f"image of shape {array.shape} has no pixels")
    array = array.astype(array.dtype.newbyteorder("="), copy=False)
    if array.ndim == 2:
        array = array[..., None]
    if array.dtype.kind == "f":
        with np.errstate(over="ignore"):
            array = repair(array.astype(np.float32, copy=False), "image")
    alpha = None
    if array.shape[2] == 4:
        alpha = alpha_of(array[..., 3])
        array = array[..., :3]
    return decode_codes(array), alpha


def alpha_of(codes: np.ndarray) -> np.ndarray:
    """Decode alpha codes (H, W) as float32 in 0..1."""
    value = codes.astype(np.float32)
    return np.clip(value, 0, 1) if codes.dtype.kind == "f" else value / np.float32(np.iinfo(codes.dtype).max)


def is_neutral(colour: np.ndarray) -> bool:
    """Tell whether the three channels of (H, W, 3) are the same everywhere."""
    return bool(np.array_equal(colour[..., 0], colour[..., 1]) and np.array_equal(colour[..., 0], colour[..., 2]))


def encode(linear: np.ndarray, dtype: Any, changed: np.ndarray | None = None, codes: np.ndarray | None = None) -> np.ndarray:
    """Encode by the inverse of `to_linear`: (H, W, 3) linear to `dtype`, sRGB for uint8 (dithered) and uint16, linear for floats.

    `codes` is the array that was given to `to_linear`: where `changed` (H, W) is False its values are kept as they were;
    its alpha is kept, and a grey picture stays grey, in its shape, as long as the result has no colour.
    """
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            colour = np.array(linear, dtype)
        if not np.isfinite(colour).all():
            most = min(float(np.finfo(dtype).max), 3.4e38)
            colour = np.nan_to_num(colour, copy=False, nan=0.0, posinf=most, neginf=-most)
    elif dtype in (np.uint8, np.uint16):
        kept = changed is not None and not changed.any()
        colour = np.empty(linear.shape, dtype) if kept and codes is not None else encode_codes(linear, dtype)
    else:
        raise AirlightError(f"cannot encode as {dtype}: uint8, uint16 and float are possible")
    if codes is None:
        return colour
    before = codes if codes.ndim == 3 else codes[..., None]
    if changed is not None and codes.dtype == dtype:
        np.copyto(colour, before[..., :3] if before.shape[2] >= 3 else before[..., :1], where=~changed[..., None])
    if before.shape[2] == 1 and is_neutral(linear):
        # The dither differs between the channels; the first stands for all.
        return colour[..., 0] if codes.ndim == 2 else colour[..., :1]
    if before.shape[2] == 4:
        alpha = before[..., 3:]
        if codes.dtype != dtype and not codes.dtype.kind == dtype.kind == "f":
            scaled = alpha_of(alpha)
            alpha = scaled if dtype.kind == "f" else np.rint(scaled * np.iinfo(dtype).max)
        colour = np.concatenate([colour, alpha.astype(dtype)], axis=2)
    return colour
