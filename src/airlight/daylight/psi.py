"""Solves the isotropic approximation of all further orders: psi, mean radiance of light scattered more than once (Hillaire 2020)."""

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.sphere import Sphere, make_sphere, scattered_sunlight, sunlit_ground
from airlight.reference.daylight import TOP_HEIGHT, Array

HEIGHTS, HALF, AZIMUTHS = 24, 16, 9
COUNT = 6  # nodes of half a piece of a ray


def psi_heights() -> Array:
    """Give the heights (H,), m, at which psi is solved."""
    return np.asarray(TOP_HEIGHT * np.linspace(0, 1, HEIGHTS) ** 3)


def psi_sphere(air: Coefficients) -> Sphere:
    """Place the rays by which psi is integrated."""
    return make_sphere(air, psi_heights(), HALF, COUNT)


def solve_psi(air: Coefficients, sphere: Sphere, sun: float) -> Array:
    """Integrate (H, W) psi, 1/sr, for a sun at an elevation, radians: L2 / (1 - f), Hillaire 2020, equations 5 to 10.

    L2: mean over directions of light scattered once, as if evenly, or by the ground; f: the part of an even light that is scattered again.
    """
    azimuth, share = np.linspace(0, np.pi, AZIMUTHS), sphere.solid[..., None] / (4 * np.pi)
    mean = np.full(AZIMUTHS, 1 / (AZIMUTHS - 1))
    mean[[0, -1]] /= 2
    by_air = scattered_sunlight(sphere, sun, azimuth).sum(axis=-2) / (4 * np.pi)
    once = np.einsum("hdaw,a->hdw", by_air + sunlit_ground(air, sphere, sun, azimuth), mean)
    again = np.add.reduceat(sphere.weights.sum(axis=1), sphere.first[:-1], axis=0).reshape(*share.shape[:-1], -1)
    return np.asarray((share * once).sum(axis=1) / (1 - (share * again).sum(axis=1)))
