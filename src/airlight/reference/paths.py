"""Integrates density, and the light that it scatters, along paths through a medium whose density varies, as ground truth: Gauss's rule on
panels between which density has its kinks: heights of fog, planes through a grid's voxels and its faces, a part of a wave of noise.

Where density is that of grids alone, two nodes on a panel are exact, since it is a cubic there. No closed form of the shaders is used, and
no table: the optical length from a light is integrated for each place that it is needed at.
"""

from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.reference.field import air_density, blend

Array = npt.NDArray[Any]
EDGES = {
    "exponential": (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 24.0, 36.0),
    "linear": (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
}  # of fog_depth, above fog_base: ends of panels
RULES = {count: np.polynomial.legendre.leggauss(count) for count in (2, 3, 4, 12)}
NOISY_DEPTHS = 14.0  # of exponential fog, above which noise is not looked at: 1e-6 of a column is left there
WAVE_PARTS = 2  # panels in the shortest wave of noise; twice as many where it is strong
STRONG_NOISE = 2.5  # amplitude of the shortest waves, in the exponent
BENT_PARTS = 4  # of a cell, where the least or greatest of two densities has kinks inside it
AIR_COST, GRID_COST = 1.7, 0.5  # whose sum over panels, squared, is what a ray and a light cost: in triangles, measured on two scenes
SHADED_PARTS = 128  # of a ray through air that is in the shade of a grid, at most
CHUNK = 400_000  # panels that are looked at together


def is_even(medium: ResolvedMedium) -> bool:
    """Tells whether density is 1 everywhere."""
    return medium.settings.fog == "none" and not medium.varies


def density(points: Array, medium: ResolvedMedium) -> Array:
    """Evaluates (...) the density of a medium at points (..., 3), m, as reference/field.py does, by cells of grids that are prepared."""
    found = air_density(points, medium) if medium.air > 0 else np.zeros(points.shape[:-1])
    for field in medium.fields:
        value, inside = _cells(field.volume).at(points + medium.origin)
        found = blend(found, field.factor * value, inside, field.blend)
    return found


class Cells:
    """Holds a volume as the polynomials of its cells, between the centres of voxels, and of those beyond its outermost centres."""

    def __init__(self, volume: Any) -> None:
        values = np.pad(volume.density.astype(float), 1, "edge")
        self.index = np.linalg.inv(volume.matrix)[:3]  # rows, from a point to a voxel's index
        self.edge, self.sides = float(volume.edge), np.array(volume.density.shape[::-1])
        corner = {c: values[tuple(slice(k, n - 1 + k) for k, n in zip(c, values.shape, strict=True))] for c in product((0, 1), repeat=3)}
        terms = []
        for term in product((0, 1), repeat=3):  # of 1 and the shares of a cell along z, y, x
            below = [c for c in corner if all(a <= b for a, b in zip(c, term, strict=True))]
            terms.append(sum((-1) ** (sum(term) - sum(c)) * corner[c] for c in below))
        self.terms = np.stack(terms, axis=-1).reshape(-1, 8)
        self.stride = np.array([1, values.shape[2] - 1, (values.shape[2] - 1) * (values.shape[1] - 1)])

    def at(self, points: Array) -> tuple[Array, Array]:
        """Evaluates (...) density at points (..., 3), world, and tells (...) which lie in the box."""
        index = points @ self.index[:, :3].T + self.index[:, 3]
        inside = np.all((index >= -self.edge) & (index <= self.sides - 1 + self.edge), axis=-1)
        some = index[inside] + 1  # of the padded grid
        low = np.clip(some.astype(np.int64), 0, self.sides)
        x, y, z = np.moveaxis(some - low, -1, 0)
        c = self.terms[low @ self.stride].T
        found = np.zeros(inside.shape)
        found[inside] = c[0] + x * (c[1] + y * (c[3] + z * c[7]) + z * c[5]) + y * (c[2] + z * c[6]) + z * c[4]
        return found, inside

    def crossings(self, start: Array, way: Array, parts: int = 1) -> Array:
        """Finds (n, k) the shares of ways (n, 3) at which they cross planes of voxels' centres inside the box, and its faces.

        parts: into which planes divide a cell.
        """
        b, a = start @ self.index[:, :3].T + self.index[:, 3], way @ self.index[:, :3].T
        a = np.where(np.abs(a) < 1e-300, 1e-300, a)
        ends = np.array([-self.edge + 0 * self.sides, self.sides - 1 + self.edge])
        with np.errstate(over="ignore"):
            first, last = (ends[0] - b) / a, (ends[1] - b) / a
            enter, leave = np.minimum(first, last).max(axis=1)[:, None], np.maximum(first, last).min(axis=1)[:, None]
            planes = [(np.arange((n - 1) * parts + 1) / parts - b[:, i, None]) / a[:, i, None] for i, n in enumerate(self.sides)]
        marks = np.concatenate([enter, *planes, leave], axis=1)
        return np.where(leave > enter, np.clip(marks, enter, np.maximum(leave, enter)), -1.0)

    def leaving(self, start: Array, way: Array) -> Array:
        """Finds (n,) the shares of ways from which on they are out of the box: 0 where they never meet it."""
        marks = self.crossings(start, way)
        return np.maximum(marks[:, -1], 0)


@lru_cache(maxsize=4)
def _cells(volume: Any) -> Cells:
    return Cells(volume)


def cost(medium: ResolvedMedium, reach: float) -> float:
    """Estimates what it takes to integrate along a ray of so many metres and on the way to one light, as triangles that are met.

    Squared, since there is a way to the light from each panel of the ray. Within a factor of 3 of what was measured.
    """
    m, in_air = medium.settings, 0.0
    grids = float(sum(sum(field.volume.density.shape) for field in medium.fields))
    if medium.air > 0:
        in_air = len(EDGES.get(m.fog, ())) + (0 if m.noise_amount == 0 else reach * _noisy_panels(medium))
        grids += SHADED_PARTS if medium.fields else 0
    return (AIR_COST * in_air + GRID_COST * grids) ** 2


# ---------------------------------------------------------------- lengths


def optical_length(start: Array, end: Array, medium: ResolvedMedium) -> Array:
    """Integrates density along straight paths between points (n, 3): (n,) m."""
    way, total = end - start, np.zeros(len(start))
    for rows in _chunks(len(start), medium):
        marks = np.clip(_crossings(start[rows], way[rows], medium), 0, 1)
        marks = np.sort(np.column_stack([np.zeros(len(marks)), marks, np.ones(len(marks))]), axis=1)
        row, column = np.nonzero(marks[:, 1:] > marks[:, :-1])
        low, high = marks[row, column], marks[row, column + 1]
        total[rows] = np.bincount(row, _integral(start[rows][row], way[rows][row], low, high, medium), len(marks))
    return np.asarray(total * np.linalg.norm(way, axis=1))


def _integral(start: Array, way: Array, low: Array, high: Array, medium: ResolvedMedium) -> Array:
    """Integrates (n,) density over panels of ways, each without a kink, in shares of the ways."""
    total = np.zeros(len(low))
    for node, weight in zip(*RULES[_order(medium)], strict=True):
        s = low + (high - low) * (node + 1) / 2
        total += weight / 2 * density(start + s[:, None] * way, medium)
    return total * (high - low)


def _order(medium: ResolvedMedium) -> int:
    """Chooses how many nodes a panel has."""
    if not medium.varies:
        return 12
    return 2 if medium.air == 0 and all(field.blend in ("add", "replace") for field in medium.fields) else 3


def _chunks(count: int, medium: ResolvedMedium) -> Iterator[slice]:
    """Divides rows, so that their panels are no more than CHUNK."""
    each = len(EDGES.get(medium.settings.fog, ())) + sum(sum(_cells(field.volume).sides) + 2 for field in medium.fields) + 64
    step = max(CHUNK // int(each), 1)
    for first in range(0, count, step):
        yield slice(first, min(first + step, count))


def _crossings(start: Array, way: Array, medium: ResolvedMedium) -> Array:
    """Finds (n, k) the shares of ways (n, 3) at which density has kinks, or panels end; anything where there is none."""
    heights = medium.fog_base + medium.fog_depth * np.array(EDGES.get(medium.settings.fog, ()))
    climb = np.where(way[:, 1] == 0, 1e-300, way[:, 1])
    with np.errstate(over="ignore"):
        found = [np.nan_to_num((heights - start[:, 1:2]) / climb[:, None], posinf=1e300, neginf=-1e300)]
    parts = BENT_PARTS if any(field.blend in ("min", "max") for field in medium.fields) else 1
    found += [_cells(field.volume).crossings(start + medium.origin, way, parts) for field in medium.fields]
    m = medium.settings
    if m.noise_amount > 0 and medium.air > 0:
        parts = np.maximum(np.linalg.norm(way, axis=1) * _noisy_panels(medium), 1)[:, None]
        found.append(np.arange(1, np.ceil(parts.max(initial=1))) / parts)
    return np.concatenate(found, axis=1)


def _noisy_panels(medium: ResolvedMedium) -> float:
    """Counts panels in a metre of noise."""
    m = medium.settings
    weakest = m.noise_amount / (2**m.noise_octaves - 1)
    return WAVE_PARTS * (1 if weakest <= STRONG_NOISE else 2) * 2 ** (m.noise_octaves - 1) / medium.noise_size


class Lengths:
    """Knows the optical length from the eye to any distance along rays (R, 3), up to reach (R,)."""

    def __init__(self, origin: Array, ray: Array, reach: Array, medium: ResolvedMedium) -> None:
        self.origin, self.ray, self.medium = origin, ray, medium
        way = ray * reach[:, None]
        marks = np.clip(_crossings(origin, way, medium), 0, 1)
        marks = np.sort(np.column_stack([np.zeros(len(way)), marks, np.ones(len(way))]), axis=1)
        self.marks = marks * reach[:, None]
        row, column = np.nonzero(marks[:, 1:] > marks[:, :-1])
        self.row, self.low = row, self.marks[row, column]
        high = self.marks[row, column + 1]
        part = _integral(origin[row], ray[row], self.low, high, medium)
        self.total = np.bincount(row, part, len(ray))
        before = np.cumsum(part) - part
        first = np.searchsorted(row, np.arange(len(ray)))
        self.before = before - before[np.minimum(first, max(len(row) - 1, 0))][row] if len(row) else before
        self.scale = 2 * float(reach.max(initial=0)) + 1
        self.key = self.row * self.scale + self.low

    def of(self, medium: ResolvedMedium) -> "Lengths":
        """Gives the same lengths for a medium of the same density, as a light has it to itself."""
        other = copy(self)
        other.medium = medium
        return other

    def to(self, which: Array, t: Array) -> Array:
        """Integrates (n,) density along rays `which` (n,) from the eye to t (n,): m."""
        panel = np.maximum(np.searchsorted(self.key, which * self.scale + t, side="right") - 1, 0)
        return np.asarray(self.before[panel] + _integral(self.origin[which], self.ray[which], self.low[panel], t, self.medium))


# ---------------------------------------------------------------- light


def panels(which: Array, start: Array, end: Array, along: Lengths, count: int = 2) -> tuple[Array, Array, Array]:
    """Divides segments (n,) of rays where density has kinks, and each part into `count`: (m,) the segment of each, its ends.

    Air in the shade of grids has panels of a voxel's size too.
    """
    medium, marks = along.medium, along.marks[which]
    if medium.varies:
        count = 1
        if medium.fields and medium.air > 0:
            voxel = min(float(np.linalg.norm(field.volume.matrix[:3, :3], axis=0).min()) for field in medium.fields)
            long = float((end - start).max(initial=0))
            step = max(voxel, long / SHADED_PARTS)
            marks = np.concatenate([marks, start[:, None] + step * np.arange(1, np.ceil(long / step))], axis=1)
    marks = np.clip(marks, start[:, None], end[:, None])
    marks = np.sort(np.column_stack([start, marks, end]), axis=1)
    share = np.arange(count) / count
    low = (marks[:, :-1, None] + (marks[:, 1:] - marks[:, :-1])[..., None] * share).reshape(len(start), count * (marks.shape[1] - 1))
    high = np.column_stack([low[:, 1:], end])
    row, column = np.nonzero(high > low)
    return row, low[row, column], high[row, column]


def directional(which: Array, start: Array, end: Array, light: PunctualLight, along: Lengths, sigma_t: Array) -> tuple[Array, Array]:
    """Integrates density times transmittance, from the light to the eye, over lit segments: (m, 3) m, and (m,) their rays.

    sigma_t: (3,) 1/m, of the light.
    """
    medium = along.medium
    part, low, high = panels(which, start, end, along)
    which = which[part]
    towards = -np.asarray(light.travel(along.origin[:1]), float)[0]
    total = np.zeros((len(which), 3))
    for node, weight in zip(*RULES[3 if medium.varies else 12], strict=True):
        t = low + (high - low) * (node + 1) / 2
        place = along.origin[which] + t[:, None] * along.ray[which]
        rho = density(place, medium)
        some = rho > 0
        length = along.to(which[some], t[some]) + sun_length(place[some], towards, medium)
        colour = 1.0 if light.cookie is None else light.colour(place[some])
        total[some] += (weight * (high - low) / 2 * rho)[some, None] * np.exp(-length[:, None] * sigma_t) * colour
    return total, which


def lamp_factor(which: Array, t: Array, light: PositionalLight, along: Lengths, sigma_t: Array) -> Array:
    """Evaluates (n, 3) density at t along rays `which`, times transmittance from a lamp by way of there to the eye. sigma_t: see above."""
    place = along.origin[which] + t[:, None] * along.ray[which]
    rho, found = density(place, along.medium), np.zeros((len(t), 3))
    some = rho > 0
    at = np.broadcast_to(np.asarray(light.position, float), place[some].shape)
    length = along.to(which[some], t[some]) + optical_length(place[some], at, along.medium)
    found[some] = rho[some, None] * np.exp(-length[:, None] * sigma_t)
    return found


def sun_length(place: Array, towards: Array, medium: ResolvedMedium) -> Array:
    """Integrates (n,) m what dims a sun's light on its way to places (n, 3), by Medium.sun_extinction: grids as if there were no air; or
    all, less the density that air has without an end."""
    if medium.sun_extinction == "none":
        return np.zeros(len(place))
    m, without_end = medium.settings, 0.0
    if medium.sun_extinction == "volumes":
        medium = replace(medium, air=0.0)
    way = np.zeros(len(place))
    for field in medium.fields:
        ones = np.broadcast_to(towards, place.shape)
        way = np.maximum(way, _cells(field.volume).leaving(place + medium.origin, ones))
    if medium.air > 0:
        without_end = medium.air * {"none": 1.0, "linear": m.fog_above}.get(m.fog, 0.0)
        if m.fog != "none" and towards[1] > 0:
            depths = NOISY_DEPTHS if m.fog == "exponential" and m.noise_amount > 0 else EDGES[m.fog][-1]
            top = medium.fog_base + medium.fog_depth * depths
            way = np.maximum(way, np.maximum(top - place[:, 1], 0) / max(float(towards[1]), 1e-6))
    length = optical_length(place, place + way[:, None] * towards, medium) - without_end * way
    return np.asarray(np.maximum(length, 0))
