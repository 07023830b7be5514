"""Holds directions and rays over the whole sphere at heights of one vertical, which the solvers of multiple scattering share.

Elevations crowd on both sides of each height's own horizon, where radiance jumps; azimuths are even, from the sun's to the opposite. Rays
and their nodes belong to the air and serve all suns: where the earth's shadow cuts a ray, a node counts by the lit part of its cell.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import SIZE, columns_table, sun_transmittance
from airlight.daylight.rays import earth_shadow, gauss, path_weights, place_nodes, reaching
from airlight.reference.daylight import (
    GROUND_RADIUS,
    LEVEL_TO_TOP,
    TOP_HEIGHT,
    TOP_RADIUS,
    Array,
    distance_to_ground,
    distance_to_top,
    sun_cosine_along,
    view_cosine_along,
)

Single = np.float32  # is enough for tables of 1e-3
LOW_SUN = np.radians(12)  # below which a ray may meet the earth's shadow
LEVELS = (10_000.0, 25_000.0, 40_000.0, 60_000.0)  # m, at which rays are cut: ozone has corners there, twilight's shadow ends between
CHUNK = 64  # rays at a time, whose nodes stay in the cache


class Sphere(NamedTuple):
    """Holds H heights, D elevations at each, and K nodes along all these rays, one ray after the other.

    height (H,), m; elevation (H, D), radians; solid (H, D): solid angle of a belt of elevations, sr, over all azimuths; length (H, D), m;
    ground (H, D, W): transmittance to the ground, 0 where it is missed; first (H D + 1,): index of each ray's first node, and K;
    t (K,), m; cells (2, K), m: from where to where on the ray a node stands for it; at (K,), m: its height; local (K,): cosine to the
    vertical there; weights (K, 2, W): what Rayleigh's air and the aerosol scatter at the node of a light of 1, as it arrives;
    depths (rows * columns, 4, W) float32: see `_depths`.
    """

    height: Array
    elevation: Array
    solid: Array
    length: Array
    ground: Array
    first: npt.NDArray[np.intp]
    t: Array
    cells: Array
    at: Array
    local: Array
    weights: Array
    depths: Array


def make_sphere(air: Coefficients, height: Array, half: int, count: int) -> Sphere:
    """Place rays at heights (H,), m. half: elevations above and below the horizon each; count: nodes in half a piece of a ray."""
    x, weight, _ = gauss(half)
    horizon = -np.arccos(GROUND_RADIUS / (GROUND_RADIUS + height))[:, None]
    up, down = np.pi / 2 - horizon, np.pi / 2 + horizon
    elevation = np.concatenate([horizon - down * x[::-1] ** 2, horizon + up * x**2], axis=1)
    belt = np.concatenate([down * 2 * (x * weight)[::-1], up * 2 * x * weight], axis=1)
    eyes, mu = np.broadcast_to(height[:, None], elevation.shape), np.sin(elevation)
    way = distance_to_ground(eyes, mu)
    length = np.minimum(way, distance_to_top(eyes, mu))
    nodes = place_nodes(eyes, mu, length, [one for level in LEVELS for one in reaching(eyes, mu, level)], air.extinction, count)
    left, through = path_weights(nodes, air.extinction)
    ground = np.where(np.isfinite(way)[..., None], through, 0)
    order = np.argsort(nodes.t, axis=-1).reshape(length.size, -1)
    of_nodes = (nodes.t, nodes.height, nodes.weights, left, nodes.density)
    t, at, weights, left, density = (np.take_along_axis(one.reshape(*order.shape, -1), order[..., None], 1) for one in of_nodes)
    ends = np.cumsum(weights, axis=1)
    counts = weights[..., 0] > 0
    counts[:, 0] |= ~counts.any(axis=1)  # of a ray of no length
    ray = np.nonzero(counts)[0]
    t, at, start, end, left, density = (one[counts] for one in (t, at, ends - weights, ends, left, density))
    local = view_cosine_along(eyes.ravel()[ray], mu.ravel()[ray], t[:, 0])
    scattered = density[:, :2, None] * air.scattering * left[:, None, :]
    first = np.concatenate([[0], np.cumsum(counts.sum(axis=1))])
    return Sphere(
        height, elevation, 2 * np.pi * belt * np.cos(elevation), length, ground, first, t[:, 0], np.stack([start[:, 0], end[:, 0]]),
        at[:, 0], local, scattered, _depths(air),
    )  # fmt: skip


def _depths(air: Coefficients) -> Array:
    """Prepare the table of optical depth to the end of the air for bilinear reads: (rows * columns, 4, W) float32.

    A cell holds the value at its corner, what x adds, what y adds, and what both do.
    """
    table = (columns_table() @ air.extinction).astype(Single)
    corner, x = table[:-1, :-1], table[:-1, 1:] - table[:-1, :-1]
    y, both = table[1:, :-1] - corner, table[1:, 1:] - table[1:, :-1] - x
    return np.stack([corner, x, y, both], axis=-2).reshape(-1, 4, len(air.nm))


def cosines_to_sun(sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Evaluate (H, D, A) cosines between rays and a sun at an elevation, radians, for azimuths (A,)."""
    mu, level = np.sin(sphere.elevation)[..., None], np.cos(sphere.elevation)[..., None]
    return np.asarray(mu * np.sin(sun) + level * np.cos(sun) * np.cos(azimuth))


def scattered_sunlight(sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Integrate (H, D, A, 2, W) float32 sunlight that Rayleigh's air and the aerosol scatter into rays, of 1 above the air.

    Without phase functions, which stay the same along a straight ray. sun: its elevation, radians; azimuth (A,): of rays from the sun.
    """
    cosine = cosines_to_sun(sphere, sun, azimuth)
    shape, cosine = cosine.shape, cosine.reshape(-1, len(azimuth))
    night = None
    if sun < LOW_SUN:
        mu = np.sin(sphere.elevation)
        eyes, mu = (np.repeat(one.reshape(-1, 1), len(azimuth), 1) for one in (np.broadcast_to(sphere.height[:, None], mu.shape), mu))
        night = earth_shadow(eyes, mu, np.full(cosine.shape, np.sin(sun)), cosine)
    out = np.empty((len(cosine), len(azimuth), *sphere.weights.shape[1:]), Single)
    eye = np.repeat(GROUND_RADIUS + sphere.height, sphere.elevation.shape[1])
    for start in range(0, len(cosine), CHUNK):
        end = min(start + CHUNK, len(cosine))
        first = sphere.first[start : end + 1]
        nodes = slice(first[0], first[-1])
        ray = np.repeat(np.arange(start, end), np.diff(first))
        light = _sunlight(sphere, nodes, eye[ray, None] * np.sin(sun) + sphere.t[nodes, None] * cosine[ray])
        if night is not None:
            low, high = sphere.cells[:, nodes, None]
            dark = np.minimum(high, night[1][ray]) - np.maximum(low, night[0][ray])
            light *= (1 - np.maximum(dark, 0) / np.maximum(high - low, 1e-9)).astype(Single)[..., None]
        each = light[:, :, None, :] * sphere.weights[nodes].astype(Single)[:, None]
        out[start:end] = np.add.reduceat(each, first[:-1] - first[0], axis=0)
    return out.reshape(*shape, *out.shape[2:])


def _sunlight(sphere: Sphere, nodes: slice, towards: Array) -> Array:
    """Read (N, A, W) float32 transmittance to the sun at nodes, by the table of optical depth.

    towards (N, A), m: radius times cosine of the sun to the vertical. What the earth hides has the light of its horizon.
    """
    rows, columns = (n - 1 for n in SIZE)
    height = sphere.at[nodes]
    above = (TOP_HEIGHT - height) * (TOP_RADIUS + GROUND_RADIUS + height)
    horizon = np.sqrt(height * (2 * GROUND_RADIUS + height))
    least = TOP_HEIGHT - height
    y = horizon * (rows / LEVEL_TO_TOP)
    row = np.minimum(y.astype(np.intp), rows - 1)
    per_node = (above, least, columns / (horizon + LEVEL_TO_TOP - least), y - row)
    above, least, scale, fy = (one.astype(Single)[:, None] for one in per_node)
    along = towards.astype(Single)
    x = np.clip((np.sqrt(along * along + above) - along - least) * scale, 0, columns - Single(1e-3))
    column = x.astype(np.intp)
    cell = np.take(sphere.depths, row[:, None] * columns + column, axis=0)
    fx, fy = (x - column).astype(Single)[..., None], fy[..., None]
    return np.exp(-(cell[..., 0, :] + fx * cell[..., 1, :] + fy * (cell[..., 2, :] + fx * cell[..., 3, :])))


def sunlit_ground(air: Coefficients, sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Evaluate (H, D, A, W) radiance of the ground in the sun, as rays that meet it bring it to the eye."""
    half = sphere.elevation.shape[1] // 2  # of which the lower one meets it
    height, mu = sphere.height[:, None, None], np.sin(sphere.elevation[:, :half])[..., None]
    cosine = cosines_to_sun(sphere, sun, azimuth)
    below = np.maximum(sun_cosine_along(height, mu, np.sin(sun), cosine[:, :half], sphere.length[:, :half, None]), 0)
    light = below[..., None] * sun_transmittance(np.zeros_like(below), below, air.extinction)
    out = np.zeros((*cosine.shape, len(air.nm)))
    out[:, :half] = light * (sphere.ground[:, :half] * air.ground_albedo / np.pi)[:, :, None, :]
    return out
