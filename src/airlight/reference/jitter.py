"""Where in its step a pixel's samples lie, float64: twin of scatter/jitter.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.noise import blue_noise


def offsets(width: int, height: int, jitter: str) -> npt.NDArray[np.floating[Any]]:
    """(height, width) from 0 to 1. jitter: as Parameters.jitter."""
    y, x = np.mgrid[:height, :width]
    if jitter == "gradient":  # Jimenez 2014
        return np.asarray(52.9829189 * (((x + 0.5) * 0.06711056 + (y + 0.5) * 0.00583715) % 1) % 1)
    if jitter == "blue":
        tile = blue_noise()
        return tile[y % len(tile), x % len(tile)].astype(float)
    return np.full((height, width), {"fixed": 0.0, "midpoint": 0.5}[jitter])
