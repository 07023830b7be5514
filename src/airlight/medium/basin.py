"""Bake the humid air of lowlands: a density over ground that lies below a level, from the ground up to that level.

As the unpublished shadow-map article of 2014 proposes it, more humidity where the terrain lies below "sea level"; its own way to find that
out is not told. Here it is the ground's height seen from above.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError

Array = npt.NDArray[Any]
CELLS = (16, 512)  # along the longer side of the ground
LAYERS = 16  # of cells from the lowest ground up to the level, at least
MAX_CELLS = 256**3
MAX_MAP = 2**13  # heights along a side
MAX_EXTENT, MIN_SIDE = 1e9, 1e-9  # metres, of a world and of a cell


def bake(ground: Any, bounds: Any, level: float, cells: int = 128) -> tuple[Array, Array] | None:
    """Bake density 1 between ground below a level and that level: (Z, Y, X) float32, the share of each cell that lies there, and the matrix
    (4, 4) from indices x, y, z to the world, m. The box of the grid ends at the level. None where no ground lies below.

    ground: (H, W) world y, m, of texels, z by x; what is not finite is none. bounds: ((x, z), (x, z)), m, of the map's least and greatest
    borders. level: world y, m. cells: along the longer side, at most; a whole number of texels each. Raises AirlightError.
    """
    heights = np.asarray(ground, np.float64)
    if heights.ndim != 2 or not heights.size or max(heights.shape) > MAX_MAP:
        raise AirlightError(f"basin: the ground's heights have the shape {heights.shape}; give (H, W), at most {MAX_MAP} a side")
    box = np.asarray(bounds, np.float64)
    if box.shape != (2, 2) or not np.isfinite(box).all() or np.abs(box).max() > MAX_EXTENT or (box[1] <= box[0]).any():
        raise AirlightError("basin: bounds are no rectangle; give the least x, z, then the greatest, in metres")
    if not CELLS[0] <= cells <= CELLS[1]:
        raise AirlightError(f"basin: cells = {cells}; give {CELLS[0]} to {CELLS[1]}")
    below = np.isfinite(heights) & (heights < level - LAYERS * MIN_SIDE)
    if not below.any():
        return None
    heights, box = _cut(np.where(below, heights, np.inf), below, box)
    texels = -(-max(heights.shape) // cells)  # of a cell, along each side
    pad = [(0, -size % texels) for size in heights.shape]
    step = (box[1] - box[0]) / heights.shape[::-1]
    heights = np.pad(heights, pad, constant_values=np.inf)
    rows, columns = (size // texels for size in heights.shape)
    lowest = float(heights.min())
    edge = float(step.max() * texels)
    layers = int(min(max(np.ceil((level - lowest) / edge), LAYERS), 2 * CELLS[1], MAX_CELLS // (rows * columns)))
    tall = (level - lowest) / layers
    out = np.empty((rows, layers, columns), np.float32)
    for i in range(layers):
        share = np.clip(i + 1 - (heights - lowest) / tall, 0, 1)  # of each texel's part of the layer
        out[:, i] = share.reshape(rows, texels, columns, texels).mean(axis=(1, 3))
    matrix = np.diag([step[0] * texels, tall, step[1] * texels, 1.0])
    matrix[:3, 3] = np.array([box[0, 0], lowest, box[0, 1]]) + np.diag(matrix)[:3] / 2
    return out, matrix


def _cut(heights: Array, below: Array, box: Array) -> tuple[Array, Array]:
    """Cut a map, and its bounds, to what lies below the level."""
    rows, columns = (np.flatnonzero(below.any(axis=axis)) for axis in (1, 0))
    step = (box[1] - box[0]) / heights.shape[::-1]
    first, last = np.array([columns[0], rows[0]]), np.array([columns[-1], rows[-1]]) + 1
    return heights[first[1] : last[1], first[0] : last[0]], np.array([box[0] + first * step, box[0] + last * step])


def without_narrow(heights: Array, width: int) -> Array:
    """Take what is narrower than `width` texels, along x or z, off a map of heights (H, W), as posts and trees: its opening by a square.

    What is not finite stays what it is, and has no say. Source: Serra 1982, Image Analysis and Mathematical Morphology.
    """
    widths = [min(width, size) for size in heights.shape]
    if max(widths) <= 1:
        return heights
    known = np.isfinite(heights)
    least = np.where(known, heights, np.inf)  # over the square that begins at a texel
    for axis in (0, 1):
        least = _extreme(least, widths[axis], axis, np.minimum)
    least[heights.shape[0] - widths[0] + 1 :], least[:, heights.shape[1] - widths[1] + 1 :] = -np.inf, -np.inf  # no whole square
    most = np.where(np.isfinite(least), least, -np.inf)[::-1, ::-1]
    for axis in (0, 1):
        most = _extreme(most, widths[axis], axis, np.maximum)
    return np.where(known, np.minimum(most[::-1, ::-1], heights), heights)


def _extreme(values: Array, width: int, axis: int, better: Any) -> Array:
    """Find the extremes of `width` values along an axis, from each one on; at its end of those that are left."""
    values, done = np.moveaxis(values, axis, 0), 1
    while done < width:
        step = min(done, width - done)
        values = np.concatenate([better(values[:-step], values[step:]), values[-step:]])
        done += step
    return np.moveaxis(values, 0, axis)
