"""Evaluates how what steps of a ray add to daylight's sunlight changes from one to the next, float64: twins of
scatter/march/air.wgsl, air_steps.wgsl and air_walk.wgsl."""

from typing import Any

import numpy as np

from airlight.reference.height import height_column
from airlight.reference.march import height

Array = np.ndarray
MOST_CHANGE = 16.0  # of what a metre adds, from the middle of a range to its end


def sum_of_exponentials(x: Any, n: Any) -> Array:
    """Sums the powers 0 to n - 1 of e^x, (..., 3)."""
    x, n = np.asarray(x, float), np.asarray(n, float)[..., None]
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, n, np.expm1(n * safe) / np.expm1(safe))


def change_of_steps(first: Any, second: Any, n: Any) -> Array:
    """Evaluates the logarithm of the factor by which what n steps add changes from one to the next, (..., 3), from what the first and the
    second half of them add, of the same shape."""
    first, second, n = np.asarray(first, float), np.asarray(second, float), np.asarray(n, float)[..., None]
    little = 1e-3 * np.abs(first + second) + 1e-30
    change = (np.maximum(second, 0) + little) / (np.maximum(first, 0) + little)
    return np.log(np.clip(change, 1 / MOST_CHANGE, MOST_CHANGE)) * 2 / n


def piece_place(k: Any, segment: Any, inside: Any, counts: Any) -> Array:
    """Places the k-th piece of a segment, or a part of one, with counts (..., 3) of pieces before, on and after a range in it."""
    k, segment, inside, counts = (np.asarray(one, float) for one in (k, segment, inside, counts))
    ends = np.stack([segment[..., 0], inside[..., 0], inside[..., 1], segment[..., 1]], axis=-1)
    first = np.concatenate([np.zeros_like(counts[..., :1]), np.cumsum(counts, axis=-1)], axis=-1)
    part = np.clip((k[..., None] - first[..., :3]) / np.maximum(counts, 1), 0, 1)
    return np.asarray(ends[..., 0] + (part * np.diff(ends, axis=-1)).sum(axis=-1))


def range_of_view(i: Any, ray: Any, light: Any) -> Array:
    """Finds (..., 2) the range of t of rays that view i (...) of a sun's shadow map holds; all of them where there is no map."""
    views = light["view"][np.asarray(i, int)]
    ahead = np.maximum(-np.asarray(ray["direction"], float)[..., 2], 1e-6)
    reach = np.asarray(ray["reach"], float)
    if light["views"] == 0:
        return np.stack([np.zeros_like(reach), reach], axis=-1)
    ends = [(np.asarray(views[name], float) + np.asarray(ray["origin"], float)[..., 2]) / ahead for name in ("near", "far")]
    return np.stack([np.clip(end, 0, reach) for end in ends], axis=-1)


def left_by_fog(ray: Any, t: Any, frame: Any, light: Any, kind: str) -> Array:
    """Evaluates (..., 3) what the fog above places at t of rays leaves of a sun's light."""
    places = np.asarray(ray["origin"], float) + np.asarray(t, float)[..., None] * np.asarray(ray["direction"], float)
    fog = float(frame["air"]) * height_column(height(places, frame), (frame["fog_depth"], frame["fog_above"]), kind)
    return np.exp(-np.asarray(frame["sigma_t"], float) * (fog / max(float(light["climb"]), 1e-6))[..., None])
