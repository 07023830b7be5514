"""Evaluates how what steps of a ray add to daylight's sunlight changes from one to the next, float64: twins of
scatter/march/air_steps.wgsl and air_walk.wgsl."""

from typing import Any

import numpy as np

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
