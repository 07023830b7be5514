"""Sums the in-scattering of the shadow-map article (unpublished, 2014) in float64: twins of scatter/article/article.wgsl."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
STEPS, STEP, STOP, DIVISOR, EXTENT, GAIN, LEAST_SINE = 600, 0.8, 2.0, 750.0, 0.98, 0.1, 1e-3
BIAS = 0.0005  # of the map's range of depth


def inscatter(direction: Any, towards: Any, distance: Any, least: float) -> Array:
    """Integrates 1 / d^2 along a ray, as an angle at the lamp: (...,) of (..., 3) unit rays, (3,) unit, (...,) metres."""
    cosine = np.asarray(direction, float) @ np.asarray(towards, float)
    away = np.maximum(np.linalg.norm(np.cross(direction, towards), axis=-1), least)
    return np.asarray(np.arctan2(distance * away, 1 - distance * cosine) / away)


def macklin(direction: Any, offset: Any, distance: Any) -> Array:
    """Integrates the same as it is written (Macklin, In-Scattering Demo, 2010), q = offset; it diverges where the ray meets the lamp."""
    b = np.asarray(direction, float) @ np.asarray(offset, float)
    s = 1 / np.sqrt(np.dot(offset, offset) - b * b)
    return np.asarray(s * (np.arctan((distance + b) * s) - np.arctan(b * s)))


def holds(at: Array, side: int, strict: bool = False) -> npt.NDArray[np.bool_]:
    """Tests whether a cascade's map of side x side holds texels: (...,) of (..., 2). strict: not its border."""
    most = np.abs(2 * at / side - 1).max(axis=-1)
    return np.asarray(most < EXTENT if strict else most <= EXTENT)


def lit(positions: Array, matrices: Sequence[Any], maps: Any, biases: Sequence[float], strict: bool = False) -> npt.NDArray[np.bool_]:
    """Tests positions against the first cascade that holds them: (...,) of (..., 3).

    matrices: (4, 4) each, to texels and depth; maps: (views, side, side); biases: of depth, one a view; strict: what is
    as deep as the map is in shadow.
    """
    out, open_ = np.ones(positions.shape[:-1], bool), np.ones(positions.shape[:-1], bool)
    side = np.asarray(maps).shape[-1]
    for matrix, layer, bias in zip(matrices, maps, biases, strict=True):
        at = positions @ np.asarray(matrix)[:3, :3].T + np.asarray(matrix)[:3, 3]
        within = open_ & holds(at[..., :2], side, strict)
        x, y = np.clip(np.floor(at[..., :2]), 0, side - 1).astype(int).transpose(-1, *range(at.ndim - 1))
        depth = np.maximum(at[..., 2], 0) + bias
        out = np.where(within, depth > layer[y, x] if strict else depth >= layer[y, x], out)
        open_ &= ~within
    return out


def article(
    origins: Array, directions: Array, surfaces: Array, towards: Any, matrices: Sequence[Any], maps: Any, *, least: float = LEAST_SINE
) -> Array:
    """Sums what the article's code adds to each channel of a picture, (...,).

    origins, directions: (..., 3), unit; surfaces: (...,) distances, inf where nothing is drawn; towards: (3,) unit, to the sun.
    """
    total, last = np.ones(surfaces.shape), np.zeros(surfaces.shape)
    for i in range(STEPS):
        d = STEP * i
        goes_on = surfaces - d >= STOP
        now = np.minimum(1, inscatter(directions, towards, d, least))
        shines = lit(origins + d * directions, matrices, maps, [BIAS] * len(matrices), strict=True)
        total += np.where(goes_on, (np.where(shines, now, 0) - last.clip(0, 1)) / DIVISOR, 0)
        last = now
    return np.asarray((2 * total**2 - 1) * GAIN)


def prose(
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
    by_length: bool = False,
    absorption: Any = 0.0,
    cap: float = 1.0,
    least: float = LEAST_SINE,
    steps: int = STEPS,
    step: float = STEP,
) -> Array:
    """Sums what the article's prose adds to a picture, (..., 3). As `article`; intensity: (3,); absorption: a number or (3,), 1/m."""
    reach = min(max_distance, steps * step)
    biases = biases or [BIAS] * len(matrices)
    distance = np.minimum(surfaces, reach)
    total = np.zeros((*distance.shape, 3))
    for i in range(steps):
        t = step * (i + np.asarray(offsets, float)) + np.zeros(distance.shape)
        shines = lit(origins + t[..., None] * directions, matrices, maps, biases)
        total += np.where((t <= distance) & shines, step, 0.0)[..., None] * np.exp(-np.asarray(absorption, float) * t[..., None])
    part = np.minimum(total / np.maximum(distance, 1e-6)[..., None], 1) if by_length else total / DIVISOR
    light = (part * inscatter(directions, towards, distance, least)[..., None]) ** 2
    shaded = (surfaces <= reach) & ~lit(origins + distance[..., None] * directions, matrices, maps, biases)
    power = np.asarray(intensity, float)
    shafts = np.minimum(power.max() * light, np.where(shaded, cap, 1.0)[..., None]) * power / max(power.max(), 1e-20)
    return np.asarray((2 * shafts - 1) * GAIN)
