"""Evaluates the density of a medium by its height, and its integrals, in float64: twins of medium/height.wgsl.

Heights are in m above the fog's base; layer: (..., 2) depth in m, and the density above a linear ramp. kind: one of resolve.FOGS.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.medium import mean_transmittance

Array = npt.NDArray[np.floating[Any]]
FAR = 1e15  # of the fog's depth: beyond all that is seen
BANDS = {
    "exponential": (-FAR, 0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 11.0, 14.0, FAR),
    "linear": (-FAR, 0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 1.0, FAR),
}  # of the depth, between which the density is smooth


def _layer(layer: Any) -> tuple[Array, Array]:
    layer = np.asarray(layer, float)
    return layer[..., 0], layer[..., 1]


def height_density(y: Any, layer: Any, kind: str) -> Array:
    """Evaluates the density at heights y (...): 1 up to the base."""
    y, (depth, above) = np.asarray(y, float), _layer(layer)
    if kind == "exponential":
        return np.asarray(np.exp(-np.maximum(y, 0) / depth))
    return np.asarray(1 + (above - 1) * np.clip(y / depth, 0, 1))


def mean_height_density(a: Any, b: Any, layer: Any, kind: str) -> Array:
    """Averages the density over the heights between two: times a path's length it is the integral along it."""
    low, high = np.minimum(a, b).astype(float), np.maximum(a, b).astype(float)
    (depth, above), span = _layer(layer), np.maximum(high - low, 1e-300)
    below = np.clip(-low / span, 0, 1)
    if kind == "exponential":
        start = np.maximum(low, 0)
        return np.asarray(below + (1 - below) * np.exp(-start / depth) * mean_transmittance((np.maximum(high, 0) - start) / depth))
    over = np.clip((high - depth) / span, 0, 1)
    middle = (np.clip(low, 0, depth) + np.clip(high, 0, depth)) / 2 / depth
    return np.asarray(below + np.maximum(1 - below - over, 0) * (1 + (above - 1) * middle) + over * above)


def height_column(y: Any, layer: Any, kind: str) -> Array:
    """Integrates over all heights above y, m, what the density is more than high up."""
    y, (depth, above) = np.asarray(y, float), _layer(layer)
    below = np.maximum(-y, 0)
    if kind == "exponential":
        return np.asarray(below + depth * np.exp(-np.maximum(y, 0) / depth))
    return np.asarray((1 - above) * (below + depth / 2 * (1 - np.clip(y / depth, 0, 1)) ** 2))


def height_band(k: Any, layer: Any, kind: str) -> Array:
    """Bounds (..., 2) the k-th band of heights in which the density is smooth."""
    edges, k = np.array(BANDS[kind]), np.asarray(k, int)
    return np.stack([edges[k], edges[k + 1]], axis=-1) * _layer(layer)[0][..., None]
