"""Keeps what is solved of multiple scattering, by settings and by the sun's elevation, and reads it between.

Suns stand on a lattice of elevations: one that moves is interpolated between two (orders) or four (psi) of them, in logarithms, and none is
solved twice. Along a ray the sun's elevation changes, as the vertical does.
"""

import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.orders import make_operators, solve_orders, table_heights
from airlight.daylight.psi import psi_heights, psi_sphere, solve_psi
from airlight.reference.daylight import ORDERS_SIZE, TOP_HEIGHT, Array, air_density, orders_position

SUNS = np.concatenate([np.arange(-30, -10, 2.0), np.arange(-10, 8.0), np.arange(8, 91, 2.0)])  # degrees, of orders
PSI_SUNS = np.sort(np.concatenate([SUNS, np.arange(-4.5, 2), [-0.75, -0.25, 0.25]]))  # of psi, exact where the day begins
LEAST = 1e-30  # of what is scattered, whose logarithm is taken
REACH = (4.0, 2.0)  # degrees that the sun's elevation may differ from that at the eye, for a low and a high sun, in the table of orders
LOW_AND_HIGH = (8.0, 12.0)  # degrees between which that changes
KEPT = 4  # airs of which all is kept


class Suns:
    """Solves a table for suns of the lattice when it is needed first, and keeps its logarithm."""

    def __init__(self, elevations: Array, solve: Callable[[float], Array]) -> None:
        self.elevations, self._solve = elevations, solve
        self._kept: dict[int, Array] = {}
        self._lock = threading.Lock()

    @property
    def solved(self) -> set[int]:
        """Give which suns of the lattice are solved."""
        return set(self._kept)

    def at(self, first: int, last: int) -> Array:
        """Stack the logarithms of the tables of suns first to last of the lattice, both included."""
        if any(i not in self._kept for i in range(first, last + 1)):  # what is there does not wait for another thread's suns
            with self._lock:
                new = [i for i in range(first, last + 1) if i not in self._kept]
                if len(new) == 1:
                    self._kept[new[0]] = self._logarithm(new[0])
                else:
                    with ThreadPoolExecutor(2) as pool:  # NumPy leaves the other core to the second
                        self._kept |= zip(new, pool.map(self._logarithm, new))
        return np.stack([self._kept[i] for i in range(first, last + 1)])

    def _logarithm(self, i: int) -> Array:
        return np.asarray(np.log(np.maximum(self._solve(math.radians(self.elevations[i])), LEAST)))


def lagrange(nodes: Array, x: Array, corner: float | None = None) -> tuple[npt.NDArray[np.integer[Any]], Array]:
    """Give the first of four neighbouring nodes (...) and their weights (..., 4), by which a cubic goes through them at x.

    corner: a node of which the four lie on the side of x, where what is interpolated has a corner.
    """
    first = np.clip(np.searchsorted(nodes, x) - 2, 0, len(nodes) - 4)
    if corner is not None:
        there = int(np.searchsorted(nodes, corner))
        first = np.where(x > corner, np.maximum(first, there), np.minimum(first, there - 3))
    near = nodes[first[..., None] + np.arange(4)]
    weights = np.ones(near.shape)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[..., i] *= (x - near[..., j]) / (near[..., i] - near[..., j])
    return first, weights


def reach(sun: Any) -> Array:
    """Evaluate how far, degrees, the sun's elevation may differ along a ray from that at the eye, which is sun degrees."""
    return np.interp(sun, LOW_AND_HIGH, REACH)


class Orders:
    """Holds the table of all orders from the second for one air."""

    def __init__(self, air: Coefficients) -> None:
        self.air, self._operators = air, make_operators(air)
        self.suns = Suns(SUNS, self._solve)

    def _solve(self, sun: float) -> Array:
        return np.moveaxis(solve_orders(self.air, self._operators, sun), 0, -2)  # (H, E, A, 2, W)

    def table(self, sun: float) -> Array:
        """Interpolate the table (heights, elevations, azimuths, 2, W) float32, 1/sr, for a sun at an elevation, degrees."""
        first = int(np.clip(np.searchsorted(SUNS, sun) - 1, 0, len(SUNS) - 2))
        low, high = self.suns.at(first, first + 1)
        share = np.float32((sun - SUNS[first]) / (SUNS[first + 1] - SUNS[first]))
        return np.exp(low * (1 - share) + high * share)

    def logarithms(self, first: int, last: int) -> Array:
        """Give (suns, heights, elevations, azimuths, 2, W) logarithms of the tables of SUNS[first] to SUNS[last], both included."""
        return self.suns.at(first, last)

    def further(self, height: Array, elevation: Array, azimuth: Array, sun: Array, eye_sun: Array) -> Array:
        """Evaluate (..., W) what a metre scatters into rays after more than one turn: see `march.Further`."""
        near = np.degrees(eye_sun)
        local = np.clip(np.degrees(sun), near - reach(near), near + reach(near))
        which = np.clip(np.searchsorted(SUNS, local) - 1, 0, len(SUNS) - 2)
        offset = int(which.min(initial=len(SUNS) - 2))
        tables = self.suns.at(offset, int(which.max(initial=offset)) + 1)
        shape = (len(tables), *ORDERS_SIZE)
        between = (local - SUNS[which]) / np.diff(SUNS)[which]
        at = np.concatenate([(which - offset + between)[..., None], orders_position(height, elevation, azimuth)], axis=-1)
        first = np.minimum(at.astype(np.intp), np.array(shape) - 2)
        strides = np.cumprod([1, *shape[:0:-1]])[::-1]
        upper = (at - first).astype(np.float32)
        shares, index = np.stack([1 - upper, upper]), first @ strides
        flat = tables.reshape(-1, 2 * len(self.air.nm))
        out = np.zeros((*index.shape, flat.shape[-1]), np.float32)
        for corner in np.ndindex(2, 2, 2, 2):
            weight = np.prod([shares[i, ..., axis] for axis, i in enumerate(corner)], axis=0)
            out += weight[..., None] * np.take(flat, index + strides @ corner, axis=0)
        turned = np.exp(out, dtype=float).reshape(*out.shape[:-1], 2, len(self.air.nm))
        return np.asarray((air_density(height)[..., :2, None] * self.air.scattering * turned).sum(axis=-2))


class Psi:
    """Holds psi for one air."""

    def __init__(self, air: Coefficients) -> None:
        self.air = air
        self._sphere = psi_sphere(air)
        self._suns = Suns(PSI_SUNS, lambda sun: solve_psi(air, self._sphere, sun))

    def psi(self, height: Array, sun: Array) -> Array:
        """Evaluate (..., W) psi, 1/sr, at heights, m, for suns at elevations, radians."""
        across = (psi_heights() / TOP_HEIGHT) ** (1 / 3)
        row, by_height = lagrange(across, np.clip(height / TOP_HEIGHT, 0, 1) ** (1 / 3))
        column, by_sun = lagrange(PSI_SUNS, np.clip(np.degrees(sun), PSI_SUNS[0], PSI_SUNS[-1]), corner=0.0)  # the ground's day begins
        offset = int(column.min(initial=len(PSI_SUNS) - 4))
        logs = self._suns.at(offset, int(column.max(initial=offset)) + 3)
        out: Any = 0
        for i, j in np.ndindex(4, 4):
            out = out + (by_height[..., i] * by_sun[..., j])[..., None] * logs[column - offset + j, row + i]
        return np.asarray(np.exp(out))

    def logarithms(self, first: int, last: int) -> Array:
        """Give (suns, heights, 1, 1, 1, W) logarithms at the heights of the table of orders, for SUNS[first] to SUNS[last]."""
        sun = np.radians(SUNS[first : last + 1])[:, None]
        return np.log(np.maximum(self.psi(table_heights(), sun), LEAST))[:, :, None, None, None, :]

    def further(self, height: Array, elevation: Array, azimuth: Array, sun: Array, eye_sun: Array) -> Array:
        """Evaluate (..., W) what a metre scatters into rays after more than one turn: see `march.Further`."""
        return np.asarray(self.psi(height, sun) * (air_density(height)[..., :2] @ self.air.scattering))


KINDS: dict[str, type[Orders] | type[Psi] | None] = {"orders": Orders, "psi": Psi, "none": None}


def kept(kind: type, air: Coefficients) -> Any:
    """Give the solver of a kind for an air: the same one for the same coefficients."""
    return _kept(kind, _Key(air))


class _Key:
    """Compares airs by their numbers."""

    def __init__(self, air: Coefficients) -> None:
        self.air, self._values = air, tuple(np.asarray(one, float).tobytes() for one in air)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)


@lru_cache(maxsize=2 * KEPT)
def _kept(kind: type, key: _Key) -> Any:
    return kind(key.air)
