"""Angles in float64: the twins of wgsl/unit_at.wgsl and its tangent."""

from typing import Any

import numpy as np
import numpy.typing as npt


def unit_at(angle: Any) -> npt.NDArray[np.floating[Any]]:
    """Compute the unit vectors (..., 2) at angles in radians: their cosine and sine."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def tangent(angle: Any) -> npt.NDArray[np.floating[Any]]:
    """Compute the tangents of angles in radians."""
    return np.asarray(np.tan(angle))
