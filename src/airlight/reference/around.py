"""Evaluate what a cookie makes of a light of the image plane, see lights/around.py, in float64: the truth for wgsl/around.wgsl."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lights.around import ANGLES

LEVELS = ANGLES.bit_length() - 1  # above the finest
Array = npt.NDArray[np.floating[Any]]


def around_span(d: Array) -> Array:
    """Compute (..., 2) at which part of a turn a pixel lies that is d (..., 2) pixels from the light, y down, and how much of a turn it
    covers, 1 at most."""
    turn = np.arctan2(d[..., 0], -d[..., 1]) / (2 * math.pi)
    length = np.maximum(np.hypot(d[..., 0], d[..., 1]), 1e-6)
    return np.stack([turn - np.floor(turn), np.minimum(1 / (2 * math.pi * length), 1.0)], axis=-1)


def around_at(table: Array, level: Any, turn: Array) -> Array:
    """Interpolate (..., 3) the means of a level, 0 the finest, between their middles, all the way round."""
    count = ANGLES >> level
    at = turn * count - 0.5
    whole = np.floor(at)
    first, i = 2 * ANGLES - 2 * count, whole.astype(np.int64) % count
    a, b = table[first + i, :3].astype(np.float64), table[first + (i + 1) % count, :3]
    return np.asarray(a + (at - whole)[..., None] * (b - a))


def around_factor(table: Array, span: Array) -> Array:
    """Average (..., 3) the factors of a table over what a pixel covers, see `around_span`: between the levels whose steps are as wide."""
    level = np.clip(np.log2(ANGLES * span[..., 1]), 0, LEVELS)
    low = np.floor(level).astype(np.int64)
    a, b = (around_at(table, np.minimum(one, LEVELS), span[..., 0]) for one in (low, low + 1))
    return np.asarray(a + (level - low)[..., None] * (b - a))


def around_light(table: Array, size: tuple[int, int], position: tuple[float, float]) -> Array:
    """Compute (H, W, 3) the factors of all pixels of a picture, (width, height), of a light at a position in pixels."""
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    return around_factor(table, around_span(np.stack([x, y], axis=-1) - position))
