"""Bad pixels: NaN and infinities in float pictures."""

import warnings

import numpy as np

from airlight.errors import AirlightError, AirlightWarning

MOST_BAD = 0.01


def repair(values: np.ndarray, name: str) -> np.ndarray:
    """Replace NaN and Inf in `values` (H, W, C) float by the mean of the finite 3x3 neighbours of that channel, else 0.

    Gives `values` itself when all is finite, else a copy, with one AirlightWarning that says how many pixels and where.
    Raises AirlightError when more than 1 % of the pixels are bad.
    """
    bad = ~np.isfinite(values)
    if not bad.any():
        return values
    height, width = values.shape[:2]
    places = np.argwhere(bad.any(axis=2))
    count = len(places)
    # A tiny picture may have one bad pixel without being hopeless.
    if count > max(1, MOST_BAD * height * width):
        raise AirlightError(
            f"{name}: {count} of {height * width} pixels are NaN or infinite, more than 1 %; render or export the picture again"
        )
    mended = values.copy()
    for y, x in places:
        near = values[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].reshape(-1, values.shape[2])
        with np.errstate(invalid="ignore"):  # signalling NaN
            near = near.astype(np.float64)
        fine = np.isfinite(near)
        total = np.where(fine, near, 0).sum(axis=0)
        mean = total / np.maximum(fine.sum(axis=0), 1)
        mended[y, x] = np.where(bad[y, x], mean, values[y, x])
    y, x = places[0]
    pixels = "pixel was" if count == 1 else "pixels were"
    warnings.warn(
        f"{name}: {count} {pixels} NaN or infinite (the first at x={x}, y={y}) and mended from the neighbours",
        AirlightWarning,
        stacklevel=3,
    )
    return mended
