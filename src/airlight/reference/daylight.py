"""Evaluates the geometry of rays through a round atmosphere, its densities and its tables' coordinates, in float64.

Lengths are in m, heights above the ground, cosines of the angle to the vertical at their point. Rays are straight; the sun is a point
infinitely far away, so that its direction is the same everywhere while the vertical turns.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]
GROUND_RADIUS = 6_360_000.0  # m
TOP_HEIGHT = 100_000.0  # m, where the air ends
TOP_RADIUS = GROUND_RADIUS + TOP_HEIGHT
LEVEL_TO_TOP = float(np.sqrt(TOP_RADIUS**2 - GROUND_RADIUS**2))  # m, from the ground's horizon to the end of the air
RAYLEIGH_HEIGHT, AEROSOL_HEIGHT = 8000.0, 1200.0  # m, over which the densities fall to 1/e
OZONE_MIDDLE, OZONE_HALF_WIDTH = 25_000.0, 15_000.0  # m
ORDERS_SIZE = (20, 48, 17)  # heights, elevations, azimuths of the table of further orders
HEIGHT_POWER, ELEVATION_POWER = 4.0, 1.7  # by which its heights crowd towards the ground, its elevations towards the horizon
SUN_ANGULAR_RADIUS = 0.2678  # degrees


def radius_along(height: Any, mu: Any, t: Any) -> Array:
    """Evaluates the distance to the earth's centre, m, t m along a ray that leaves a height under a cosine mu."""
    radius, t = GROUND_RADIUS + np.asarray(height, float), np.asarray(t, float)
    return np.asarray(np.sqrt(np.maximum(radius * radius + t * (2 * radius * np.asarray(mu, float) + t), 1.0)))


def height_along(height: Any, mu: Any, t: Any) -> Array:
    """Evaluates the height, m, t m along a ray that leaves a height under a cosine mu, without taking large numbers from each other."""
    height, t = np.asarray(height, float), np.asarray(t, float)
    radius = GROUND_RADIUS + height
    rise = t * (2 * radius * np.asarray(mu, float) + t)
    return np.asarray(height + rise / (radius_along(height, mu, t) + radius))


def view_cosine_along(height: Any, mu: Any, t: Any) -> Array:
    """Evaluates the cosine between a ray and the vertical of the point t m along it."""
    radius = GROUND_RADIUS + np.asarray(height, float)
    return np.asarray(np.clip((radius * np.asarray(mu, float) + t) / radius_along(height, mu, t), -1, 1))


def sun_cosine_along(height: Any, mu: Any, mu_sun: Any, cosine: Any, t: Any) -> Array:
    """Evaluates the cosine between the sun and the vertical of the point t m along a ray.

    mu, mu_sun: cosines of ray and sun at the ray's start; cosine: between ray and sun.
    """
    radius = GROUND_RADIUS + np.asarray(height, float)
    return np.asarray(np.clip((radius * np.asarray(mu_sun, float) + np.asarray(t, float) * cosine) / radius_along(height, mu, t), -1, 1))


def in_earth_shadow(height: Any, mu_sun: Any) -> npt.NDArray[np.bool_]:
    """Decide whether the earth hides the sun's centre from a height, the sun being under a cosine mu_sun there."""
    height, mu_sun = np.asarray(height, float), np.asarray(mu_sun, float)
    clear = height * (2 * GROUND_RADIUS + height)  # r^2 - R^2
    return np.asarray((mu_sun < 0) & (clear < (GROUND_RADIUS + height) ** 2 * mu_sun**2))


def distance_to_top(height: Any, mu: Any) -> Array:
    """Evaluates the way, m, from a height within the air to its end, the ground left out of account."""
    height = np.asarray(height, float)
    along = (GROUND_RADIUS + height) * np.asarray(mu, float)
    above = (TOP_HEIGHT - height) * (TOP_RADIUS + GROUND_RADIUS + height)
    return np.asarray(np.maximum(np.sqrt(np.maximum(along * along + above, 0)) - along, 0))


def distance_to_ground(height: Any, mu: Any) -> Array:
    """Evaluates the way, m, from a height to the ground; infinite for rays that miss it."""
    height = np.asarray(height, float)
    along = (GROUND_RADIUS + height) * np.asarray(mu, float)
    clear = height * (2 * GROUND_RADIUS + height)
    squared = along * along - clear
    meets = (along < 0) & (squared >= 0)
    return np.asarray(np.where(meets, clear / np.where(meets, np.sqrt(np.maximum(squared, 0)) - along, 1), np.inf))


def air_density(height: Any) -> Array:
    """Evaluates (..., 3) densities of Rayleigh's air, the aerosol and ozone: 1 where their coefficients hold, on the ground or at 25 km."""
    height = np.maximum(np.asarray(height, float), 0)
    ozone = np.maximum(1 - np.abs(height - OZONE_MIDDLE) / OZONE_HALF_WIDTH, 0)
    return np.stack([np.exp(-height / RAYLEIGH_HEIGHT), np.exp(-height / AEROSOL_HEIGHT), ozone], axis=-1)


def ozone_column(height: Any, mu: Any, t: Any) -> Array:
    """Integrates the density of ozone over the first t m of a ray, m, exactly: the tent is linear in the distance to the earth's centre."""
    radius, t = GROUND_RADIUS + np.asarray(height, float), np.asarray(t, float)
    along = radius * np.asarray(mu, float)
    nearest = np.sqrt(np.maximum(radius * radius - along * along, 1.0))

    def upto(s: Array) -> Array:
        """Integrates the distance to the centre from the nearest point to s m behind it."""
        return np.asarray((s * np.hypot(s, nearest) + nearest**2 * np.arcsinh(s / nearest)) / 2)

    def above(level: float, start: Array, end: Array) -> Array:
        """Integrates what a height is above a level, over a part of the ray that does not come below it; 0 where it is empty."""
        end = np.maximum(start, end)
        return np.asarray(upto(end) - upto(start) - (GROUND_RADIUS + level) * (end - start))

    total: Array = np.zeros(np.broadcast_shapes(np.shape(along), np.shape(t)))
    for level, share in ((-1, 1), (0, -2), (1, 1)):
        height_there = OZONE_MIDDLE + level * OZONE_HALF_WIDTH
        reach = np.sqrt(np.maximum((GROUND_RADIUS + height_there) ** 2 - nearest**2, 0))
        start, end = along, along + t  # counted from the nearest point
        total = total + share * (above(height_there, start, np.minimum(end, -reach)) + above(height_there, np.maximum(start, reach), end))
    return np.asarray(np.maximum(total / OZONE_HALF_WIDTH, 0))


def depth_table_position(height: Any, mu: Any) -> Array:
    """Evaluates (..., 2) where in the table of optical depth, 0..1 along cosine and height, a ray from a height to the end of the air lies.

    Along x goes the way to the end of the air, between the shortest and the longest that miss the ground; along y the way to the ground's
    horizon, over that from the end of the air. Bruneton and Neyret 2008, section 4.
    """
    height = np.asarray(height, float)
    horizon = np.sqrt(np.maximum(height * (2 * GROUND_RADIUS + height), 0))
    least, most = TOP_HEIGHT - height, horizon + LEVEL_TO_TOP
    x = (distance_to_top(height, mu) - least) / (most - least)
    return np.stack([np.clip(x, 0, 1), np.clip(horizon / LEVEL_TO_TOP, 0, 1)], axis=-1)


def depth_table_ray(position: Any) -> Array:
    """Evaluates (..., 2) height, m, and cosine of the ray that lies at a position (..., 2) of the table of optical depth."""
    position = np.asarray(position, float)
    horizon = position[..., 1] * LEVEL_TO_TOP
    height = horizon**2 / (np.sqrt(horizon**2 + GROUND_RADIUS**2) + GROUND_RADIUS)
    least = TOP_HEIGHT - height
    way = least + position[..., 0] * (horizon + LEVEL_TO_TOP - least)
    above = (TOP_HEIGHT - height) * (TOP_RADIUS + GROUND_RADIUS + height)
    mu = np.where(way > 0, (above - way**2) / (2 * (GROUND_RADIUS + height) * np.where(way > 0, way, 1)), 1.0)
    return np.stack([height, np.clip(mu, -1, 1)], axis=-1)


def orders_position(height: Any, elevation: Any, azimuth: Any) -> Array:
    """Evaluates (..., 3) where in the table of further orders, in nodes from 0, a direction at a height lies.

    height: m; elevation, azimuth from the sun: radians. The table has its nodes at heights of 100 km x^4, elevations of 90 degrees |u|^1.7
    and even azimuths from the sun's to the opposite, both ends included.
    """
    heights, elevations, azimuths = ORDERS_SIZE
    u = np.clip(np.abs(np.asarray(elevation, float)) / (np.pi / 2), 0, 1) ** (1 / ELEVATION_POWER)
    u = np.where(np.asarray(elevation) < 0, -u, u)
    x = np.clip(np.asarray(height, float) / TOP_HEIGHT, 0, 1) ** (1 / HEIGHT_POWER)
    turned = np.abs(np.remainder(np.asarray(azimuth, float) + np.pi, 2 * np.pi) - np.pi)
    return np.stack(np.broadcast_arrays(x * (heights - 1), (u + 1) / 2 * (elevations - 1), turned / np.pi * (azimuths - 1)), axis=-1)


def horizon_cosine(height: Any) -> Array:
    """Evaluates the cosine to the vertical of a ray that grazes the ground, from a height: 0 on the ground, below 0 above it."""
    height = np.asarray(height, float)
    return np.asarray(-np.sqrt(np.maximum(height * (2 * GROUND_RADIUS + height), 0)) / (GROUND_RADIUS + height))


def sun_disc_part(elevation: Any, height: Any) -> Array:
    """Evaluates the part of the sun's disc, 0..1, that stands above the ground's horizon, seen from a height; angles in degrees."""
    height = np.maximum(np.asarray(height, float), 0)
    horizon = np.degrees(np.arcsin(horizon_cosine(height)))
    x = np.clip((np.asarray(elevation, float) - horizon) / SUN_ANGULAR_RADIUS, -1, 1)
    return np.asarray(0.5 + (np.arcsin(x) + x * np.sqrt(1 - x * x)) / np.pi)


def hoffman_preetham_phase(cosine: Any, g: Any) -> Array:
    """Evaluates the aerosol's phase function as GPU Gems 3's source prints it, 1/sr: its integral is (1 - g) / (1 + g), not 1.

    cosine: 1 where one looks into the sun. Hoffman and Preetham 2002.
    """
    cosine, g = np.asarray(cosine, float), np.asarray(g, float)
    return np.asarray((1 - g) ** 2 / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5))
