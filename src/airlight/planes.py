"""Small operations on planes (H, W[, C]) that statistics of pictures are made of: shrinking, blurring, parts that hang together."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
ROWS = 64  # of a chunk of by_rows; divides the dither tile


def smoothstep(x: Any, low: float, high: float) -> Any:
    """Rise from 0 at `low` to 1 at `high`, smoothly; falls where low > high."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def by_rows(work: Callable[[int, int], None], height: int) -> None:
    """Call work(first row, row after the last) for chunks of rows, on two threads where the picture is large."""
    spans = [(y, min(y + ROWS, height)) for y in range(0, height, ROWS)]
    if len(spans) < 4:
        for span in spans:
            work(*span)
        return
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        for _ in pool.map(lambda span: work(*span), spans):
            pass


def shrunk_size(width: int, height: int, side: int) -> tuple[int, int]:
    """Compute the size (width, height) of a copy whose longer side is at most `side` px."""
    scale = min(1.0, side / max(width, height))
    return max(1, round(width * scale)), max(1, round(height * scale))


def shrink(plane: Array, side: int) -> Array:
    """Average areas into a copy whose longer side is at most `side` px."""
    return shrink_to(plane, *shrunk_size(plane.shape[1], plane.shape[0], side))


def shrink_to(plane: Array, columns: int, rows: int) -> Array:
    """Average areas into a copy of so many pixels, no more than there are; borders of areas count by their share."""
    height, width = plane.shape[:2]
    if (rows, columns) == (height, width):
        return plane.astype(np.float32, copy=False)
    return _means(_means(plane, rows, 0), columns, 1).astype(np.float32, copy=False)


def block_means(plane: Array, side: int) -> Array:
    """Average blocks of side x side px; what is left over at the right and below is dropped."""
    rows, columns = plane.shape[0] // side, plane.shape[1] // side
    blocks = plane[: rows * side, : columns * side].reshape(rows, side, columns, side, *plane.shape[2:])
    return np.asarray(blocks.mean(axis=(1, 3)))


def _means(plane: Array, count: int, axis: int) -> Array:
    """Average `count` equal segments along an axis, each from its own pixels alone: one that is no number spoils no other's."""
    size = plane.shape[axis]
    if count == size:
        return plane
    at = np.arange(count + 1) * (size / count)
    low = np.minimum(at[:-1].astype(int), size - 1)
    share = (at[:-1] - low).reshape([-1 if a == axis else 1 for a in range(plane.ndim)])
    total = np.add.reduceat(plane, low, axis=axis, dtype=np.float64)
    inner = [slice(None)] * plane.ndim
    inner[axis] = slice(None, -1)
    with np.errstate(invalid="ignore"):  # of the infinite
        before = np.take(plane, low, axis=axis) * share  # of a pixel on a border, what belongs to the segment before
        total -= before
        total[tuple(inner)] += np.take(before, range(1, count), axis=axis)
    return np.asarray(total * (count / size))


def box(plane: Array, radius: int) -> Array:
    """Average over a square of 2 radius + 1 px, the border repeated."""
    for axis in (0, 1):
        size = plane.shape[axis]
        wide = np.take(plane, np.clip(np.arange(-radius - 1, size + radius), 0, size - 1), axis=axis)
        total = np.cumsum(wide, axis=axis, dtype=np.float64)
        reach = 2 * radius + 1
        plane = (np.take(total, range(reach, reach + size), axis=axis) - np.take(total, range(size), axis=axis)) / reach
    return plane


def box_radii(sigma: float) -> tuple[int, int, int]:
    """Choose the radii of three boxes whose widths' variances add up to that of a Gaussian as nearly as whole pixels can."""
    low = int((np.sqrt(4 * sigma**2 + 1) - 1) / 2)
    grown = round((12 * sigma**2 - 3 * ((2 * low + 1) ** 2 - 1)) / ((2 * low + 3) ** 2 - (2 * low + 1) ** 2))
    return (low + (grown > 0), low + (grown > 1), low + (grown > 2))


def blur(plane: Array, sigma: float) -> Array:
    """Blur by a Gaussian of sigma px, the border repeated; beyond 3 px by three boxes: within 10 % of its peak on a line, 19 % of a
    point."""
    if sigma < 0.2:
        return plane
    if sigma > 3:
        for radius in box_radii(sigma):
            plane = box(plane, radius)
        return plane
    reach = max(1, int(3 * sigma + 0.5))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        size = plane.shape[axis]
        wide = np.take(plane, np.clip(np.arange(-reach, size + reach), 0, size - 1), axis=axis)
        plane = sum(k * np.take(wide, range(i, i + size), axis=axis) for i, k in enumerate(kernel))
    return plane


def label(mask: Array) -> tuple[npt.NDArray[np.int32], int]:
    """Number the connected parts of a mask: (H, W) int32, 0 where it is False, else from 1; and how many there are.

    Pixels hang together over edges and corners. Runs of rows are joined by the least number among neighbours, to the end.
    """
    height, width = mask.shape
    padded = np.zeros((height, width + 2), np.int8)
    padded[:, 1:-1] = mask
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    _, end = np.nonzero(change == -1)
    count = len(row)
    if not count:
        return np.zeros((height, width), np.int32), 0
    span = width + 2
    # of each run, those of the row below that touch it: their ends lie beyond its start, their starts before its end, corners included
    keys_first, keys_end = row * span + first, row * span + end
    low = np.searchsorted(keys_end, (row + 1) * span + first, side="left")
    high = np.searchsorted(keys_first, (row + 1) * span + end, side="right")
    touching = np.maximum(high - low, 0)
    above = np.repeat(np.arange(count), touching)
    below = np.arange(touching.sum()) - np.repeat(np.cumsum(touching) - touching, touching) + np.repeat(low, touching)
    root = np.arange(count)
    while True:
        least = np.minimum(root[above], root[below])
        joined = root.copy()
        np.minimum.at(joined, root[above], least)
        np.minimum.at(joined, root[below], least)
        while not np.array_equal(joined, joined[joined]):
            joined = joined[joined]
        if np.array_equal(joined, root):
            break
        root = joined
    _, number = np.unique(root, return_inverse=True)
    marks = np.zeros((height, width + 1), np.int32)
    np.add.at(marks, (row, first), number + 1)
    np.add.at(marks, (row, end), -(number + 1))
    return np.cumsum(marks, axis=1)[:, :width].astype(np.int32), int(number.max()) + 1
