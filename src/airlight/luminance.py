"""Luminance of linear Rec. 709 RGB (ITU-R BT.709)."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]
REC709 = np.array([0.2126, 0.7152, 0.0722])  # weights of red, green and blue, of sum 1
REC709_F32 = REC709.astype(np.float32)


def luminance(color: Array) -> Array:
    """Weigh linear Rec. 709 (..., 3) to luminance (...), in its own precision."""
    return np.asarray(color @ REC709.astype(color.dtype))
