"""The shadow-map article's march, float64: twin of scatter/article/article.wgsl, whose docstrings hold here too."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
STEPS, STEP, DIVISOR, EXTENT, GAIN = 600, 0.8, 750.0, 0.98, 0.1
BIAS = 0.0005  # of the map's range of depth


def inscatter(direction: Any, towards: Any, distance: Any, least: float) -> Array:
    """(...,) of (..., 3) unit rays, (3,) unit, (...,): the integral of 1 / d^2 along a ray, as an angle at the lamp."""
    cosine = np.asarray(direction, float) @ np.asarray(towards, float)
    away = np.maximum(np.linalg.norm(np.cross(direction, towards), axis=-1), least)
    return np.asarray(np.arctan2(distance * away, 1 - distance * cosine) / away)


def macklin(direction: Any, offset: Any, distance: Any) -> Array:
    """The same as it is written (Macklin, In-Scattering Demo, 2010), with q = offset; it diverges where the ray meets the lamp."""
    b = np.asarray(direction, float) @ np.asarray(offset, float)
    s = 1 / np.sqrt(np.dot(offset, offset) - b * b)
    return np.asarray(s * (np.arctan((distance + b) * s) - np.arctan(b * s)))


def lit(places: Array, matrices: Sequence[Any], maps: Any, biases: Sequence[float]) -> npt.NDArray[np.bool_]:
    """(...,) of places (..., 3). matrices: (4, 4) each, to texels and depth; maps: (views, side, side); biases: of depth, one a view."""
    out, open_ = np.ones(places.shape[:-1], bool), np.ones(places.shape[:-1], bool)
    side = np.asarray(maps).shape[-1]
    for matrix, layer, bias in zip(matrices, maps, biases, strict=True):
        at = places @ np.asarray(matrix)[:3, :3].T + np.asarray(matrix)[:3, 3]
        within = open_ & (np.abs(2 * at[..., :2] / side - 1).max(axis=-1) <= EXTENT)
        x, y = np.clip(np.floor(at[..., :2]), 0, side - 1).astype(int).transpose(-1, *range(at.ndim - 1))
        out = np.where(within, np.maximum(at[..., 2], 0) + bias >= layer[y, x], out)
        open_ &= ~within
    return out


def layer(
    origins: Array,
    directions: Array,
    surfaces: Array,
    towards: Any,
    intensity: Any,
    matrices: Sequence[Any],
    maps: Any,
    *,
    biases: Sequence[float] = (),
    max_distance: float = np.inf,
    offsets: Any = 0.0,
    prose: bool = False,
    absorption: float = 0.0,
    cap: float = 1.0,
    least: float = 1e-3,
) -> Array:
    """(..., 3) to be added to a picture. origins, directions: (..., 3), unit; surfaces: (...,) distances, inf where nothing is drawn."""
    reach = min(max_distance, STEPS * STEP)
    biases = biases or [BIAS] * len(matrices)
    distance = np.minimum(surfaces, reach)
    total = np.zeros(distance.shape)
    for i in range(STEPS):
        t = STEP * (i + np.asarray(offsets, float)) + np.zeros(distance.shape)
        shines = lit(origins + t[..., None] * directions, matrices, maps, biases)
        total += np.where((t <= distance) & shines, STEP * np.exp(-absorption * t), 0.0)
    part = np.minimum(total / np.maximum(distance, 1e-6), 1) if prose else total / DIVISOR
    light = (part * inscatter(directions, towards, distance, least)) ** 2
    shaded = (surfaces <= reach) & ~lit(origins + distance[..., None] * directions, matrices, maps, biases)
    power = np.asarray(intensity, float)
    shafts = np.minimum(power.max() * light, np.where(shaded, cap, 1.0))[..., None] * power / max(power.max(), 1e-20)
    return (2 * shafts - 1) * GAIN
