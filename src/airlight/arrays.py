"""Images in memory: any array that a caller may hand in to scene-linear Rec. 709, and back to its type."""

import os
from typing import Any

import numpy as np

from airlight.alpha import is_transparent, premultiply, straighten
from airlight.colour import alpha_of, decode_codes, encode_codes, is_neutral
from airlight.errors import AirlightError, warn

MOST_BAD = 0.01  # share of the pixels that may be NaN or infinite
MOST_VALUE = 1e31  # of light and depths: sums and products of these stay finite


def repair(values: np.ndarray, name: str) -> np.ndarray:
    """Replace NaN and Inf in `values` (H, W, C) float by the mean of the finite 3x3 neighbours of that channel, else 0.

    Gives `values` itself when all is finite, else a copy, with one AirlightWarning that says how many pixels and where.
    Raises AirlightError when more than 1 % of the pixels are bad.
    """
    if not values.size or np.isfinite([values.min(), values.max()]).all():  # which are NaN where one is; twice as fast as to mark all
        return values
    bad = ~np.isfinite(values)
    height, width = values.shape[:2]
    places = np.argwhere(bad.any(axis=2))
    count = len(places)
    # A tiny picture may have one bad pixel without being hopeless.
    if count > max(1, MOST_BAD * height * width):
        raise AirlightError(
            f"{name}: {count} of {height * width} pixels are NaN or infinite, more than 1 %; render or export the picture again"
        )
    mended = values.copy()
    for y, x in places:
        near = values[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].reshape(-1, values.shape[2])
        with np.errstate(invalid="ignore"):  # signalling NaN
            near = near.astype(np.float64)
        fine = np.isfinite(near)
        total = np.where(fine, near, 0).sum(axis=0)
        mean = total / np.maximum(fine.sum(axis=0), 1)
        mended[y, x] = np.where(bad[y, x], mean, values[y, x])
    y, x = places[0]
    pixels = "pixel was" if count == 1 else "pixels were"
    warn(f"{name}: {count} {pixels} NaN or infinite (the first at x={x}, y={y}) and mended from the neighbours")
    return mended


def bounded(values: np.ndarray, name: str) -> np.ndarray:
    """Clamp finite float32 values where they pass +-MOST_VALUE to a tenth of that, with one AirlightWarning.

    Gives `values` itself when all are within, else a copy. The tenth leaves room for what is added: an output can be read again.
    """
    if not values.size or max(float(values.max()), -float(values.min())) <= MOST_VALUE:
        return values
    most = np.float32(MOST_VALUE / 10)
    message = f"{name}: holds values up to {np.abs(values).max():.2g}, which no light has; those beyond 1e30 are taken as that"
    warn(message)
    return np.clip(values, -most, most)


def as_array(image: Any) -> np.ndarray:
    """Take an image in memory as an array. Raises AirlightError for what is none: a path, or a picture that was read from one."""
    if isinstance(image, (str, bytes, os.PathLike)):
        raise AirlightError(f"image is a path, {os.fsdecode(image)!r}: read it first, as airlight.files.read_image(PATH).codes does")
    if hasattr(image, "codes") and hasattr(image, "spec"):
        raise AirlightError("image is a picture that was read: give its array, its .codes")
    return np.asarray(image)


def to_linear(array: Any) -> tuple[np.ndarray, np.ndarray | None]:
    """Convert an image in memory to scene-linear Rec. 709: ((H, W, 3) float32, alpha (H, W) float32 or None).

    `array` is (H, W), (H, W, 1) or (H, W, 3 or 4); uint8 and uint16 are sRGB codes, float is scene-linear already. The result is
    premultiplied, light over black: floats are taken to be so, codes to be straight. Floats are not copied without need: not to be written.
    Raises AirlightError for any other shape or type and for empty arrays; bad float pixels are mended as in `repair`.
    """
    array = as_array(array)
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
            array = bounded(repair(array.astype(np.float32, copy=False), "image"), "image")
    alpha = None
    if array.shape[2] == 4:
        alpha = alpha_of(array[..., 3])
        array = array[..., :3]
    if array.dtype.kind == "f" and array.shape[2] == 3 and array.flags.c_contiguous:
        linear = array.view()  # of the caller's own, perhaps
        linear.flags.writeable = False
        return linear, alpha
    linear = decode_codes(array)
    if alpha is not None and array.dtype.kind == "u" and is_transparent(alpha):
        premultiply(linear, alpha)
    return linear, alpha


def encode(linear: np.ndarray, dtype: Any, changed: np.ndarray | None = None, codes: np.ndarray | None = None) -> np.ndarray:
    """Convert (H, W, 3) linear to `dtype`, as `to_linear` read it, sRGB for uint8 (dithered) and uint16, linear for floats.

    `codes` is the array that was given to `to_linear`: where `changed` (H, W) is False its values are kept as they were;
    its alpha is kept, but that of codes is raised to hold light that it is too small for, and a grey picture stays grey, in its shape, as
    long as the result has no colour.
    """
    dtype = np.dtype(dtype)
    alpha = None
    if codes is not None and codes.ndim == 3 and codes.shape[2] == 4:
        alpha = codes[..., 3]
        if codes.dtype != dtype and not codes.dtype.kind == dtype.kind == "f":
            scaled = alpha_of(alpha)
            alpha = scaled if dtype.kind == "f" else np.rint(scaled * np.iinfo(dtype).max)
        alpha = alpha.astype(dtype)
        if dtype.kind == "u" and is_transparent(alpha):
            linear, alpha = straighten(linear, alpha, None if changed is None or codes.dtype != dtype else ~changed)
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
    return colour if alpha is None else np.concatenate([colour, alpha[..., None]], axis=2)
