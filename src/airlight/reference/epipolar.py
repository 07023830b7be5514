"""Tell where epipolar lines must lie close, in float64: twin of scatter/epipolar/detail.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def bend(before: Any, here: Any, after: Any) -> Array:
    """Find how far a sum (..., 3) is from the line through its neighbours', and the sum, of the channel where each is largest: (..., 2)."""
    before, here, after = (np.asarray(v, float) for v in (before, here, after))
    return np.stack([np.abs(before - 2 * here + after).max(axis=-1), here.max(axis=-1)], axis=-1)
