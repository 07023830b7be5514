"""Hold densities on a grid with their place in the world, and the rules that every format's voxels are held to."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product
from typing import NoReturn

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import counted

MAX_VOXELS = 256**3  # of a grid that is kept; what is larger is coarsened to it
MAX_SIDE = 2048  # voxels along an axis of a grid that is kept: the largest 3-D texture of WebGPU's defaults
MAX_EXTENT = 1e9  # greatest coordinate in the world, as of scenes
MIN_SIDE = 1e-9  # of a voxel or of a grid
MAX_BROKEN = 0.01  # share of voxels that are no numbers, beyond which a file is refused
MAX_NEGATIVE = 0.01  # of the greatest density: by how much a voxel may lie below 0 before it is no overshoot of a simulation any more
CLAMPED = 0.5  # voxels from the outermost centres to the faces of a dense grid
_AROUND = [np.array(step) for step in product((-1, 0, 1), repeat=3) if any(step)]


@dataclass(frozen=True, eq=False)
class Volume:
    """Density on a grid.

    density: float32 (Z, Y, X), contiguous, finite, >= 0, a factor of the medium's coefficients. matrix: float64 (4, 4) from a voxel's index
    (x, y, z, 1), its centre at whole numbers, to world metres, y up. edge: voxels by which the density reaches beyond the outermost
    centres; it is trilinear between centres, that of the nearest ones beyond them, and 0 farther out: 0 where a layer of empty voxels lies
    around, as of OpenVDB, 0.5 for dense grids. name: of the grid, "" where it has none. stored: (Z, Y, X) before it was coarsened.
    told: what was mended or changed, a line each.
    """

    density: np.ndarray
    matrix: np.ndarray
    edge: float
    path: str
    name: str = ""
    stored: tuple[int, ...] = ()
    told: tuple[str, ...] = ()

    @property
    def bounds(self) -> np.ndarray:
        """Give the world box (2, 3) in metres, outside of which the density is 0."""
        ends = np.array([[-self.edge] * 3, np.array(self.density.shape[::-1]) - 1 + self.edge])
        corners = np.array([[*(ends[pick, axis] for axis, pick in enumerate(picks)), 1] for picks in product((0, 1), repeat=3)])
        world = corners @ self.matrix[:3].T
        return np.array([world.min(axis=0), world.max(axis=0)])

    @property
    def mass(self) -> float:
        """Integrate the density over the world, m^3."""
        return float(self.density.sum(dtype=np.float64) * abs(np.linalg.det(self.matrix[:3, :3])))


@dataclass
class Findings:
    """Check voxels as they are read, and remember what was wrong with them.

    path: of the file, for messages. broken, negative: how many are no finite numbers, below 0; first: the (x, y, z) indices of the first
    of each. least, most: of the finite densities. places: (N, 3) indices x, y, z of the broken ones, in pieces.
    """

    path: str
    count: int = 0
    broken: int = 0
    negative: int = 0
    least: float = 0.0
    most: float = 0.0
    first: dict[str, tuple[int, ...]] = field(default_factory=dict)
    places: list[np.ndarray] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def refuse(self, what: str, cure: str = "export it again") -> NoReturn:
        raise AirlightError(f"{self.path}: {what}; {cure}")

    def note(self, line: str) -> None:
        self.notes.append(f"{self.path}: {line}")

    def clean(self, values: np.ndarray, indices: Iterable[np.ndarray], counted: int | None = None) -> np.ndarray:
        """Give float64 values with 0 for those that are no densities. indices: x, y, z of each, of shapes that broadcast to the values'.
        counted: how many are looked at, all unless said."""
        self.count += values.size if counted is None else counted
        values = values.astype(np.float32).astype(np.float64)
        low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
        if not np.isfinite(low) or not np.isfinite(high):
            bad = ~np.isfinite(values)
            places = self._places(bad, indices)
            self.first.setdefault("broken", tuple(int(v) for v in places[0]))
            self.broken += len(places)
            if sum(map(len, self.places)) <= MAX_VOXELS * MAX_BROKEN:
                self.places.append(places)
            values[bad] = 0.0
            low, high = float(values.min()), float(values.max())
        if low < 0:
            bad = values < 0
            self.first.setdefault("negative", tuple(int(v) for v in self._places(bad, indices)[0]))
            self.negative += int(np.count_nonzero(bad))
            values[bad] = 0.0
        self.least, self.most = min(self.least, low), max(self.most, high)
        return values

    def _places(self, bad: np.ndarray, indices: Iterable[np.ndarray]) -> np.ndarray:
        return np.stack([np.broadcast_to(index, bad.shape)[bad] for index in indices], axis=-1)

    def judge(self, coarsened: bool) -> None:
        """Refuse voxels that are not densities, or note what is made of them."""
        if self.broken > MAX_BROKEN * self.count:
            what = "is no finite number" if self.broken == 1 else "are no finite numbers"
            self.refuse(f"{self.broken} of its {counted(self.count, 'voxel')} {what}, the first at {self._first('broken')}")
        if self.least < -MAX_NEGATIVE * self.most:
            voxels = counted(self.negative, "voxel")
            what = f"has negative densities, {voxels} down to {self.least:.4g}, the first at {self._first('negative')}"
            self.refuse(what, "densities are 0 or more: is it a distance, or another field?")
        if self.broken:
            made = "taken as 0" if coarsened else "mended from those around"
            which = counted(self.broken, "voxel that is no finite number", "voxels that are no finite numbers")
            self.note(f"{which}, the first at {self._first('broken')}, {'is' if self.broken == 1 else 'are'} {made}")
        if self.negative:
            verb = "is" if self.negative == 1 else "are"
            self.note(f"{counted(self.negative, 'voxel')} slightly below 0, down to {self.least:.4g}, {verb} taken as 0")

    def _first(self, kind: str) -> str:
        return "x, y, z = " + ", ".join(map(str, self.first[kind]))

    def mend(self, grid: np.ndarray, corner: np.ndarray) -> None:
        """Give broken voxels of a grid (Z, Y, X) the mean of the sound ones around. corner: the index x, y, z of the grid's first voxel."""
        if not self.places:
            return
        shape = np.array(grid.shape)
        places = np.concatenate(self.places)[:, ::-1] - np.asarray(corner)[::-1]
        places = places[((places >= 0) & (places < shape)).all(axis=1)]
        sound = np.ones(grid.shape, bool)
        sound[tuple(places.T)] = False
        total, number = np.zeros(len(places)), np.zeros(len(places))
        for step in _AROUND:
            near = places + step
            inside = ((near >= 0) & (near < shape)).all(axis=1)
            inside[inside] = sound[tuple(near[inside].T)]
            total[inside] += grid[tuple(near[inside].T)]
            number[inside] += 1
        grid[tuple(places.T)] = total / np.maximum(number, 1)

    def finish(self, grid: np.ndarray, matrix: np.ndarray, edge: float, name: str, stored: tuple[int, ...]) -> Volume:
        """Make the volume."""
        return Volume(np.ascontiguousarray(grid, np.float32), matrix, edge, self.path, name, stored, tuple(self.notes))

    def note_coarser(self, stored: tuple[int, ...], kept: tuple[int, ...], limit: int) -> None:
        """Note that a grid, both as (Z, Y, X), was coarsened."""
        before, after = ("x".join(map(str, shape[::-1])) for shape in (stored, kept))
        most = f"{limit}, and {MAX_SIDE} a side"
        self.note(f"{before} voxels are more than are kept ({most}): coarsened to {after} by means, which keep the mass")


def kept_shape(shape: Iterable[int], limit: int) -> tuple[int, ...]:
    """Choose the shape that a grid is kept in: its own, or all sides less by one factor, so that `limit` and MAX_SIDE hold."""
    sides = [int(n) for n in shape]
    low, high = 0.0, 1.0
    if math.prod(_shrunk(sides, high)) <= limit:
        return _shrunk(sides, high)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if math.prod(_shrunk(sides, middle)) <= limit else (low, middle)
    return _shrunk(sides, low)


def _shrunk(sides: list[int], factor: float) -> tuple[int, ...]:
    return tuple(max(1, min(MAX_SIDE, int(n * factor + 1e-9))) for n in sides)


def placed(matrix: np.ndarray, scale: float, up: str, path: str) -> np.ndarray:
    """Bring a matrix from indices to the file's own space into the world: metres by `scale`, and up turned to +y. Raises AirlightError.

    up: the file's axis that points up; of "z", (x, y, z) becomes (x, z, -y).
    """
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.float64) if up == "z" else np.eye(3)
    out = np.eye(4)
    out[:3] = scale * turn @ matrix[:3]
    edges = np.linalg.norm(out[:3, :3], axis=0)
    volume = abs(np.linalg.det(out[:3, :3] / np.where(edges > 0, edges, 1)))
    if not np.isfinite(out).all() or np.abs(out).max() > MAX_EXTENT:
        raise AirlightError(f"{path}: reaches farther than {MAX_EXTENT:g} m; give a smaller scale")
    if edges.min() < MIN_SIDE or volume < 1e-6:
        raise AirlightError(f"{path}: its voxels are flat, of sides {edges[0]:.3g}, {edges[1]:.3g} and {edges[2]:.3g} m; export it again")
    return out


def between(bounds: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Derive the matrix from indices x, y, z to the space of bounds (2, 3), the outer faces of a grid of shape (Z, Y, X)."""
    out = np.eye(4)
    step = (bounds[1] - bounds[0]) / np.array(shape[::-1])
    out[[0, 1, 2], [0, 1, 2]] = step
    out[:3, 3] = bounds[0] + step / 2
    return out


def coarser(matrix: np.ndarray, stored: tuple[int, ...], kept: tuple[int, ...], first: np.ndarray, margin: int) -> np.ndarray:
    """Derive the matrix of a grid of shape `kept` that fills the same box as one of shape `stored` (Z, Y, X).

    matrix: of the stored one. first: the index x, y, z of the stored one's first voxel. margin: layers put around the kept one.
    """
    ratio = np.array(stored[::-1]) / np.array(kept[::-1])
    index = np.eye(4)
    index[[0, 1, 2], [0, 1, 2]] = ratio
    index[:3, 3] = first + (0.5 - margin) * ratio - 0.5
    return matrix @ index


def sound_bounds(bounds: np.ndarray) -> bool:
    """Tell whether (2, 3) numbers can be the outer faces of a grid: finite, of an order, and not so thin that they must be garbage."""
    if not np.isfinite(bounds).all() or np.abs(bounds).max() > MAX_EXTENT:
        return False
    return bool((bounds[1] - bounds[0]).min() > max(MIN_SIDE, 1e-9 * float(np.abs(bounds).max())))
