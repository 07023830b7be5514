"""Blurs the layer of a march in float64 as scatter/march/soften.wgsl does, over no edge of depth."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.march import relative_difference

Array = npt.NDArray[np.floating[Any]]


def soften_weight(away: Any, off: Any, sharpness: Any, kernel: str = "gaussian") -> Array:
    """Weighs neighbours so many pixels away, whose rays' lengths differ by `off`, relative."""
    nearness = np.exp(-np.square(np.asarray(away, float)) / 4.5) if kernel == "gaussian" else 1.0
    return np.asarray(nearness * np.exp(-np.asarray(sharpness, float) * off))


def softened(marched: Array, passes: int, kernel: str = "gaussian", sharpness: float = 24.0) -> Array:
    """Blurs (h, w, 4) radiance and lengths so many times along rows, then columns, but not over edges of length."""
    found = np.asarray(marched, float)
    for axis in (1, 0) * passes:
        moved = np.moveaxis(found, axis, 0)
        size = len(moved)
        sums, weights = np.zeros(moved[..., :3].shape), np.zeros(moved[..., :1].shape)
        for k in range(-3, 4):
            own, other = (np.s_[max(-side, 0) : size - max(side, 0)] for side in (k, -k))
            off = relative_difference(moved[other][..., 3], moved[own][..., 3])
            weight = soften_weight(k, off, sharpness, kernel)[..., None]
            sums[own] += weight * moved[other][..., :3]
            weights[own] += weight
        found = np.moveaxis(np.concatenate([sums / weights, moved[..., 3:]], axis=-1), 0, axis)
    return found
