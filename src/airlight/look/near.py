"""Finds what shafts pass behind: by a depth map, by a subject's mask."""

import math
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.look.grid import Array
from airlight.planes import blur, shrink
from airlight.reference.look import resized, smoothstep

NEAR_RANGE = (0.05, 0.6)  # of the normalised map: all that is nearer than the first hides shafts, nothing beyond the second does
OUTLIERS = (1.0, 99.0)  # percentiles that become 0 and 1
INFINITE = 1e9  # renderers write more where nothing is, which no percentile counts
LEAST_METRE_RATIO = 4.0  # of metres between them, from which distances count in logarithms
WRAP_DIAGONALS = 0.012  # diagonals over which light wraps round a subject
COPY_SIDE_PX = 800  # px of the copy on which it is found


def check_range(near_range: Any) -> tuple[float, float]:
    """Raise AirlightError unless it is two numbers, the first the smaller."""
    try:
        low, high = (float(v) for v in near_range)
    except (TypeError, ValueError):
        low = high = math.nan
    if not (abs(low) <= 100 and abs(high) <= 100 and high - low >= 1e-6):
        raise AirlightError(f"near_range = {near_range!r}: give two numbers, the first the smaller, as in 0.05,0.6")
    return low, high


def normalised(depth: Array) -> Array:
    """Scale a depth map (H, W), larger is farther, to 0..1: between its 1st and 99th percentile, in logarithms where it holds metres.

    Maps within 0..1 are relative. Larger values are taken as metres; the infinite is farthest. 1 everywhere where it is flat.
    """
    depth = np.asarray(depth, np.float32)
    few = depth[:: max(1, depth.shape[0] // 500), :: max(1, depth.shape[1] // 500)]
    few = few[np.abs(few) < INFINITE]
    if not few.size:
        return np.ones(depth.shape, np.float32)
    first, last = (float(v) for v in np.percentile(few, OUTLIERS))
    if last > 1 and first > 0 and last / first > LEAST_METRE_RATIO:
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.log(np.maximum(depth, 1e-30))
        first, last = math.log(first), math.log(last)
    if last - first <= 1e-6 * max(abs(first), abs(last)):
        return np.ones(depth.shape, np.float32)
    return np.asarray(np.clip(np.nan_to_num((depth - first) / (last - first), nan=1.0, posinf=1.0, neginf=0.0), 0, 1), np.float32)


def nearness(depth: Array, near_range: tuple[float, float] = NEAR_RANGE) -> Array:
    """Find what hides shafts, (H, W) float32, 1, by a depth map in which larger is farther."""
    return (1 - smoothstep(normalised(depth), *near_range)).astype(np.float32)


def subject_nearness(subject: Array, wrap: float) -> Array:
    """Lessen the mask of a subject, (H, W) float32, where light wraps round its edge. wrap: 0..1, how much."""
    if wrap <= 0:
        return np.asarray(subject, np.float32)
    small = shrink(subject, COPY_SIDE_PX)
    beside = np.minimum(2 * blur(1 - small, WRAP_DIAGONALS * math.hypot(*small.shape)), 1)
    height, width = subject.shape
    return np.asarray(subject * (1 - wrap * resized(beside, width, height)), np.float32)
