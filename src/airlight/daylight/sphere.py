"""Holds directions and rays over the whole sphere at heights of one vertical, which the solvers of multiple scattering share.

Elevations crowd on both sides of each height's own horizon, where radiance jumps; azimuths are even, from the sun's to the opposite.
"""

from typing import NamedTuple

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import sun_transmittance
from airlight.daylight.rays import Nodes, earth_shadow, gauss, path_weights, place_nodes
from airlight.reference.daylight import (
    GROUND_RADIUS,
    Array,
    distance_to_ground,
    distance_to_top,
    sun_cosine_along,
    view_cosine_along,
)

LOW_SUN = np.radians(12)  # below which a ray may meet the earth's shadow
CHUNK = 512  # of such rays at a time


class Sphere(NamedTuple):
    """Holds H heights, D elevations at each, and N nodes along each ray.

    height (H,), m; elevation (H, D), radians; solid (H, D): solid angle of a belt of elevations, sr, over all azimuths; nodes: (H, D, N);
    local (H, D, N): cosine to the vertical at nodes; length (H, D), m; left (H, D, N, W): weights of nodes times transmittance to the eye;
    ground (H, D, W): transmittance to the ground, 0 where it is missed.
    """

    height: Array
    elevation: Array
    solid: Array
    nodes: Nodes
    local: Array
    length: Array
    left: Array
    ground: Array


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
    nodes = place_nodes(eyes, mu, length, [], air.extinction, count)
    left, through = path_weights(nodes, air.extinction)
    ground = np.where(np.isfinite(way)[..., None], through, 0)
    local = view_cosine_along(eyes[..., None], mu[..., None], nodes.t)
    return Sphere(height, elevation, 2 * np.pi * belt * np.cos(elevation), nodes, local, length, left, ground)


def cosines_to_sun(sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Evaluate (H, D, A) cosines between rays and a sun at an elevation, radians, for azimuths (A,)."""
    mu, level = np.sin(sphere.elevation)[..., None], np.cos(sphere.elevation)[..., None]
    return np.asarray(mu * np.sin(sun) + level * np.cos(sun) * np.cos(azimuth))


def scattered_sunlight(air: Coefficients, sphere: Sphere, sun: float, azimuth: Array, table: Array, count: int) -> Array:
    """Integrate (H, D, A, 2, W) sunlight that Rayleigh's air and the aerosol scatter into rays, for an irradiance of 1 above the air.

    Without phase functions, which stay the same along a straight ray. sun: its elevation, radians; azimuth (A,): of rays from the sun;
    table: of columns, as `columns_table` makes it, in the precision that is wanted; count: of nodes in half a piece of rays that the
    earth's shadow cuts.
    """
    height, mu = sphere.height[:, None, None], np.sin(sphere.elevation)[..., None]
    cosine = cosines_to_sun(sphere, sun, azimuth)
    at = sun_cosine_along(height[..., None], mu[..., None], np.sin(sun), cosine[..., None], sphere.nodes.t[:, :, None, :])
    heights = np.broadcast_to(sphere.nodes.height[:, :, None, :], at.shape)
    light = sun_transmittance(heights, at, air.extinction, table)
    out = np.empty((*cosine.shape, 2, len(air.nm)), table.dtype)
    for w in range(len(air.nm)):
        weights = sphere.left[..., w, None] * sphere.nodes.density[..., :2] * air.scattering[:, w]
        out[..., w] = np.matmul(light[..., w], weights.astype(table.dtype))
    if sun < LOW_SUN:
        eyes, mu = (np.broadcast_to(one, cosine.shape) for one in (height, mu))
        length = np.broadcast_to(sphere.length[..., None], cosine.shape)
        night = earth_shadow(eyes, mu, np.full(cosine.shape, np.sin(sun)), cosine)
        cut = np.nonzero((night[1] > 0) & (night[0] < length))
        rays = (eyes[cut], mu[cut], cosine[cut], length[cut], night[0][cut], night[1][cut])
        for i in range(0, len(cut[0]), CHUNK):
            part = tuple(index[i : i + CHUNK] for index in cut)
            out[part] = _around_shadow(air, np.sin(sun), table, count, *(one[i : i + CHUNK] for one in rays))
    return out


def _around_shadow(
    air: Coefficients, mu_sun: float, table: Array, count: int, height: Array, mu: Array, cosine: Array, length: Array, first: Array,
    last: Array,
) -> Array:  # fmt: skip
    """Integrate (N, 2, W) as `scattered_sunlight` does, along rays that lie in the earth's shadow from the way first to last, m."""
    nodes = place_nodes(height, mu, length, [first, last], air.extinction, count)
    lit = ~((nodes.middles > first[:, None]) & (nodes.middles < last[:, None]))[:, nodes.piece]
    at = sun_cosine_along(height[:, None], mu[:, None], mu_sun, cosine[:, None], nodes.t)
    light = sun_transmittance(nodes.height, at, air.extinction, table) * path_weights(nodes, air.extinction)[0]
    return np.einsum("nik,niw->nkw", lit[..., None] * nodes.density[..., :2], light) * air.scattering


def sunlit_ground(air: Coefficients, sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Evaluate (H, D, A, W) radiance of the ground in the sun, as rays that meet it bring it to the eye."""
    height, mu = sphere.height[:, None, None], np.sin(sphere.elevation)[..., None]
    length = np.where(sphere.ground[..., :1] > 0, sphere.length[..., None], 0)
    below = np.maximum(sun_cosine_along(height, mu, np.sin(sun), cosines_to_sun(sphere, sun, azimuth), length), 0)
    light = below[..., None] * sun_transmittance(np.zeros_like(below), below, air.extinction)
    return np.asarray(light * (sphere.ground * air.ground_albedo / np.pi)[:, :, None, :])
