"""Bake particles into a density on a grid of the world, so that it is shadowed, seen the same from everywhere, and integrated exactly.

A particle adds density (1 - q^2)^2, q = distance / radius < 1, whose integral is KERNEL_INTEGRAL density radius^3. On a grid its sum
depends on where the centres of cells lie, so that each kernel is divided by its own sum there: what the grid holds, trilinear between its
centres, has the particles' mass. A radius of less than LEAST_CELLS cells is widened to that, with the same mass.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.messages import counted, number

Array = npt.NDArray[Any]
KERNEL_INTEGRAL = 32 * math.pi / 105
LEAST_CELLS = 2.0  # of a kernel's radius, below which its shape would depend on where it lies in its cell
CELLS = (16, 512)  # along the longest side of a grid
MAX_CELLS = 256**3  # of a grid, as of volumes that are kept
MAX_EXTENT, MIN_CELL = 1e9, 1e-9  # metres
RUNG = 2 ** (1 / 16)  # sizes of cells go by such steps, so that what moves at a border does not stir the kernels of all else
WORK = 2e8  # cells of all kernels together, beyond which large kernels are sampled more coarsely; ten times that, below FAIR
FINEST, FAIR, COARSEST = 64, 8, 4  # cells of a radius beyond which a kernel is sampled in half as many
PROFILE = 33  # places along its radius where a sprite is averaged
CHUNK = 2**17  # cells of kernels that are computed at a time
FAR = 6.0  # times the size of the box that holds all but STRAY of them at each end, beyond which particles have strayed
STRAY = 0.005
MANY = 100  # particles, of fewer none has strayed
WIDENED = 2.0  # times its radius, from which on a line says that particles are drawn wider than they are
SPREAD = 2.0  # mean spacings of a radius that is not given: enough overlap to be even within a quarter
EVEN_DENSITY = 1 / (KERNEL_INTEGRAL * SPREAD**3)
FILLED = 1.168  # edge, in mean spacings, of cells of which those that hold points at random hold two on average


def particle_mass(radii: Array, densities: Array) -> Array:
    """Integrate (N,) the density of particles over the world, m^3."""
    return np.asarray(KERNEL_INTEGRAL * densities * radii**3)


def checked(positions: Any, radii: Any, densities: Any, name: str) -> tuple[Array, Array, Array, list[str]]:
    """Check particles: positions (N, 3), m, radii and densities (N,) float64, of those that have a mass, and what was mended.

    radii, densities: (N,), or one for all. Raises AirlightError for what cannot be, with `name` before it.
    """
    try:
        points = np.asarray(positions, np.float64)
    except (TypeError, ValueError):
        raise AirlightError(f"{name}: positions are no numbers; give (N, 3), metres") from None
    if points.ndim != 2 or points.shape[1] != 3:
        raise AirlightError(f"{name}: positions have the shape {points.shape}; give (N, 3), metres")
    columns, notes = [], []
    for what, values in (("radius", radii), ("density", densities)):
        try:
            column = np.broadcast_to(np.asarray(values, np.float64), (len(points),))
        except (TypeError, ValueError):
            many = counted(len(points), "number")
            raise AirlightError(f"{name}: its values of {what} are not {many}; give (N,), or one for all") from None
        columns.append(column)
    good = np.isfinite(points).all(axis=1) & np.isfinite(columns[0]) & np.isfinite(columns[1])
    if not good.all():
        if not good.any():
            what = f"none of its {len(points)} particles is of finite numbers" if len(points) > 1 else "its only particle is not finite"
            raise AirlightError(f"{name}: {what}; export it again")
        first = f"the first number {int(np.argmin(good))}"
        lost = int((~good).sum())
        which = counted(lost, "particle that is not finite", "particles that are no finite numbers")
        notes.append(f"{name}: {which}, {first}, {'is' if lost == 1 else 'are'} left out")
    for what, column in zip(("radius", "density"), columns, strict=True):
        if (bad := good & (column < 0)).any():
            at = int(np.argmax(bad))
            raise AirlightError(f"{name}: particle {at} has the {what} {column[at]:g}; give 0 or more")
    good &= (columns[0] > 0) & (columns[1] > 0)
    points, (sizes, weights) = points[good], (column[good] for column in columns)
    reach = float(max(np.abs(points).max(initial=0.0), sizes.max(initial=0.0)))
    if reach > MAX_EXTENT:
        raise AirlightError(f"{name}: reaches farther than {MAX_EXTENT:g} m; give a smaller scale")
    if float(weights.max(initial=0.0)) > 1e12:
        raise AirlightError(f"{name}: has a density of {float(weights.max()):g}; give up to 1e12")
    return points, sizes, weights, notes


def spacing(positions: Array) -> float:
    """Estimate how far apart neighbours among points (N, 3) are, m: the edge of the cube that each has for itself; 1 of a single place.

    By the edge of cells of which the filled ones hold two on average, which holds for points on a surface or along a line as well.
    """
    points = np.asarray(positions, np.float64)
    points = points[(np.abs(points) <= MAX_EXTENT).all(axis=1)]  # which NaN is not
    while len(points) > 100_000:  # half of them, which lie together
        axis = int(np.argmax(np.ptp(points, axis=0)))
        points = points[np.argpartition(points[:, axis], len(points) // 2)[: len(points) // 2]]
    if not len(points) or (size := float(np.ptp(points, axis=0).max())) <= 0:
        return 1.0
    low, high = size * 2.0**-20, size
    points = points - points.min(axis=0)

    def filled(edge: float) -> int:
        x, y, z = (points / edge).astype(np.int64).T
        return len(np.unique((x << 42) | (y << 21) | z))

    apart = filled(low)  # at one place two are one
    for _ in range(24):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if apart < 2 * filled(middle) else (low, middle)
    return math.sqrt(low * high) / FILLED


def completed(positions: Array, radii: Any, densities: Any, name: str) -> tuple[Any, Any, list[str]]:
    """Choose radii and densities that are None, and say so: radii of SPREAD mean spacings; with these, densities by which particles that
    are spread evenly add up to 1, else 1."""
    if radii is not None or not len(positions):
        return 1.0 if radii is None else radii, 1.0 if densities is None else densities, []
    radii = SPREAD * spacing(positions)
    line = f"{name}: has no radius: {number(radii, 3)} m, twice the mean spacing"
    if densities is not None:
        return radii, densities, [line]
    return radii, EVEN_DENSITY, [f"{line}; no density: {number(EVEN_DENSITY, 2)}, by which particles that lie evenly add up to 1"]


def radial_profile(alpha: Array) -> Array:
    """Average a sprite's alpha (H, W) over rings around its middle: (PROFILE,) at distances from 0 to its edges, for `bake`.

    It is a kernel without a direction: a disc becomes a ball. What lies in the sprite's corners, beyond its edges, is left out. Raises
    AirlightError where nothing is left.
    """
    values = np.maximum(np.nan_to_num(np.asarray(alpha, np.float64), posinf=0.0, neginf=0.0), 0)
    y, x = ((2 * np.arange(size) + 1) / size - 1 for size in values.shape)
    at = np.hypot(y[:, None], x).ravel() * (PROFILE - 1)
    first = np.minimum(at.astype(int), PROFILE - 1)
    share = at - first
    shares = np.bincount(first, 1 - share, PROFILE) + np.bincount(first + 1, share, PROFILE + 1)[:PROFILE]
    sums = np.bincount(first, (1 - share) * values.ravel(), PROFILE) + np.bincount(first + 1, share * values.ravel(), PROFILE + 1)[:PROFILE]
    met = shares > 1e-6
    rings = np.interp(np.arange(PROFILE), np.flatnonzero(met), sums[met] / shares[met])
    if not (rings * np.arange(PROFILE) ** 2).any():
        raise AirlightError("shows nothing: its alpha, or its luminance where it has none, is 0 everywhere; give another sprite")
    return np.asarray(rings / rings.max())


def bake(
    positions: Any, radii: Any, densities: Any, cells: int = 128, profile: Array | None = None, name: str = "particles"
) -> tuple[Array, Array, list[str]]:
    """Bake particles: the density (Z, Y, X) float32 at the centres of cells, the matrix (4, 4) from indices x, y, z to the world, m, and
    lines that say what was changed.

    positions: (N, 3), m. radii: (N,), m, >= 0; densities: (N,) at the particles' centres, >= 0; or one for all. cells: along the grid's
    longest side. profile: (K,) values >= 0 of another kernel at distances from 0 to the radius, evenly spaced, which is given the same
    mass. A layer of empty cells lies around. Raises AirlightError.
    """
    if not CELLS[0] <= cells <= CELLS[1]:
        raise AirlightError(f"particle_cells = {cells}; give {CELLS[0]} to {CELLS[1]}")
    points, sizes, weights, notes = checked(positions, radii, densities, name)
    points, sizes, weights = _near_ones(points, sizes, weights, notes, name)
    if not len(points):
        return np.zeros((2, 2, 2), np.float32), np.eye(4), [*notes, f"{name}: has no particle with a radius and a density above 0"]
    masses = particle_mass(sizes, weights)
    grid = _Layout(points, sizes, cells)
    _tell_widened(sizes, grid.cell, masses, cells, notes, name)
    coarse: Array | None = None
    for level in range(int(grid.levels.max()), -1, -1):
        shape = grid.shape(level)
        total = np.zeros(shape[::-1]) if coarse is None else refined(coarse, shape[::-1])
        own = grid.levels == level
        edge = grid.cell * 2.0**level
        if own.any():
            _splat(total, (points[own] - grid.origin) / edge, grid.radii[own] / edge, masses[own] / edge**3, profile)
        coarse = total
    assert coarse is not None
    matrix = np.diag([grid.cell, grid.cell, grid.cell, 1.0])
    matrix[:3, 3] = grid.origin
    return np.ascontiguousarray(coarse, np.float32), matrix, notes


class _Layout:
    """Lays a grid around particles. origin: (3,) the centre of its first cell. cell: edge. radii: (N,) as they are drawn. levels: (N,) at
    which multiple of the cell, as a power of two, a kernel is sampled."""

    def __init__(self, points: Array, sizes: Array, cells: int) -> None:
        low, high = points.min(axis=0), points.max(axis=0)
        reach = float(max(np.ptp(np.stack([low - sizes.min(), high + sizes.min()]), axis=0).max(), 2 * sizes.max()))
        self.cell = rung(max(reach / (cells - 1), MIN_CELL, 1e-13 * float(np.abs(points).max())))
        finest = FINEST
        while finest > COARSEST and _work(sizes / self.cell, finest) > (WORK if finest > FAIR else 10 * WORK):
            finest //= 2
        while True:
            self.radii = np.maximum(sizes, LEAST_CELLS * self.cell)
            self.levels = np.maximum(np.ceil(np.log2(self.radii / self.cell / finest)), 0).astype(int)
            held = (self.radii + (2.0**self.levels - 1) * self.cell)[:, None]  # what is refined spreads by less than a coarse cell
            first, last = np.floor((points - held).min(axis=0) / self.cell), np.ceil((points + held).max(axis=0) / self.cell)
            self._shape = (last - first + 1).astype(int)
            over = max(int(self._shape.max()) / cells, (float(np.prod(self._shape, dtype=float)) / MAX_CELLS) ** (1 / 3))
            if over <= 1:
                break
            self.cell = rung(self.cell * max(over, 1.01))
        self.origin = first * self.cell

    def shape(self, level: int) -> tuple[int, int, int]:
        """Give the sides x, y, z of the grid at a level, whose cells begin where those of the finest do."""
        x, y, z = (-(-(int(n) - 1) // 2**level) + 1 for n in self._shape)
        return x, y, z


def rung(length: float) -> float:
    """Round a length up to a power of RUNG."""
    return float(RUNG ** math.ceil(math.log(length) / math.log(RUNG) - 1e-9))


def _work(radii: Array, finest: float) -> float:
    """Count the cells of kernels whose radii, in cells, are halved until they are no more than `finest`."""
    radii = np.maximum(radii, LEAST_CELLS)
    levels = np.maximum(np.ceil(np.log2(radii / finest)), 0)
    return float(((2 * radii / 2**levels + 1) ** 3).sum())


def _splat(total: Array, points: Array, radii: Array, masses: Array, profile: Array | None) -> None:
    """Add kernels to `total` (Z, Y, X), in place. points: (N, 3), radii: (N,), in cells; masses: (N,), in cells."""
    spans = np.floor(2 * radii).astype(int) + 1  # most centres of cells along an axis that a kernel can reach
    order = np.argsort(spans, kind="stable")
    flat, last = total.reshape(-1), np.array(total.shape[::-1]) - 1
    strides = np.array([1, total.shape[2], total.shape[2] * total.shape[1]])
    for span, start, count in zip(*np.unique(spans[order], return_index=True, return_counts=True), strict=True):
        step = max(1, CHUNK // int(span) ** 3)
        along = np.arange(span)
        for begin in range(start, start + count, step):
            own = order[begin : min(begin + step, start + count)]
            at = np.ceil(points[own] - radii[own, None])[..., None] + along  # (n, 3, span)
            square = ((at - points[own][..., None]) / radii[own, None, None]) ** 2
            index = np.clip(at, 0, last[:, None]).astype(np.int64) * strides[:, None]  # those beyond lie out of reach
            reach = square[:, 2, :, None, None] + square[:, 1, None, :, None] + square[:, 0, None, None, :]
            values = np.maximum(1 - reach, 0) ** 2 if profile is None else _of_profile(reach, profile)
            sums = values.sum(axis=(1, 2, 3))
            if profile is not None and not sums.all():  # a ring that falls between the centres
                values[sums == 0] = np.maximum(1 - reach[sums == 0], 0) ** 2
                sums = values.sum(axis=(1, 2, 3))
            values *= (masses[own] / sums)[:, None, None, None]
            place = index[:, 2, :, None, None] + index[:, 1, None, :, None] + index[:, 0, None, None, :]
            np.add.at(flat, place.reshape(-1), values.reshape(-1))


def _of_profile(square: Array, profile: Array) -> Array:
    """Look a kernel up at squares of q."""
    at = np.sqrt(square) * (len(profile) - 1)
    return np.interp(at, np.arange(len(profile)), profile, right=0.0)


def refined(grid: Array, shape: tuple[int, ...]) -> Array:
    """Interpolate a grid to half its spacing, up to a shape, with its border of zeros: the sum becomes eightfold, the mass stays."""
    for axis in range(3):
        grid = np.moveaxis(grid, axis, 0)
        out = np.empty((2 * len(grid) - 1, *grid.shape[1:]))
        out[::2] = grid
        out[1::2] = (grid[:-1] + grid[1:]) / 2
        grid = np.moveaxis(out[: shape[axis]], 0, axis)
    return np.ascontiguousarray(grid)


def _near_ones(points: Array, sizes: Array, weights: Array, notes: list[str], name: str) -> tuple[Array, Array, Array]:
    """Leave out a few particles that lie so far from all others that the grid would be spent on the void between."""
    if len(points) < MANY:
        return points, sizes, weights
    low, high = np.quantile(points, (STRAY, 1 - STRAY), axis=0)
    size = float(max((high - low).max(), 2 * np.median(sizes)))
    near = ((points > low - FAR / 2 * size) & (points < high + FAR / 2 * size)).all(axis=1)
    lost = len(near) - int(near.sum())
    if not lost or lost > 2 * STRAY * len(points):
        return points, sizes, weights
    far = points[int(np.argmax(np.abs(points - (low + high) / 2).max(axis=1)))]
    share = float(particle_mass(sizes, weights)[~near].sum() / particle_mass(sizes, weights).sum())
    place = ", ".join(number(float(v), 4) for v in far)
    which = counted(lost, "particle far from all others", "particles far from all others")
    notes.append(f"{name}: {which}, up to x, y, z = {place}, with {share:.2g} of the mass, {'is' if lost == 1 else 'are'} left out")
    return points[near], sizes[near], weights[near]


def _tell_widened(sizes: Array, cell: float, masses: Array, cells: int, notes: list[str], name: str) -> None:
    """Note where most of the mass is drawn much wider than it is."""
    wide = sizes * WIDENED < LEAST_CELLS * cell
    if masses[wide].sum() > masses.sum() / 2:
        middle = number(float(np.median(sizes[wide])), 2)
        cure = "; raise particle_cells" if cells < CELLS[1] else ""
        notes.append(f"{name}: radii of {middle} m are drawn as {number(LEAST_CELLS * cell, 2)} m, two cells of the grid{cure}")
