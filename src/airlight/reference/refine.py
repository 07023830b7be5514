"""Evaluates in float64 how scatter/march chooses the pixels that it marches by themselves, each function under its shader's name."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.march import positions, relative_difference

Array = npt.NDArray[np.floating[Any]]
BEND_SHARE, DEVIATION_SHARE, SPAN_SHARE = 4.0, 0.5, 0.125  # of what a pixel may be wrong by
BINS, FIRST_BIN = 16, 6


def grey(radiance: Any) -> Array:
    """Averages the colours of radiance (..., 3)."""
    return np.asarray(np.asarray(radiance, float).mean(axis=-1))


def upsampling_error(bend: Any, deviation: Any, span: Any) -> Array:
    """Estimates the error of upsampled radiance, from the difference of means over 4 x 4 neighbours and over 2 x 2, the standard deviation
    of the former, and the range of the latter."""
    bend, deviation, span = (np.asarray(one, float) for one in (bend, deviation, span))
    return np.maximum(BEND_SHARE * np.abs(bend), np.maximum(DEVIATION_SHARE * deviation, SPAN_SHARE * span))


def error_bin(error: Any) -> npt.NDArray[np.int64]:
    """Chooses the lists of errors, in units of the mean radiance: each begins at sqrt(2) times the one before, the second at 0.18."""
    return np.clip(np.floor(2 * np.log2(np.asarray(error, float)) + FIRST_BIN), 0, BINS - 1).astype(np.int64)


def pack_pixel(pixel: Any) -> npt.NDArray[np.int64]:
    """Packs pixels (..., 2) of the picture."""
    at = np.asarray(pixel, np.int64)
    return np.asarray(at[..., 0] + (at[..., 1] << 16))


def unpack_pixel(packed: Any) -> npt.NDArray[np.int64]:
    """Unpacks (..., 2) pixels of the picture."""
    at = np.asarray(packed, np.int64)
    return np.stack([at & 0xFFFF, at >> 16], axis=-1)


def mean_of_grid(marched: Any, along: int = 128) -> float:
    """Averages a march (h, w, 4) over a grid of its pixels."""
    rows, columns = ((2 * np.arange(along) + 1) * size // (2 * along) for size in np.shape(marched)[:2])
    return float(grey(np.asarray(marched, float)[np.ix_(rows, columns)][..., :3]).mean())


def upsampling_errors(marched: Any, lengths: Array, sharpness: float = 24.0) -> Array:
    """Estimates the errors (H, W) of upsampling a march (h, w, 4), radiance and lengths of rays, m, for rays of lengths (H, W).

    Pixels between the same four of what is marched have the greatest of theirs.
    """
    marched = np.asarray(marched, float)
    sizes = marched.shape[:2]
    y, x = positions(sizes, lengths.shape)
    means, deviations = [], []
    for radius in (2, 1):  # of the neighbours that count, in pixels of the march
        sums, squares, weights = np.zeros((3, *lengths.shape))
        for row, column in np.ndindex(2 * radius, 2 * radius):
            i, j = np.floor(y).astype(int) + 1 - radius + row, np.floor(x).astype(int) + 1 - radius + column
            texel = marched[np.clip(i, 0, sizes[0] - 1), np.clip(j, 0, sizes[1] - 1)]
            near = np.maximum(radius - np.abs(i - y), 0) * np.maximum(radius - np.abs(j - x), 0)
            weight = near * np.exp(-sharpness * relative_difference(texel[..., 3], lengths)) + 1e-20
            sums, squares = sums + weight * grey(texel[..., :3]), squares + weight * grey(texel[..., :3]) ** 2
            weights = weights + weight
        means.append(sums / weights)
        deviations.append(np.sqrt(np.maximum(squares / weights - means[-1] ** 2, 0)))
    i, j = np.floor(y).astype(int), np.floor(x).astype(int)
    corners = [grey(marched[np.clip(i + a, 0, sizes[0] - 1), np.clip(j + b, 0, sizes[1] - 1)][..., :3]) for a, b in np.ndindex(2, 2)]
    each = upsampling_error(means[0] - means[1], deviations[0], np.ptp(corners, axis=0))
    cells = (i - i.min()) * (np.ptp(j) + 1) + j - j.min()
    most = np.zeros(cells.max() + 1)
    np.maximum.at(most, cells, each)
    return np.asarray(most[cells])
