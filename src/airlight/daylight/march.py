"""Integrates the light that the air scatters along view rays: L = L0 e^-tau + (1 - D) L1 + Lms, each part by itself."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import sun_transmittance
from airlight.daylight.rays import earth_shadow, path_weights, place_nodes, reaching
from airlight.medium.resolve import PHASES
from airlight.reference.daylight import OZONE_HALF_WIDTH, OZONE_MIDDLE, Array, sun_cosine_along, view_cosine_along
from airlight.reference.medium import phase

CHUNK = 256  # rays at a time
COUNTS = (12, 8)  # of nodes in half a piece, the sun being high, or low, which makes more pieces
LOW_SUN = 0.2  # cosine, below which a ray may meet the earth's shadow
LEVELS = (0.0, OZONE_MIDDLE - OZONE_HALF_WIDTH, OZONE_MIDDLE, OZONE_MIDDLE + OZONE_HALF_WIDTH)  # m; ozone has corners there

# Of height, view elevation, azimuth from the sun, sun's elevation there and at the eye, m and radians, (..., W): light that was scattered
# before, which a metre of air scatters into the ray.
Further = Callable[[Array, Array, Array, Array, Array], Array]


class Rays(NamedTuple):
    """Holds N view rays: heights, m; cosines of view and sun to the vertical and between them; azimuth from the sun, radians; length, m."""

    height: Array
    mu: Array
    mu_sun: Array
    cosine: Array
    azimuth: Array
    length: Array


class Gathered(NamedTuple):
    """Holds what N rays gather at W wavelengths, for an irradiance of 1 above the air: (N, W) each.

    transmittance: of the whole ray; single: light scattered once, L1; shadowed: what of L1 is left beside what hides the sun, (1 - D) L1;
    multiple: light scattered more than once, Lms.
    """

    transmittance: Array
    single: Array
    shadowed: Array
    multiple: Array


def phases(cosine: Array, anisotropy: float) -> Array:
    """Evaluate (..., 2) phase functions, 1/sr, of Rayleigh's air and of the aerosol (Cornette and Shanks 1992)."""
    rayleigh, aerosol = PHASES.index("rayleigh"), PHASES.index("cornette-shanks")
    return np.stack([phase(cosine, (0, 0, 0), rayleigh), phase(cosine, (anisotropy, 0, 0), aerosol)], axis=-1)


def joined(starts: Array, ends: Array) -> tuple[Array, Array]:
    """Cut off what stretches (..., S) share with those before them, so that none counts twice."""
    order = np.argsort(starts, axis=-1)
    starts, ends = np.take_along_axis(starts, order, -1), np.take_along_axis(ends, order, -1)
    reached = np.maximum.accumulate(ends, axis=-1)
    starts = np.concatenate([starts[..., :1], np.maximum(starts[..., 1:], reached[..., :-1])], axis=-1)
    return starts, np.maximum(starts, ends)


def gather(air: Coefficients, rays: Rays, further: Further | None = None, shadow: Sequence[tuple[Array, Array]] = ()) -> Gathered:
    """Integrate along N rays. further: what is scattered more than once; shadow: (start, end) of (N,) m, where the sun is hidden."""
    parts = Gathered(*(np.zeros((len(rays.height), len(air.nm))) for _ in Gathered._fields))
    low = rays.mu_sun < LOW_SUN
    groups = (np.flatnonzero(low), np.flatnonzero(~low))
    chunks = [group[i : i + CHUNK] for group in groups for i in range(0, len(group), CHUNK)]

    def fill(part: Array) -> None:
        hidden = [(start[part], end[part]) for start, end in shadow]
        for whole, some in zip(parts, _gather(air, Rays(*(one[part] for one in rays)), further, hidden)):
            whole[part] = some

    with ThreadPoolExecutor(2) as pool:  # NumPy leaves the other core to the second
        list(pool.map(fill, chunks))
    return parts


def _gather(air: Coefficients, rays: Rays, further: Further | None, shadow: Sequence[tuple[Array, Array]]) -> Gathered:
    extinction = air.extinction
    night: tuple[Array, Array] = (np.zeros_like(rays.mu), np.zeros_like(rays.mu))
    breaks: list[Array] = []
    if low := bool((rays.mu_sun < LOW_SUN).any()):
        shadows = [earth_shadow(rays.height, rays.mu, rays.mu_sun, rays.cosine, level) for level in LEVELS]
        night, breaks = shadows[0], [one for pair in shadows for one in pair]
        breaks += [reaching(rays.height, rays.mu, level)[1] for level in LEVELS[1:]]
    starts: Array = np.zeros((len(rays.height), 0))
    ends = starts
    if shadow:
        starts, ends = joined(np.stack([start for start, _ in shadow], axis=-1), np.stack([end for _, end in shadow], axis=-1))
        breaks += [*starts.T, *ends.T]
    nodes = place_nodes(rays.height, rays.mu, rays.length, breaks, extinction, COUNTS[low])
    height, mu, mu_sun, cosine = (one[:, None] for one in rays[:4])
    weight, through = path_weights(nodes, extinction)
    counts = nodes.weights > 0  # which those of pieces without length do not

    def counted(values: Array) -> Array:
        return np.broadcast_to(values, counts.shape)[counts]

    t, at = nodes.t[counts], nodes.height[counts]
    sun = sun_cosine_along(counted(height), counted(mu), counted(mu_sun), counted(cosine), t)
    reaches, each = weight[counts], np.zeros(weight.shape)
    ray = np.nonzero(counts)[0]
    once = np.matmul(nodes.density[counts][:, None, :2], (phases(rays.cosine, air.anisotropy)[..., None] * air.scattering)[ray])[:, 0]
    each[counts] = once * reaches * sun_transmittance(at, sun, extinction)
    lit = ~((nodes.middles > night[0][:, None]) & (nodes.middles < night[1][:, None]))
    dark = np.any((nodes.middles[..., None] > starts[:, None]) & (nodes.middles[..., None] < ends[:, None]), axis=-1)
    shape = (*nodes.middles.shape, -1, len(air.nm))
    by_piece = np.where(lit[..., None], each.reshape(shape).sum(axis=-2), 0)
    multiple = np.zeros_like(through)
    if further is not None:
        local = np.arcsin(view_cosine_along(counted(height), counted(mu), t))
        turned = further(at, local, counted(rays.azimuth[:, None]), np.arcsin(sun), np.arcsin(counted(mu_sun)))
        multiple = np.stack([np.bincount(ray, one, len(through)) for one in (reaches * turned).T], axis=-1)
    single = by_piece.sum(axis=1)
    shadowed = np.where(np.expand_dims(dark, -1), 0, by_piece).sum(axis=1)
    return Gathered(through, single, shadowed, multiple)
