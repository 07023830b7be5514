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

ELEVATIONS, AZIMUTHS, DISTANCES = 104, 32, 62  # of the table
BELOW = 32  # of the elevations, below the horizon
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
LEAST_SHARE, MOST_SHARE = 1e-4, 100.0  # of light that is not the aerosol's, over the aerosol's without its phase function
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


def octaves(x: Any) -> Array:
    """Evaluates the octave, from 0, that x >= 1 lies in, and where in it: the logarithm to base 2 at powers of 2, straight between."""
    part, power = np.frexp(np.asarray(x, float))
    return np.asarray(power - 1 + 2 * part - 1)


def of_octaves(y: Any) -> Array:
    """Evaluates the number that has so many octaves."""
    whole = np.floor(np.asarray(y, float))
    return np.asarray(2**whole * (1 + y - whole))


def way_coordinate(t: Any, near: Any, dense: Any) -> Array:
    """Evaluates where along the table's texture, 0 to 1, a way of t m lies.

    Nodes stand evenly in the octaves of 1 + t / near, dense in each, so that between two it goes as t does.
    """
    at = np.asarray(dense, float) * octaves(1 + np.maximum(t, 0) / np.asarray(near, float))
    return np.asarray((np.minimum(at, DISTANCES - 1) + 0.5) / DISTANCES)


def way_at(nodes: Any, near: Any, dense: Any) -> Array:
    """Evaluates the way, m, at a number of nodes, whole or not, from the eye."""
    return np.asarray(near * (of_octaves(np.asarray(nodes, float) / dense) - 1))


def way_nodes(near: float, farthest: float) -> tuple[float, float]:
    """Evaluates (near, dense) by which the last node lies at a way, m: the whole number of nodes in an octave with near about as wanted."""
    dense = max(round((DISTANCES - 1) / np.log2(1 + farthest / near)), 1)
    return float(farthest / (of_octaves((DISTANCES - 1) / dense) - 1)), float(dense)


def elevation_row(mu: Any, level: Any, horizon: Any, rows: Any) -> Array:
    """Evaluates which row of the table, in nodes from 0, a direction has; beyond the table's ends too.

    Rows stand evenly in the octaves of 1 + tan(e / 2) / warp, e the angle from the horizon, and none lies between the last below and the
    first above it. mu, level: sine and cosine of the elevation; horizon (2,): those of the horizon's; rows (4,): 1 / warp and rows in an
    octave, below, then above.
    """
    mu, level, (low, flat) = np.asarray(mu, float), np.asarray(level, float), np.asarray(horizon, float)
    sine = mu * flat - level * low
    tangent = np.abs(sine) / (1 + level * flat + mu * low)
    (below, each_below, above, each_above), is_above = np.asarray(rows, float), sine >= 0
    away = octaves(1 + tangent * np.where(is_above, above, below))
    return np.asarray(np.where(is_above, BELOW + each_above * away, BELOW - 1 - each_below * away))


def elevation_rows(horizon: float, warp: float) -> tuple[float, float, float, float]:
    """Evaluates the rows of `elevation_row` by which the last lie at nadir and zenith: whole numbers in an octave; radians.

    warp: within which they are to be about even above the horizon, and twice that below.
    """
    found: list[float] = []
    for count, side, within in ((BELOW, 1, 2 * warp), (ELEVATIONS - BELOW, -1, warp)):
        most = np.tan((np.pi / 2 + side * horizon) / 2)
        each = round((count - 1) / np.log2(1 + most / np.tan(within / 2)))
        found += [float((of_octaves((count - 1) / each) - 1) / most), float(each)]
    below, each_below, above, each_above = found
    return below, each_below, above, each_above


def row_elevations(horizon: float, rows: Any) -> Array:
    """Evaluates the elevations (ELEVATIONS,), radians, of the table's rows for a horizon. rows: of `elevation_rows`."""
    below, each_below, above, each_above = rows
    down = 2 * np.arctan((of_octaves(np.arange(BELOW) / each_below) - 1) / below)
    up = 2 * np.arctan((of_octaves(np.arange(ELEVATIONS - BELOW) / each_above) - 1) / above)
    return np.concatenate([horizon - down[::-1], horizon + up])


def azimuth_column(level: Any, along: Any) -> Array:
    """Evaluates which column of the table, in nodes from 0, a direction has: even in the sine of half its azimuth from the sun's.

    level: its cosine to the ground; along: to the level direction towards the sun.
    """
    cosine = np.asarray(along, float) / np.maximum(level, 1e-6)
    return np.asarray((AZIMUTHS - 1) * np.sqrt(np.clip((1 - cosine) / 2, 0, 1)))


def column_azimuths() -> Array:
    """Evaluates the azimuths from the sun's (AZIMUTHS,), radians, of the table's columns."""
    return np.asarray(2 * np.arcsin(np.linspace(0, 1, AZIMUTHS)))


def aerosol_phase(cosine: Any, sine2: Any, g: Any) -> Array:
    """Evaluates the phase function of the aerosol, 1/sr. Cornette and Shanks 1992.

    cosine, sine2: of the angle between ray and sun, and its sine squared; g: the aerosol's anisotropy.
    """
    cosine, g = np.asarray(cosine, float), np.asarray(g, float)
    to_peak = cosine * np.sign(g)
    apart = np.where(to_peak > 0, np.asarray(sine2, float) / np.maximum(1 + to_peak, 1), 1 - to_peak)
    under = (1 - abs(g)) ** 2 + 2 * abs(g) * apart
    return np.asarray(3 / (8 * np.pi) * (1 - g * g) / (2 + g * g) * (1 + cosine**2) / under**1.5)


def node_index(k: Any, row: Any, column: Any) -> Array:
    """Evaluates where what a ray gathers up to node k of its way is kept."""
    return np.asarray((np.asarray(k) * ELEVATIONS + row) * AZIMUTHS + column)


def broad_share(rest: Any, aerosol: Any, broad: Any) -> Array:
    """Evaluates light (..., 3) that is no aerosol's over the aerosol's without its phase function and times broad, as luminances."""
    sharp = (np.asarray(broad, float) * np.asarray(aerosol, float)) @ LUMINANCE
    share = np.asarray(rest, float) @ LUMINANCE / np.where(sharp > 0, sharp, 1)
    return np.asarray(np.where(sharp > 0, np.clip(share, LEAST_SHARE, MOST_SHARE), MOST_SHARE))


def daylight_of(stored: Any, phase: Any, broad: Any, irradiance: Any) -> Array:
    """Evaluates the radiance (..., 3) of what a texture of the table holds of a ray."""
    stored, phase = np.asarray(stored, float), np.asarray(phase, float)[..., None]
    return np.asarray(np.asarray(irradiance, float) * stored[..., :3] * (np.asarray(broad, float) + stored[..., 3:] * phase))


def daylight_place(mu: Any, along: Any, cosine: Any, sine2: Any, record: Any) -> tuple[Array, Array, Array, Array]:
    """Place view rays in the table that a record describes: coordinates (..., 2), the aerosol's phase function and ways (...).

    mu, along, cosine: of the angles to the vertical, the level direction towards the sun and the sun; sine2: squared sine of the last.
    record: of view_table.wgsl's Daylight. The ways, m, are that to the ground, NO_END for rays that miss it, and that at which the table
    holds all of the ray.
    """
    mu = np.asarray(mu, float)
    level = np.sqrt(np.maximum(1 - mu * mu, 0))
    at = np.stack([azimuth_column(level, along), elevation_row(mu, level, record["horizon"], record["rows"])], axis=-1)
    way = np.minimum(distance_to_ground(float(record["height"]), mu), NO_END)
    end = way if record["height"] <= HIGH else np.full(way.shape, NO_END)
    return (at + 0.5) / (AZIMUTHS, ELEVATIONS), aerosol_phase(cosine, sine2, float(record["anisotropy"])), way, end


def daylight_ray(direction: Any, record: Any) -> tuple[Array, Array, Array, Array]:
    """Place view rays (..., 3), unit, in the table that a record describes, as `daylight_place` does."""
    direction = np.asarray(direction, float)
    up, ahead, to_sun = (np.asarray(record[name], float) for name in ("up", "ahead", "to_sun"))
    off = np.cross(direction, to_sun)
    return daylight_place(direction @ up, direction @ ahead, direction @ to_sun, (off * off).sum(axis=-1), record)


def angles_of(off: Any, toward: Any) -> tuple[Array, Array, Array, Array, Array]:
    """Evaluates the angles of rays, of any length from 1 along the view's axis: cosines to the vertical, to the level direction towards the
    sun and to the sun, the squared sine of the last, and the cosine to the axis.

    off (..., 2): how far they leave the sun's direction, sideways and up; toward (..., 3): how far they go to the sun, up, and along the
    level direction towards the sun.
    """
    off, toward = np.asarray(off, float), np.asarray(toward, float)
    away = (off * off).sum(axis=-1)
    shorter = 1 / np.sqrt(away + toward[..., 0] ** 2)
    return toward[..., 1] * shorter, toward[..., 2] * shorter, toward[..., 0] * shorter, away * shorter**2, shorter


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
