"""Integrates light over lit segments of rays where the medium's density depends on height, as ground truth: Gauss's rule of twelve nodes
on panels between which the density has its kinks; of density itself, too. No closed form of the shaders is used.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import ResolvedMedium

Array = npt.NDArray[Any]
NODES = np.polynomial.legendre.leggauss(12)
EDGES = {
    "exponential": (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 24.0, 36.0),
    "linear": (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
}  # of fog_depth, above fog_base: ends of panels


def density(points: Array, medium: ResolvedMedium) -> Array:
    """Evaluates (...) the density of a medium at points (..., 3), world, m."""
    m, y = medium.settings, np.asarray(points, float)[..., 1] - medium.fog_base
    if m.fog == "none":
        return np.ones(y.shape)
    if m.fog == "exponential":
        return np.asarray(np.exp(-np.maximum(y, 0) / medium.fog_depth))
    return np.asarray(1 + (m.fog_above - 1) * np.clip(y / medium.fog_depth, 0, 1))


def optical_length(start: Array, end: Array, medium: ResolvedMedium) -> Array:
    """Integrates density along straight paths between points (n, 3): (n,) m."""
    way = end - start
    length = np.linalg.norm(way, axis=1)
    marks = np.clip(_crossings(start, way, medium), 0, 1)
    marks = np.sort(np.column_stack([np.zeros(len(way)), marks, np.ones(len(way))]), axis=1)
    total = np.zeros(len(way))
    for low, high in zip(marks.T[:-1], marks.T[1:], strict=True):
        for node, weight in zip(*NODES, strict=True):
            s = low + (high - low) * (node + 1) / 2
            total += weight * (high - low) / 2 * density(start + s[:, None] * way, medium)
    return np.asarray(total * length)


def panels(origin: Array, ray: Array, start: Array, end: Array, medium: ResolvedMedium, count: int = 2) -> tuple[Array, Array, Array]:
    """Divides segments (n,) of rays (n, 3) where density has kinks, and each part into `count`: (m,) the segment of each, its ends."""
    marks = np.clip(_crossings(origin, ray, medium), start[:, None], end[:, None])
    marks = np.sort(np.column_stack([start, marks, end]), axis=1)
    share = np.arange(count) / count
    low = (marks[:, :-1, None] + (marks[:, 1:] - marks[:, :-1])[..., None] * share).reshape(len(start), count * (marks.shape[1] - 1))
    high = np.column_stack([low[:, 1:], end])
    which, column = np.nonzero(high > low)
    return which, low[which, column], high[which, column]


def directional(
    origin: Array, ray: Array, which: Array, start: Array, end: Array, light: PunctualLight, medium: ResolvedMedium
) -> tuple[Array, Array]:
    """Integrates density times transmittance, from the light to the eye, over lit segments: (m, 3) m, and (m,) their rays."""
    part, low, high = panels(origin[which], ray[which], start, end, medium)
    which = which[part]
    from_eye, along = origin[which], ray[which]
    towards = -np.asarray(light.travel(from_eye), float)
    total = np.zeros((len(which), 3))
    for node, weight in zip(*NODES, strict=True):
        t = low + (high - low) * (node + 1) / 2
        place = from_eye + t[:, None] * along
        length = optical_length(from_eye, place, medium)
        if medium.fades_suns:
            length = length + _column(place, towards, medium)
        seen = np.exp(-length[:, None] * medium.sigma_t)
        total += (weight * (high - low) / 2 * density(place, medium))[:, None] * seen
    return total, which


def lamp_factor(place: Array, from_eye: Array, light: PositionalLight, medium: ResolvedMedium) -> Array:
    """Evaluates (n, 3) density at places times transmittance from a lamp by way of them to the eye."""
    at = np.broadcast_to(np.asarray(light.position, float), place.shape)
    length = optical_length(from_eye, place, medium) + optical_length(at, place, medium)
    return density(place, medium)[:, None] * np.exp(-length[:, None] * medium.sigma_t)


def _crossings(start: Array, way: Array, medium: ResolvedMedium) -> Array:
    """Finds (n, k) the shares of ways (n, 3) at which they cross the edges of EDGES; anything where they are level."""
    heights = medium.fog_base + medium.fog_depth * np.array(EDGES.get(medium.settings.fog, ()))
    climb = np.where(way[:, 1] == 0, 1e-300, way[:, 1])
    with np.errstate(over="ignore"):
        return np.nan_to_num((heights - start[:, 1:2]) / climb[:, None], posinf=1e300, neginf=-1e300)


def _column(place: Array, towards: Array, medium: ResolvedMedium) -> Array:
    """Integrates (n,) what density is more than high up, on the way from places to a directional light: m."""
    top = medium.fog_base + medium.fog_depth * EDGES[medium.settings.fog][-1]
    climb = np.maximum(towards[:, 1], 1e-6)
    length = np.maximum(top - place[:, 1], 0) / climb
    above = medium.settings.fog_above if medium.settings.fog == "linear" else 0.0
    return optical_length(place, place + length[:, None] * towards * np.where(towards[:, 1:2] > 0, 1, 0), medium) - above * length
