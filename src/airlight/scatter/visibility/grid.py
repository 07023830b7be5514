"""Lays out the grid of a table of visibility: rows through the epipole, rays on a row, blocks of distance. NumPy only, float64.

The derivation is in scatter/visibility/grid.wgsl's head. Pixels p lie in [0, W] x [0, H]; the ray of the eye through p goes along
(x, y, -1), (x, y) as of projection.eye_rays.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
WORD = 32  # rays
MOST_WORDS = 4  # of a row
FULL_PX = 1280  # of a picture's longer side, from which on spacings are as they are said
LEAST_SCALE = 0.4  # of spacings, in small pictures
MARGIN_PX = 2.0  # behind the edge through which a row enters the picture
NEAREST = 1 - 1e-6  # of the way to the epipole, up to where a row begins
EDGES = ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0))  # left, right, upper, lower: axis, share of the picture's size there


@dataclass(frozen=True)
class Fineness:
    """Sets how fine a table is: pixels between rows where they leave the picture, and between rays; of suns blocks an octave of distance, a
    power of 2, and texels of the widest block, a power of 2; of lamps blocks in all."""

    row_px: float
    ray_px: float
    per: int = 8
    widest: int = 32
    blocks: int = 64

    def of_picture(self, size: tuple[int, int]) -> "Fineness":
        """Lays rows and rays closer in pictures smaller than FULL_PX, so that as much is seen between them."""
        scale = min(max(max(size) / FULL_PX, LEAST_SCALE), 1.0)
        return replace(self, row_px=self.row_px * scale, ray_px=self.ray_px * scale)


@dataclass(frozen=True)
class RowGrid:
    """Holds the rows of a picture of `size` (width, height).

    slope, offset: away(p) = slope p - offset points away from the epipole in the picture. rate: (2,) rows a pixel, of upright edges and
    of level ones.
    first, last: (4,) rows that leave through each of EDGES, last < first where none does. rays: (4,) of such a row. begin, end: (N, 2) px,
    of rows' first rays and last.
    """

    size: tuple[int, int]
    slope: float
    offset: Array
    rate: Array
    first: Array
    last: Array
    rays: Array
    begin: Array
    end: Array

    @property
    def epipole(self) -> Array:
        """Returns (2,) px of the point in the picture's plane that all rows go through; far away where they are parallel."""
        return self.offset / max(self.slope, 1e-12)

    @property
    def edge(self) -> Array:
        """Lists (N,) the edge, of EDGES, through which each row leaves."""
        return np.repeat(np.arange(4), np.maximum(self.last - self.first + 1, 0))

    @property
    def apart(self) -> float:
        """Bounds, px, how far neighbouring rays are from each other in the picture along either axis."""
        along = np.linalg.norm(self.end - self.begin, axis=1) / (self.rays[self.edge] - 1)
        return float(along.max() + 1 / max(self.rate[self.rate > 0].min(initial=np.inf), 1e-3))

    @property
    def words(self) -> int:
        """Counts the words of the widest row."""
        return int(self.rays.max()) // WORD

    def rays_of_ends(self, rays: Any) -> list[np.ndarray]:
        """Gives the rays (N, 3), view space, 1 deep, through where rows begin, and where they end. rays: as of projection.eye_rays."""
        scale_x, scale_y, from_x, from_y = rays
        places = (p / np.array(self.size, float) * (scale_x, scale_y) + (from_x, from_y) for p in (self.begin, self.end))
        return [np.column_stack([at, np.full(len(at), -1.0)]) for at in places]


def row_grid(towards: Any, rays: Any, size: tuple[int, int], fineness: Fineness) -> RowGrid:
    """Lays rows out. towards: (3,) unit vector to a sun, view space; rays: (4,) as of projection.eye_rays; size: (width, height), px."""
    x, y, z = (float(v) for v in towards)
    scale_x, scale_y, from_x, from_y = (float(v) for v in rays)
    a = -z
    side = -1.0 if a < 0 else 1.0
    wide = np.array(size, float)
    offset = side * np.array([(x - a * from_x) / scale_x, (y - a * from_y) / scale_y]) * wide
    slope = abs(a)
    reach = min(NEAREST / max(slope, 1e-300), 1e30)
    rate, first, last, counts = np.zeros(2), np.zeros(4, np.int64), np.full(4, -1), np.full(4, WORD)
    exits = [_is_exit(edge, slope, offset, wide) for edge in EDGES]
    for axis in (0, 1):
        sines = [_largest_sine(edge, slope, offset, wide) for edge, leaves in zip(EDGES, exits, strict=True) if leaves and edge[0] == axis]
        rate[axis] = max(sines, default=0.0) / fineness.row_px
    begins, ends, count = [], [], 0
    for k, ((axis, share), leaves) in enumerate(zip(EDGES, exits, strict=True)):
        first[k], last[k] = count, count - 1
        if not leaves:
            continue
        number = math.ceil(wide[1 - axis] * rate[axis]) + 1
        end = np.empty((number, 2))
        end[:, axis] = share * wide[axis]
        end[:, 1 - axis] = np.arange(number) / max(rate[axis], 1e-12)
        away = slope * end - offset
        with np.errstate(divide="ignore"):
            back = (np.where(away > 0, end, wide - end) + MARGIN_PX) / np.maximum(np.abs(away), 1e-12)
        begin = end - np.minimum(back.min(axis=1), reach)[:, None] * away
        length = float(np.linalg.norm(end - begin, axis=1).mean())
        counts[k] = WORD * min(max(round(length / fineness.ray_px / WORD), 1), MOST_WORDS)
        count, last[k] = count + number, count + number - 1
        begins.append(begin)
        ends.append(end)
    return RowGrid(size, slope, offset, rate, first, last, counts, np.concatenate(begins), np.concatenate(ends))


def _is_exit(edge: tuple[int, float], slope: float, offset: Array, size: Array) -> bool:
    """Tells whether rows leave the picture through an edge."""
    axis, share = edge
    along = slope * share * size[axis] - offset[axis]
    return bool((along if share else -along) > 0)


def _largest_sine(edge: tuple[int, float], slope: float, offset: Array, size: Array) -> float:
    """Finds the largest sine between an edge and the rows that leave through it."""
    axis, share = edge
    across = abs(slope * share * size[axis] - offset[axis])
    ends = slope * np.array([0.0, size[1 - axis]]) - offset[1 - axis]
    if ends[0] <= 0 <= ends[1]:
        return 1.0
    return float(across / np.hypot(across, np.abs(ends).min()))


def block_count(texels: float, per: int, widest: int) -> int:
    """Counts the blocks up to so many texels from the eye."""
    if texels < per:
        return max(math.ceil(texels), 1)
    if texels > per * widest:
        return per + round(per * math.log2(widest)) + math.ceil(texels / widest) - per
    octave = math.floor(math.log2(texels / per))
    return per + per * octave + math.ceil(per * (texels / (per * 2**octave) - 1))
