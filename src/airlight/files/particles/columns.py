"""Find out which columns of a table are positions, radii and densities."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import counted, nearest

MAX_PARTICLES = 2**22
MAX_COLUMNS = 256
_AXIS = re.compile(r"(?:([xyz])|(?:p|pos|position|points?|loc|location|coord)[ _.:]?\[?([xyz012])\]?)")
_UNIT = re.compile(r"\s*[\[(][^\])]*[\])]$")
RADIUS, DIAMETER, DENSITY = ("radius", "radii", "rad", "pscale", "r"), ("diameter",), ("density", "densities", "rho")


@dataclass(frozen=True, eq=False)
class Particles:
    """Holds particles: positions (N, 3) float64, metres; radii, densities (N,) float64, None where the file has none.

    told: what was not read, a line each.
    """

    positions: np.ndarray
    radii: np.ndarray | None
    densities: np.ndarray | None
    path: str
    told: tuple[str, ...] = ()


@dataclass(frozen=True)
class Columns:
    """Says which columns are x, y, z, the radius, and the density; None where there is none. halved: the radius is a diameter."""

    axes: tuple[int, int, int]
    radius: int | None
    density: int | None
    halved: bool = False
    told: tuple[str, ...] = ()

    @property
    def used(self) -> list[int]:
        return [*self.axes, *(one for one in (self.radius, self.density) if one is not None)]

    def particles(self, column: Callable[[int], np.ndarray], path: str) -> Particles:
        """Gather particles from a function that gives the values of a column."""
        points = np.column_stack([np.asarray(column(axis), np.float64) for axis in self.axes])
        radii = None if self.radius is None else np.asarray(column(self.radius), np.float64) * (0.5 if self.halved else 1.0)
        densities = None if self.density is None else np.asarray(column(self.density), np.float64)
        return Particles(points, radii, densities, path, self.told)


def by_place(count: int, path: str) -> Columns:
    """Take columns without names as x, y, z, radius, density. Raises AirlightError where there are fewer or more."""
    if not 3 <= count <= 5:
        there = counted(count, "column")
        raise AirlightError(f"{path}: has {there} without names; begin it with a line that names x, y, z, radius and density")
    return Columns((0, 1, 2), 3 if count > 3 else None, 4 if count > 4 else None)


def by_name(names: Sequence[str], path: str) -> Columns:
    """Find the columns by their names, in any order and case. Raises AirlightError where one of x, y, z is missing, or there twice."""
    plain = [name.strip().strip("\"'").strip().lower() for name in names]
    plain = [name if _axis(name) is not None else _UNIT.sub("", name) for name in plain]
    axes = []
    for axis in range(3):
        found = sorted((len(name), i) for i, name in enumerate(plain) if _axis(name) == axis)
        if not found or (len(found) > 1 and found[0][0] == found[1][0]):
            there = ", ".join(repr(name.strip()[:30]) for name in names[:10]) or "none"
            what = "has no column" if not found else "has more than one column"
            raise AirlightError(f"{path}: {what} {'xyz'[axis]}, but {there}; name its columns x, y, z, radius and density")
        axes.append(found[0][1])
    coloured = {"r", "g", "b"} <= set(plain)
    radius = _first(plain, RADIUS[:-1] if coloured else RADIUS)
    diameter = _first(plain, DIAMETER) if radius is None else None
    density = _first(plain, DENSITY)
    told = []
    for wanted, one in (("radius", radius if diameter is None else diameter), ("density", density)):
        if one is None:
            meant = next((name for i, name in enumerate(plain) if i not in axes and nearest(name, (wanted,))), None)
            if meant is not None:
                told.append(f"{path}: its column {meant[:30]!r} is not read; name it {wanted!r} if it is that")
    return Columns((axes[0], axes[1], axes[2]), diameter if radius is None else radius, density, diameter is not None, tuple(told))


def _axis(name: str) -> int | None:
    """Tell which axis a name is of."""
    found = _AXIS.fullmatch(name)
    return None if found is None else "xyz012".index(found[1] or found[2]) % 3


def _first(names: Sequence[str], wanted: Sequence[str]) -> int | None:
    return next((names.index(name) for name in wanted if name in names), None)


def check_count(count: int, path: str) -> None:
    """Raise AirlightError for more particles than are read."""
    if count > MAX_PARTICLES:
        raise AirlightError(f"{path}: has {count} particles, more than {MAX_PARTICLES}; keep each second one, and double their densities")
