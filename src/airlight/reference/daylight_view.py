"""Evaluates where the table of view rays holds them, and what its shaders compute beside `reference/daylight.py`, in float64."""

from typing import Any

import numpy as np

from airlight.reference.daylight import (
    GROUND_RADIUS,
    RAYLEIGH_HEIGHT,
    SUN_ANGULAR_RADIUS,
    Array,
    distance_to_ground,
    hoffman_preetham_phase,
)

ELEVATIONS, AZIMUTHS, DISTANCES = 96, 32, 48  # of the table
BELOW = 32  # of the elevations, below the horizon
NO_END = 1e9  # m: the way of a ray that meets nothing
HIGH = 4000.0  # m, of the eye, beyond which sky below the horizon is read at the table's last node


def way_to_ground(height: Any, mu: Any) -> Array:
    """Evaluates the way, m, from a height to the ground; 0 for rays that miss it."""
    way = distance_to_ground(height, mu)
    return np.where(np.isfinite(way), way, 0.0)


def arc_sine(x: Any) -> Array:
    """Evaluates the angle, radians, whose sine is x; Abramowitz and Stegun 1964, 4.4.46, in the shader."""
    return np.arcsin(np.clip(np.asarray(x, float), -1, 1))


def sun_position(elevation: Any) -> Array:
    """Evaluates where among the suns that are solved, from 0, a sun at an elevation, degrees, lies.

    They stand 2 degrees apart, and 1 between -10 and 8.
    """
    elevation = np.asarray(elevation, float)
    return np.asarray((np.minimum(elevation, -10) + 30) / 2 + np.clip(elevation + 10, 0, 18) + np.maximum(elevation - 8, 0) / 2)


def part_left(x: Any) -> Array:
    """Evaluates the part (1 - e^-x) / x of what a step sends out that reaches its start, x its optical depth."""
    x = np.asarray(x, float)
    return np.asarray(np.where(x > 0, -np.expm1(-x) / np.where(x > 0, x, 1), 1.0))


def way_coordinate(t: Any, near: Any, step: Any) -> Array:
    """Evaluates where along the table's texture, 0 to 1, a way of t m lies.

    Nodes stand evenly in ln(1 + t / near); between two it goes as t does. step: that logarithm from node to node.
    """
    step = np.asarray(step, float)
    at = np.clip(np.log1p(np.maximum(t, 0) / np.asarray(near, float)) / step, 0, DISTANCES - 1)
    first = np.minimum(np.floor(at), DISTANCES - 2)
    return np.asarray((first + np.expm1((at - first) * step) / np.expm1(step) + 0.5) / DISTANCES)


def way_at(nodes: Any, near: Any, step: Any) -> Array:
    """Evaluates the way, m, at a number of nodes, whole or not, from the eye."""
    return np.asarray(near * np.expm1(np.asarray(nodes, float) * step))


def elevation_row(elevation: Any, horizon: Any, warp: Any, rows: Any) -> Array:
    """Evaluates which row of the table, in nodes from 0, an elevation has, in radians as the horizon.

    Rows stand evenly in ln(1 + e / warp), e the angle from the horizon, and none lies between the last below and the first above it.
    rows (2,): a unit of that logarithm, below and above.
    """
    elevation = np.asarray(elevation, float)
    away = np.log1p(np.abs(elevation - horizon) / warp)
    below = np.maximum(BELOW - 1 - np.asarray(rows)[0] * away, 0)
    return np.where(elevation >= horizon, np.minimum(BELOW + np.asarray(rows)[1] * away, ELEVATIONS - 1), below)


def rows_a_unit(horizon: float, warp: float) -> tuple[float, float]:
    """Evaluates how many rows of the table a unit of ln(1 + e / warp) has, below the horizon and above it; radians."""
    below, above = (float(np.log1p((np.pi / 2 + side * horizon) / warp)) for side in (1, -1))
    return (BELOW - 1) / below, (ELEVATIONS - BELOW - 1) / above


def row_elevations(horizon: float, warp: float) -> Array:
    """Evaluates the elevations (ELEVATIONS,), radians, of the table's rows for a horizon."""

    def away(count: int, most: float) -> Array:
        """Give the angles from the horizon of rows on one side of it."""
        return np.asarray(warp * np.expm1(np.linspace(0, 1, count) * np.log1p(most / warp)))

    up, down = np.pi / 2 - horizon, np.pi / 2 + horizon
    return np.concatenate([horizon - away(BELOW, down)[::-1], horizon + away(ELEVATIONS - BELOW, up)])


def azimuth_column(mu: Any, along: Any) -> Array:
    """Evaluates which column of the table, in nodes from 0, a direction has: even in the sine of half its azimuth from the sun's.

    mu: its cosine to the vertical; along: to the level direction towards the sun.
    """
    mu = np.asarray(mu, float)
    cosine = np.asarray(along, float) / np.sqrt(np.maximum(1 - mu * mu, 1e-12))
    return np.asarray((AZIMUTHS - 1) * np.sqrt(np.clip((1 - cosine) / 2, 0, 1)))


def column_azimuths() -> Array:
    """Evaluates the azimuths from the sun's (AZIMUTHS,), radians, of the table's columns."""
    return np.asarray(2 * np.arcsin(np.linspace(0, 1, AZIMUTHS)))


def air_phases(a: Any, b: Any, g: Any) -> Array:
    """Evaluates (..., 2) the phase functions of Rayleigh's air and of the aerosol, 1/sr, between unit vectors.

    g: the aerosol's anisotropy. Cornette and Shanks 1992.
    """
    a, b, g = (np.asarray(one, float) for one in (a, b, g))
    apart = ((a - b) ** 2).sum(axis=-1) / 2
    cosine = 1 - apart
    turned = 3 / (16 * np.pi) * (1 + cosine**2)
    return np.stack([turned, turned * 2 * (1 - g * g) / ((2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5)], axis=-1)


def daylight_ray(direction: Any, record: Any) -> tuple[Array, Array, Array, Array]:
    """Place view rays (..., 3), unit, in the table that a record describes: coordinates and phases (..., 2), ways (...).

    record: of view_table.wgsl's Daylight. The ways, m, are that to the ground, NO_END for rays that miss it, and that at which the table
    holds all of the ray.
    """
    direction = np.asarray(direction, float)
    up, ahead, to_sun = (np.asarray(record[name], float) for name in ("up", "ahead", "to_sun"))
    mu = (direction * up).sum(axis=-1)
    row = elevation_row(np.arcsin(np.clip(mu, -1, 1)), float(record["horizon"]), float(record["warp"]), record["rows"])
    column = azimuth_column(mu, (direction * ahead).sum(axis=-1))
    way = np.minimum(distance_to_ground(float(record["height"]), mu), NO_END)
    end = way if record["height"] <= HIGH else np.full(way.shape, NO_END)
    at = (np.stack([column, row], axis=-1) + 0.5) / (AZIMUTHS, ELEVATIONS)
    return at, air_phases(direction, to_sun, float(record["anisotropy"])), way, end


def way_in_even_air(mu: Any) -> Array:
    """Evaluates the way, m, from the ground to the end of air that is as dense as there up to 8 km, and then ends."""
    along = GROUND_RADIUS * np.asarray(mu, float)
    above = RAYLEIGH_HEIGHT * (2 * GROUND_RADIUS + RAYLEIGH_HEIGHT)
    return np.asarray(np.sqrt(along * along + above) - along)


def hoffman_preetham_light(cosine: Any, rayleigh: Any, mie: Any, g: Any, way: Any, printed: bool) -> Array:
    """Evaluates (..., 3) what an irradiance of 1 adds to a view by Eq. 1, after a way, m, in even air.

    cosine: 1 where one looks into the sun; rayleigh, mie (..., 3): scattering, 1/m; g: of the aerosol, whose phase function is as printed,
    or Henyey and Greenstein's. GPU Gems 3, chapter 13.
    """
    cosine, g, way = (np.asarray(one, float)[..., None] for one in (cosine, g, way))
    rayleigh, mie = np.asarray(rayleigh, float), np.asarray(mie, float)
    aerosol = hoffman_preetham_phase(cosine, g) * np.where(printed, 1, (1 + g) / (1 - g))
    scattered = rayleigh * 3 / (16 * np.pi) * (1 + cosine**2) + mie * aerosol
    return np.asarray(scattered * way * part_left((rayleigh + mie) * way))


def disc_part(apart: Any, radius: Any, edge: Any) -> Array:
    """Evaluates the part of a pixel, 0..1, that a disc covers whose edge is as soft as the pixel is wide.

    apart: 1 - cosine to its centre; radius, edge: radians, of the disc and half a pixel.
    """
    away = np.sqrt(2 * np.asarray(apart, float))
    return np.asarray(np.clip((radius - away) / (2 * np.asarray(edge, float)) + 0.5, 0, 1))


def drawn_disc(edge: float) -> tuple[float, float]:
    """Evaluates (radius, share) of the sun's disc as it is drawn: radians, and of its radiance, so that it gives as much light.

    edge: radians of half a pixel, of which the disc has at least the radius.
    """
    real = np.radians(SUN_ANGULAR_RADIUS)
    radius = max(real, edge)
    return float(radius), float(real**2 / (radius**2 + edge**2 / 3))
