"""Solves light of second and higher orders of scattering, with the real phase functions, on one vertical of the air.

Further orders are linear in the first. Order n is known by what it scatters into each direction of a table (heights, elevations, azimuths),
A = sum over directions of phase L, once for Rayleigh's phase and once for the aerosol's; order n + 1 is L = int T (sR AR + sM AM) dt along
rays, plus what the ground returns. Turning around the vertical changes neither step, so that both act on each cosine of the azimuth by
itself: as matrices, which only the air decides, and which serve all suns. The sun's elevation is held over the vertical's rays; what reads
the table interpolates between suns instead (`multiple.py`).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.march import phases
from airlight.daylight.rays import gauss
from airlight.daylight.sphere import Sphere, cosines_to_sun, make_sphere, scattered_sunlight, sunlit_ground
from airlight.reference.daylight import ELEVATION_POWER, HEIGHT_POWER, ORDERS_SIZE, TOP_HEIGHT, Array, air_density, orders_position

Single = np.float32  # is enough for tables of 1e-3
HALF, COUNT = 20, 4  # elevations above and below the horizon; nodes of half a piece of a ray
DENSE, FINEST = 1.0, 6  # optical depth between heights of a solve, and parts of a cell of the table that it has at the most
BLOCK = 10  # rays that travel at a time: products so small that BLAS leaves them to one thread, since suns are solved in two
MOST_ORDERS, ENOUGH = 40, 2e-3  # after which, or below which part of the sum, the rest is summed as a geometric series
FAINT = 1e-4  # of the sum, below which cosines of the azimuth are left out of what is scattered on
HEIGHTS, ELEVATIONS, AZIMUTHS = ORDERS_SIZE


class Operators(NamedTuple):
    """Holds what turns light into light of the next order, in float32, for W wavelengths; M cosines of the azimuth.

    own (20,): which of H heights are the table's; scatter (2, M, H, E, D): L to A; travel: A to L, by blocks of rays; bounce (H, D, W): the
    ground's radiance, by irradiance, to L.
    """

    sphere: Sphere
    own: npt.NDArray[np.intp]
    scatter: Array
    travel: list["Travel"]
    bounce: Array


class Travel(NamedTuple):
    """Holds what turns A into light along a block of rays that leave one height, all down or all up.

    height, directions: which of H, D these are; heights, elevations: which of H, E they meet; matrix (W, rays, 2 * heights * elevations):
    float32.
    """

    height: int
    directions: slice
    heights: slice
    elevations: slice
    matrix: Array


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


def solved_heights(air: Coefficients) -> tuple[Array, npt.NDArray[np.intp]]:
    """Give the heights (H,), m, of a solve, more than the table's where the air is dense; and (20,) which of them are the table's."""
    own = table_heights()
    depth = np.diff(own) * (air_density(own) @ air.extinction).max(axis=-1)[:-1]
    parts = np.clip(np.ceil(depth / DENSE), 1, FINEST).astype(int)
    u = (own / TOP_HEIGHT) ** (1 / HEIGHT_POWER)
    inner = [np.linspace(low, high, n, endpoint=False) for low, high, n in zip(u[:-1], u[1:], parts)]
    heights = TOP_HEIGHT * np.concatenate([*inner, [1.0]]) ** HEIGHT_POWER
    return heights, np.cumsum([0, *parts])


def make_operators(air: Coefficients) -> Operators:
    """Integrate both steps for an air: (H, D) rays at the solve's heights, read at its nodes."""
    heights, own = solved_heights(air)
    sphere = make_sphere(air, heights, HALF, COUNT)
    bounce = (sphere.ground * air.ground_albedo / np.pi).astype(Single)
    blocks = [_travel(sphere, h, slice(d, d + BLOCK)) for h in range(len(heights)) for d in range(0, 2 * HALF, BLOCK)]
    return Operators(sphere, own, _scatter(air, sphere), blocks, bounce)


def _scatter(air: Coefficients, sphere: Sphere) -> Array:
    """Integrate phase functions over the belts of elevation: (2, M, H, E, D) float32.

    Sampled phases are scaled so that each incident direction gives off as much as it takes.
    """
    azimuth = table_azimuths()
    up, level = np.sin(table_elevations())[:, None, None], np.cos(table_elevations())[:, None, None] * np.cos(azimuth)
    waves = azimuth_weights()[:, None] * from_cosines()
    out = np.empty((2, AZIMUTHS, *sphere.elevation.shape[:1], ELEVATIONS, 2 * HALF), Single)
    for h, (into, solid) in enumerate(zip(sphere.elevation, sphere.solid)):  # one by one, which stay in the cache
        cosine = up * np.sin(into)[:, None] + level * np.cos(into)[:, None]  # (E, D, A)
        sampled = np.moveaxis(phases(np.clip(cosine, -1, 1), air.anisotropy), -1, 0)
        turned = sampled @ waves  # (2, E, D, M)
        given = 2 * np.pi * np.einsum("ked,e->kd", turned[..., 0], elevation_weights())
        out[:, :, h] = np.moveaxis(turned * (solid / given)[:, None, :, None], -1, 1)
    return out


def _travel(sphere: Sphere, height: int, directions: slice) -> Travel:
    """Integrate along rays of one height what the table's nodes scatter."""
    _, kinds, waves = sphere.weights.shape
    at_ray = height * sphere.elevation.shape[1]
    starts = sphere.first[at_ray + directions.start : at_ray + directions.stop + 1]
    nodes, counts = slice(starts[0], starts[-1]), np.diff(starts)
    at = orders_position(sphere.at[nodes], np.arcsin(sphere.local[nodes]), 0.0)[..., :2]
    at[:, 0] = np.interp(at[:, 0], (sphere.height / TOP_HEIGHT) ** (1 / HEIGHT_POWER) * (HEIGHTS - 1), np.arange(len(sphere.height)))
    first = np.minimum(at.astype(int), (len(sphere.height) - 2, ELEVATIONS - 2))
    share, lowest, highest = at - first, first.min(axis=0), first.max(axis=0) + 2
    heights, elevations = (slice(int(low), int(high)) for low, high in zip(lowest, highest))
    size = highest - lowest
    first = first - lowest
    ray = np.repeat(np.arange(len(counts)), counts)
    corners = ((0, 0), (0, 1), (1, 0), (1, 1))
    index = np.concatenate([(ray * size[0] + first[:, 0] + i) * size[1] + first[:, 1] + j for i, j in corners])
    weights = np.concatenate([np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1]) for i, j in corners])
    out = np.empty((waves, len(counts), kinds, int(size.prod())), Single)
    for kind, w in np.ndindex(kinds, waves):
        total = np.bincount(index, weights * np.tile(sphere.weights[nodes, kind, w], len(corners)), len(counts) * size.prod())
        out[w, :, kind] = total.reshape(len(counts), -1)
    return Travel(height, directions, heights, elevations, out.reshape(waves, len(counts), -1))


def first_order(air: Coefficients, operators: Operators, sun: float) -> Array:
    """Integrate light scattered once, by air or ground: (H, D, A, W) radiance for a sun at an elevation, radians."""
    sphere, azimuth = operators.sphere, table_azimuths()
    turned = phases(cosines_to_sun(sphere, sun, azimuth), air.anisotropy)  # (H, D, A, 2)
    turned /= np.einsum("hdak,hd,a->hk", turned, sphere.solid, azimuth_weights())[:, None, None, :]  # sampled, they give off all they take
    sunlit = scattered_sunlight(sphere, sun, azimuth[::2])  # which is smoother than phase functions are: cosines go through it
    fewer = len(azimuth) // 2 + 1
    waves = np.cos(np.outer(np.arange(fewer), azimuth))
    between = np.linalg.solve(waves[:, ::2], waves).T.astype(Single)
    sunlit = np.maximum(between @ sunlit.reshape(*sunlit.shape[:3], -1), 0).reshape(*turned.shape, -1)
    by_air = np.einsum("hdakw,hdak->hdaw", sunlit, turned.astype(Single))
    return np.asarray(by_air + sunlit_ground(air, sphere, sun, azimuth).astype(Single))


def solve_orders(air: Coefficients, operators: Operators, sun: float) -> Array:
    """Sum all orders from the second: (2, H, E, A, W) float32, what Rayleigh's phase and the aerosol's turn into each direction, 1/sr.

    A metre of air scatters sR times the first and sM times the second. sun: its elevation, radians.
    """
    once = first_order(air, operators, sun)
    heights, directions, modes, count = once.shape
    light = to_cosines().astype(Single) @ once.swapaxes(1, 2).reshape(heights, modes, -1)
    light = light.reshape(heights, modes, directions, count).swapaxes(0, 1)  # (M, H, D, W), by cosines of the azimuth
    falling = (operators.sphere.solid[0] * np.maximum(np.sin(operators.sphere.elevation[0]), 0)).astype(Single)
    total = np.zeros((2, modes, heights, ELEVATIONS, count), Single)
    amount = np.zeros(count)
    for _ in range(MOST_ORDERS):
        turned = np.matmul(operators.scatter[:, :modes], light)  # (2, M, H, E, W)
        total[:, :modes] += turned
        by_mode, whole = np.abs(turned).sum(axis=(2, 3)), total[:, 0].sum(axis=(1, 2))
        before, amount = amount, by_mode[:, 0].sum(axis=0, dtype=float)
        if (amount <= ENOUGH * whole.sum(axis=0)).all():
            break
        modes = int(np.nonzero((by_mode >= FAINT * whole[:, None]).any(axis=(0, 2)))[0][-1]) + 1
        irradiance = falling @ light[0, 0]  # (W,): of the ground
        light = np.empty((modes, heights, directions, count), Single)
        for part in operators.travel:
            source = turned[:, :modes, part.heights, part.elevations].transpose(4, 0, 2, 3, 1).reshape(count, -1, modes)
            light[:, part.height, part.directions] = np.matmul(part.matrix, source).transpose(2, 1, 0)
        light[0] += operators.bounce * irradiance
    ratio = np.minimum(np.where(before > 0, amount / np.where(before > 0, before, 1), 0), 0.999)
    total[:, : turned.shape[1]] += turned * (ratio / (1 - ratio)).astype(Single)
    own = total[:, :, operators.own].swapaxes(1, 2).reshape(2, HEIGHTS, AZIMUTHS, -1)
    return (from_cosines().astype(Single) @ own).reshape(2, HEIGHTS, AZIMUTHS, ELEVATIONS, count).swapaxes(2, 3)
