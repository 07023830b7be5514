"""Positions that passes draw at, float64: twins of wgsl/fullscreen.wgsl and scatter/epipolar/gather_raster.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]


def fullscreen_corner(i: Any, depth: Any) -> Array:
    """Place corner i (...) of a triangle that covers the target, in clip space (..., 4): (-1, -1), (3, -1), (-1, 3)."""
    xy = np.array([(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)])[np.asarray(i)]
    depth = np.broadcast_to(np.asarray(depth, float), xy.shape[:-1])
    return np.stack([xy[..., 0], xy[..., 1], depth, np.ones(xy.shape[:-1])], axis=-1)


def clip_position(position: Any, size: Any) -> Array:
    """Convert a position (..., 2) in pixels, from the top left, of a target of a size (2,) to clip space (..., 4)."""
    q = 2 * np.asarray(position, float) / size - 1
    return np.stack([q[..., 0], -q[..., 1], np.zeros(q.shape[:-1]), np.ones(q.shape[:-1])], axis=-1)
