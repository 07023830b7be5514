"""Offsets of a pixel's samples in their steps, float64: twins of wgsl/jitter.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.noise import blue_noise


def interleaved_gradient_noise(p: Any) -> npt.NDArray[np.floating[Any]]:
    """Compute noise 0..1 of pixels (..., 2), x and y (Jimenez 2014, "Next generation post processing in Call of Duty")."""
    p = np.asarray(p, float) + 0.5
    return np.asarray(52.9829189 * ((p[..., 0] * 0.06711056 + p[..., 1] * 0.00583715) % 1) % 1)


def offsets(width: int, height: int, jitter: str) -> npt.NDArray[np.floating[Any]]:
    """Choose each pixel's offset, (height, width) from 0 to 1. jitter: as Parameters.jitter."""
    y, x = np.mgrid[:height, :width]
    if jitter == "gradient":
        return interleaved_gradient_noise(np.stack([x, y], axis=-1))
    if jitter == "blue":
        tile = blue_noise()
        return tile[y % len(tile), x % len(tile)].astype(float)
    return np.full((height, width), {"fixed": 0.0, "midpoint": 0.5}[jitter])
