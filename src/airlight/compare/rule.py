"""By which rule the light that a medium scatters is measured against the truth."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
EDGE = 0.05  # ratio of distances of neighbours, less 1, above which there is an edge
NEAR = 2  # pixels from an edge that are left out
WORST = 0.01  # of the rest, that the rmse leaves out


@dataclass(frozen=True)
class Errors:
    """Over the mean of the truth; rmse without the worst, the others with them; p99, worst: of single values; bias: signed."""

    rmse: float
    p99: float
    worst: float
    bias: float


def clear(way: Array) -> Array:
    """Mark (H, W) the pixels that are measured, of which none within NEAR has an edge of depth. way: (H, W) distances, metres."""
    logs, edges = np.log(np.maximum(way, 1e-9)), np.zeros(way.shape, bool)
    for axis in (0, 1):
        step = np.abs(np.diff(logs, axis=axis)) > EDGE
        edges |= np.insert(step, 0, False, axis=axis) | np.insert(step, step.shape[axis], False, axis=axis)
    side = 2 * NEAR + 1
    return np.asarray(~np.lib.stride_tricks.sliding_window_view(np.pad(edges, NEAR), (side, side)).any(axis=(2, 3)))


def errors(found: Array, truth: Array, where: Array) -> Errors:
    """Measure errors of found (H, W, 3) against truth (H, W, 3) at the pixels `where` (H, W), at least one."""
    off, mean = (found - truth)[where].astype(float), float(truth[where].mean())
    worst = np.abs(off).mean(axis=1)
    kept = off[worst <= np.quantile(worst, 1 - WORST)]
    size = np.abs(off) / mean
    rmse, p99 = float(np.sqrt(np.mean(kept**2)) / mean), float(np.percentile(size, 99))
    return Errors(rmse, p99, float(size.max()), float(off.mean() / mean))


def factor(found: Array, truth: Array, where: Array) -> float:
    """Fit the one factor of found with which it is nearest to truth at those pixels, least squares; 0 where found is."""
    own, wanted = found[where].astype(float).ravel(), truth[where].astype(float).ravel()
    power = float(own @ own)
    return float(own @ wanted) / power if power > 0 else 0.0
