"""Divides rays for lights that have a shape, as ground truth: at the planes that bound a light, and where the rays cross lines through the
centres of a cookie's pixels, between which it is smooth."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PunctualLight

Array = npt.NDArray[Any]
Segments = tuple[Array, Array, Array]
MOST = 4000  # crossings of a ray and a light's repeated cookie


def clipped(segments: Segments, origin: Array, ray: Array, light: PunctualLight) -> Segments:
    """Leaves of segments of rays, origin and ray (R, 3), what the planes of a light let be lit."""
    planes = light.planes()
    if not len(planes):
        return segments
    which, start, end = segments
    at, grows = origin[which] @ planes[:, :3].T + planes[:, 3], ray[which] @ planes[:, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        root = -at / grows
    first = np.where(grows > 0, root, np.where((grows == 0) & (at < 0), np.inf, -np.inf)).max(axis=1)
    last = np.where(grows < 0, root, np.inf).min(axis=1)
    start, end = np.maximum(start, first), np.minimum(end, last)
    kept = end > start
    return which[kept], start[kept], end[kept]


def crossings(origin: Array, ray: Array, light: PunctualLight, reach: Array) -> Array:
    """Finds (R, K) distances along rays, origin and ray (R, 3), at which they cross lines of a cookie's pixels' centres; of a directional
    light's those up to reach (R,)."""
    if light.cookie is None:
        return np.zeros((len(ray), 0))
    axes, (rows, columns) = light.axes(), light.cookie.pixels.shape[:2]
    q, a = (origin - light.origin()) @ axes.T, ray @ axes.T
    found = []
    for axis, count in ((0, columns), (1, rows)):
        if light.directional:
            each = light.cookie.size / columns  # m
            first, last = q[:, axis] / each - 0.5 * (count + 1), (q[:, axis] + reach * a[:, axis]) / each - 0.5 * (count + 1)
            low, high = np.ceil(np.minimum(first, last)), np.floor(np.maximum(first, last))
            most = int(np.clip((high - low).max(initial=-1) + 1, 0, MOST))
            line = low[:, None] + np.arange(most)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = ((line + 0.5 * (count + 1)) * each - q[:, axis, None]) / a[:, axis, None]
            found.append(np.where((line <= high[:, None]) & np.isfinite(t), t, 0.0))
        else:
            half = light.tangents()[axis] * ((2 * np.arange(count) + 1) / count - 1)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (half * q[:, 2, None] - q[:, axis, None]) / (a[:, axis, None] - half * a[:, 2, None])
            found.append(np.where(np.isfinite(t), t, 0.0))
    return np.concatenate(found, axis=1)


def divided(segments: Segments, breaks: Array) -> tuple[Array, Segments]:
    """Cuts segments at breaks (R, K) of their rays: the segment that each part is of, and the parts."""
    which, start, end = segments
    marks = np.sort(np.column_stack([start, np.clip(breaks[which], start[:, None], end[:, None]), end]), axis=1)
    row, column = np.nonzero(marks[:, 1:] > marks[:, :-1])
    return row, (which[row], marks[row, column], marks[row, column + 1])
