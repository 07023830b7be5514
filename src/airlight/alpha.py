"""Alpha and light: premultiplied light is what is seen over black, whatever alpha says; alpha is what the picture hides of the rest."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.colour import srgb_decode, srgb_encode
from airlight.planes import by_rows

Array = npt.NDArray[Any]
SLACK = (1e-3, 0.02)  # by which light may pass what alpha holds before that is raised: of itself (half floats), and of a code
HALF_MAX = 65504.0


def is_transparent(alpha: Array | None) -> bool:
    """Tell whether alpha, codes or float 0..1, hides less than all anywhere."""
    return alpha is not None and bool(alpha.min() < (np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1))


def premultiply(rgb: Array, alpha: Array) -> None:
    """Multiply straight linear colours (H, W, 3) float32, in place, by alpha (H, W), float 0..1: light over black."""

    def rows(first: int, last: int) -> None:
        rgb[first:last] *= alpha[first:last, :, None]

    by_rows(rows, len(rgb))


def straighten(light: Array, alpha: Array, keep: Array | None = None) -> tuple[Array, Array]:
    """Divide premultiplied linear light (H, W, 3) by alpha (H, W), raised where it is too small for the light: (straight colours, alpha).

    alpha: integer codes, raised to the light's largest channel, so that no straight colour passes 1; or float 0..1, raised only where
    straight colours would pass what half floats hold, as where it is 0. keep: (H, W) bool, where alpha stays. The product, light over
    black, is as it was, but for light above 1 in integers.
    """
    whole = alpha.dtype.kind == "u"
    most = float(np.iinfo(alpha.dtype).max) if whole else 1.0
    colours, raised = np.empty(light.shape, np.float32), alpha.copy()

    def rows(first: int, last: int) -> None:
        value, part = np.asarray(light[first:last], np.float32), raised[first:last]
        largest = np.clip(value.max(axis=2), 0, 1) * np.float32(most)
        if whole:
            needed = np.ceil(largest * np.float32(1 - SLACK[0]) - np.float32(SLACK[1]))
            rising = needed > part
        else:
            needed = largest
            rising = value.max(axis=2) > part * np.float32(HALF_MAX)
        if keep is not None:
            rising &= ~keep[first:last]
        part[rising] = needed[rising].astype(part.dtype)
        share = part.astype(np.float32) / np.float32(most)
        colours[first:last] = value / np.where(share > 0, share, 1)[..., None]

    by_rows(rows, len(light))
    return colours, raised


def straight_codes(codes: Array) -> Array:
    """Divide codes (H, W, 2 or 4), uint8 or uint16 sRGB, by the alpha that they were multiplied by, their last channel.

    Where a colour passes its alpha c > a, which is light that hides nothing, alpha is raised to hold it. Codes and light agree at the two
    ends, light = decoded c for a = 0, and a for c = a; between them it goes straight from one to the other.
    """
    most = float(np.iinfo(codes.dtype).max)
    value = codes.astype(np.float64) / most
    colour, alpha = value[..., :-1], value[..., -1:]
    result = colour / np.where(alpha > 0, alpha, 1)
    beyond = (colour > alpha).any(axis=-1)
    if beyond.any():
        c, a = colour[beyond], alpha[beyond]
        plain = srgb_decode(c)
        within = a * srgb_decode(np.minimum(c / np.where(a > 0, a, 1), 1))
        light = np.where(c > a, plain + a / np.where(c > 0, c, 1) * (c - plain), within)
        held = np.ceil(np.maximum(a, light.max(axis=-1, keepdims=True)) * most - SLACK[1]) / most
        result[beyond] = srgb_encode(np.clip(light / np.where(held > 0, held, 1), 0, 1))
        value[beyond, -1:] = held
    value[..., :-1] = np.minimum(result, 1)
    return np.rint(value * most).astype(codes.dtype)
