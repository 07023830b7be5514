"""Chooses coordinates in which float32 keeps its digits: where a stage is drawn, and where vertices lie in their mesh."""

import math
from typing import Any

import numpy as np

FAR_RADII = 64.0  # of what it belongs to: a place farther from the origin loses what can be seen, in float32
ROUND_RADII = 8.0  # so coarse that things of one shape, moved by round numbers, come to lie at one place
FAR_NEARS = 2.0**17  # of a camera's near plane: so far away from it a step of float32 is 1/128 of that


def origin(center: np.ndarray, radius: float, camera: Any) -> np.ndarray:
    """Choose (3,) the origin for a frame: 0, or a round place near the scene's centre, the same for all frames; where the camera is far
    from there, as one that follows something through 1,000 km, a round place near it."""
    center, radius = np.asarray(center, np.float64), max(radius, 1e-12)
    found = _round(center, ROUND_RADII * radius) if np.abs(center).max() > FAR_RADII * radius else np.zeros(3)
    position = np.asarray(camera.world.position, np.float64)
    reach = FAR_NEARS * max(float(camera.near), 1e-12)
    if np.abs(position - found).max() > reach:
        return _round(position, reach / 10)
    return found


def _round(place: np.ndarray, step: float) -> np.ndarray:
    """Round (3,) to multiples of the power of ten that is `step` or up to ten times that."""
    step = 10.0 ** math.ceil(math.log10(step))
    return np.rint(place / step) * step


def recentred(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shift (N, 3) points that lie far from the origin of their mesh: (N, 3) float32 and (3,) the shift; else they stay, and it is 0."""
    low, high = np.nanmin(points, axis=0).astype(np.float64), np.nanmax(points, axis=0).astype(np.float64)
    radius = float(np.linalg.norm(high - low)) / 2
    shift = (low + high) / 2
    if radius == 0 or np.abs(shift).max() < FAR_RADII * radius:
        return points, np.zeros(3)
    shift = _round(shift, ROUND_RADII * radius)
    return (points.astype(np.float64) - shift).astype(np.float32), shift


def gathered(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shift (N, 4, 4) matrices of instances that lie far from their mesh's origin, float64, and (3,) the shift; else it is 0."""
    low, high = matrices[:, :3, 3].min(axis=0), matrices[:, :3, 3].max(axis=0)
    radius, shift = float(np.linalg.norm(high - low)) / 2, (low + high) / 2
    if np.abs(shift).max() < FAR_RADII * radius:
        return matrices, np.zeros(3)
    shift = _round(shift, ROUND_RADII * radius) if radius else shift
    found = np.array(matrices, np.float64)
    found[:, :3, 3] -= shift
    return found, shift


def shifted(matrices: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Let (..., 4, 4) matrices of points take them after `recentred` has shifted them, float64."""
    found = np.array(matrices, np.float64)
    found[..., :3, 3] += found[..., :3, :3] @ shift
    return found
