"""Holds directions and rays over the whole sphere at heights of one vertical, which the solvers of multiple scattering share.

Elevations crowd on both sides of each height's own horizon, where radiance jumps; azimuths are even, from the sun's to the opposite.
"""

from typing import Any, NamedTuple

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import sun_transmittance
from airlight.daylight.rays import Nodes, gauss, place_nodes
from airlight.reference.daylight import (
    GROUND_RADIUS,
    Array,
    distance_to_ground,
    distance_to_top,
    sun_cosine_along,
    view_cosine_along,
)

Single = np.float32  # is enough for tables of 1e-3
Wide = Any


class Sphere(NamedTuple):
    """Holds H heights, D elevations at each, and N nodes along each ray.

    height (H,), m; elevation (H, D), radians; solid (H, D): solid angle of a belt of elevations, sr, over all azimuths; nodes: (H, D, N);
    meets: (H, D), whether a ray meets the ground; left (H, D, N, W): weights of nodes times transmittance to the eye; ground (H, D, W):
    transmittance to the ground, 0 where it is missed.
    """

    height: Array
    elevation: Array
    solid: Array
    nodes: Nodes
    local: Array
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
    left = nodes.weights[..., None] * np.exp(-nodes.columns @ air.extinction)
    ground = np.where(np.isfinite(way)[..., None], np.exp(-nodes.end @ air.extinction), 0)
    local = view_cosine_along(eyes[..., None], mu[..., None], nodes.t)
    return Sphere(height, elevation, 2 * np.pi * belt * np.cos(elevation), nodes, local, left, ground)


def cosines_to_sun(sphere: Sphere, sun: float, azimuth: Array) -> Array:
    """Evaluate (H, D, A) cosines between rays and a sun at an elevation, radians, for azimuths (A,)."""
    mu, level = np.sin(sphere.elevation)[..., None], np.cos(sphere.elevation)[..., None]
    return np.asarray(mu * np.sin(sun) + level * np.cos(sun) * np.cos(azimuth))


def sunlight(air: Coefficients, sphere: Sphere, sun: float, azimuth: Array, table: Array) -> tuple[Array, Array]:
    """Evaluate the sun's light (H, D, A, N, W) at nodes, and (H, D, A, W) on level ground where rays meet it; its irradiance above is 1.

    table: of columns, as `columns_table` makes it, in the precision that is wanted.
    """
    height, mu = sphere.height[:, None, None], np.sin(sphere.elevation)[..., None]
    cosine = cosines_to_sun(sphere, sun, azimuth)
    at = sun_cosine_along(height[..., None], mu[..., None], np.sin(sun), cosine[..., None], sphere.nodes.t[:, :, None, :])
    light = sun_transmittance(np.broadcast_to(sphere.nodes.height[:, :, None, :], at.shape), at, air.extinction, table)
    length = np.where(np.isfinite(way := distance_to_ground(height, mu)), way, 0)
    below = np.maximum(sun_cosine_along(height, mu, np.sin(sun), cosine, length), 0)
    ground = below[..., None] * sun_transmittance(np.zeros_like(below), below, air.extinction)
    return light, np.asarray(ground)
