"""Solves light of second and higher orders of scattering, with the real phase functions, on one vertical of the air.

Further orders are linear in the first. Order n is known by what it scatters into each direction of a table (heights, elevations, azimuths),
A = sum over directions of phase L, once for Rayleigh's phase and once for the aerosol's; order n + 1 is L = int T (sR AR + sM AM) dt along
rays, plus what the ground returns. Turning around the vertical changes neither step, so that both act on each cosine of the azimuth by
itself: as matrices, which only the air decides, and which serve all suns. The sun's elevation is held over the vertical's rays; what reads
the table interpolates between suns instead (`multiple.py`).
"""

from typing import NamedTuple

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.march import phases
from airlight.daylight.rays import gauss
from airlight.daylight.sphere import Sphere, cosines_to_sun, make_sphere, scattered_sunlight, sunlit_ground
from airlight.reference.daylight import ELEVATION_POWER, HEIGHT_POWER, ORDERS_SIZE, TOP_HEIGHT, Array, orders_position

Single = np.float32  # is enough for tables of 1e-3
HALF, COUNT = 20, 4  # elevations above and below the horizon; nodes of half a piece of a ray
MOST_ORDERS, ENOUGH = 40, 2e-3  # after which, or below which part of the sum, the rest is summed as a geometric series
HEIGHTS, ELEVATIONS, AZIMUTHS = ORDERS_SIZE


class Operators(NamedTuple):
    """Holds what turns light into light of the next order, in float32, for W wavelengths; M cosines of the azimuth.

    scatter (2, M, H, E, D): L to A; travel (W, H D, 2 H E): A to L; bounce (W, H D): the ground's radiance, by irradiance, to L.
    """

    sphere: Sphere
    scatter: Array
    travel: Array
    bounce: Array


def table_heights() -> Array:
    """Give the heights (H,), m, of the table."""
    return np.asarray(TOP_HEIGHT * np.linspace(0, 1, HEIGHTS) ** HEIGHT_POWER)


def table_elevations() -> Array:
    """Give the elevations (E,), radians, of the table; the outer ones are straight down and up."""
    u = np.linspace(-1, 1, ELEVATIONS)
    return np.asarray(np.pi / 2 * np.sign(u) * np.abs(u) ** ELEVATION_POWER)


def table_azimuths() -> Array:
    """Give the azimuths from the sun (A,), radians, of the table, both ends included."""
    return np.linspace(0, np.pi, AZIMUTHS)


def azimuth_weights() -> Array:
    """Give the part of the whole circle (A,) that each azimuth and its mirror image stand for."""
    weights = np.full(AZIMUTHS, 1 / (AZIMUTHS - 1))
    weights[[0, -1]] /= 2
    return weights


def elevation_weights() -> Array:
    """Integrate over the sphere what is 1 at one elevation of the table and linear to its neighbours: (E,), summing to 2."""
    x, weight, _ = gauss(8)
    u = np.linspace(-1, 1, ELEVATIONS)
    fine = u[:-1, None] + (u[1] - u[0]) * x
    elevation = np.pi / 2 * np.sign(fine) * np.abs(fine) ** ELEVATION_POWER
    belt = weight * (u[1] - u[0]) * np.cos(elevation) * np.pi / 2 * ELEVATION_POWER * np.abs(fine) ** (ELEVATION_POWER - 1)
    out = np.zeros(ELEVATIONS)
    out[:-1] += (belt * (1 - x)).sum(axis=1)
    out[1:] += (belt * x).sum(axis=1)
    return np.asarray(out)


def to_cosines() -> Array:
    """Give (M, A) the matrix from values at azimuths to coefficients of cos(m azimuth), m up to A - 1."""
    m = np.arange(AZIMUTHS)
    matrix = 2 * azimuth_weights() * np.cos(np.outer(m, table_azimuths()))
    matrix[[0, -1]] /= 2
    return np.asarray(matrix)


def from_cosines() -> Array:
    """Give (A, M) the matrix from coefficients of cos(m azimuth) to values at azimuths."""
    return np.cos(np.outer(table_azimuths(), np.arange(AZIMUTHS)))


def make_operators(air: Coefficients) -> Operators:
    """Integrate both steps for an air: (H, D) rays at the table's heights, read at the table's nodes."""
    sphere = make_sphere(air, table_heights(), HALF, COUNT)
    return Operators(sphere, _scatter(air, sphere).astype(Single), _travel(air, sphere).astype(Single), _bounce(air, sphere).astype(Single))


def _scatter(air: Coefficients, sphere: Sphere) -> Array:
    """Integrate phase functions over the belts of elevation: (2, M, H, E, D).

    Sampled phases are scaled so that each incident direction gives off as much as it takes.
    """
    whole = np.linspace(0, 2 * np.pi, 2 * (AZIMUTHS - 1), endpoint=False)
    out, into = table_elevations()[:, None, None], sphere.elevation[:, None, :, None]
    cosine = np.sin(out) * np.sin(into) + np.cos(out) * np.cos(into) * np.cos(whole)  # (H, E, D, azimuths)
    sampled = phases(np.clip(cosine, -1, 1), air.anisotropy)
    given = np.einsum("hedas,e->hds", sampled, elevation_weights()) * 2 * np.pi / len(whole)
    turned = sampled @ np.eye(2) / given[:, None, :, None, :]
    waves = np.cos(np.outer(whole, np.arange(AZIMUTHS))) / len(whole)
    return np.asarray(np.einsum("hedas,am->smhed", turned, waves, optimize=True) * sphere.solid[:, None, :])


def _travel(air: Coefficients, sphere: Sphere) -> Array:
    """Integrate along rays what the table's nodes scatter: (W, H D, 2 H E)."""
    rays = sphere.elevation.size
    at = orders_position(sphere.at, np.arcsin(sphere.local), 0.0)[..., :2]
    first = np.minimum(at.astype(int), (HEIGHTS - 2, ELEVATIONS - 2))
    share = at - first
    ray = np.repeat(np.arange(rays), np.diff(sphere.first))
    across = HEIGHTS * ELEVATIONS
    out = np.zeros((len(air.nm), rays, 2, across), Single)
    index = ((ray * HEIGHTS + first[..., 0]) * ELEVATIONS + first[..., 1])
    corners = [(i * ELEVATIONS + j, np.abs(1 - i - share[..., 0]) * np.abs(1 - j - share[..., 1])) for i, j in ((0, 0), (0, 1), (1, 0), (1, 1))]
    touched, place = np.unique(np.concatenate([index + offset for offset, _ in corners]), return_inverse=True)
    weights = np.concatenate([weight for _, weight in corners])
    for kind in range(2):
        for w in range(len(air.nm)):
            total = np.bincount(place, weights * np.tile(sphere.weights[:, kind, w], 4))
            out[w, touched // across, kind, touched % across] = total
    return out.reshape(len(air.nm), rays, -1)


def _bounce(air: Coefficients, sphere: Sphere) -> Array:
    """Give what a ray sees of ground that gets an irradiance of 1: (W, H D)."""
    return np.asarray((sphere.ground * air.ground_albedo / np.pi).reshape(-1, len(air.nm)).T)


def first_order(air: Coefficients, operators: Operators, sun: float) -> Array:
    """Integrate light scattered once, by air or ground: (H, D, A, W) radiance for a sun at an elevation, radians."""
    sphere, azimuth = operators.sphere, table_azimuths()
    turned = phases(cosines_to_sun(sphere, sun, azimuth), air.anisotropy)  # (H, D, A, 2)
    turned /= np.einsum("hdak,hd,a->hk", turned, sphere.solid, azimuth_weights())[:, None, None, :]  # sampled, they give off all they take
    sunlit = scattered_sunlight(sphere, sun, azimuth)
    by_air = np.einsum("hdakw,hdak->hdaw", sunlit, turned.astype(Single))
    return np.asarray(by_air + sunlit_ground(air, sphere, sun, azimuth).astype(Single))


def solve_orders(air: Coefficients, operators: Operators, sun: float) -> Array:
    """Sum all orders from the second: (2, H, E, A, W) float32, what Rayleigh's phase and the aerosol's turn into each direction, 1/sr.

    A metre of air scatters sR times the first and sM times the second. sun: its elevation, radians.
    """
    light = np.einsum("ma,hdaw->mhdw", to_cosines(), first_order(air, operators, sun)).astype(Single)  # by cosines of the azimuth
    modes, heights, directions, count = light.shape
    _, _, _, elevations, _ = operators.scatter.shape
    falling = operators.sphere.solid[0] * np.maximum(np.sin(operators.sphere.elevation[0]), 0)
    total = np.zeros((2, modes, heights, elevations, count), Single)
    before = np.zeros(count)
    for _ in range(MOST_ORDERS):
        turned = np.matmul(operators.scatter, light)  # (2, M, H, E, W)
        total += turned
        amount = np.abs(turned[:, 0]).sum(axis=(0, 1, 2), dtype=float)
        if (amount <= ENOUGH * np.abs(total[:, 0]).sum(axis=(0, 1, 2))).all():
            break
        irradiance = falling @ light[0, 0]  # (W,): of the ground
        source = turned.transpose(4, 0, 2, 3, 1).reshape(count, -1, modes)
        light = np.matmul(operators.travel, source)  # (W, H D, M)
        light[..., 0] += operators.bounce * irradiance[:, None]
        light = light.reshape(count, heights, directions, modes).transpose(3, 1, 2, 0)
        before = amount
    ratio = np.minimum(np.where(before > 0, amount / np.where(before > 0, before, 1), 0), 0.999)
    total += turned * (ratio / (1 - ratio)).astype(Single)
    return np.asarray(np.einsum("am,smhew->sheaw", from_cosines().astype(Single), total))
