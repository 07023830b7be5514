"""Solves the isotropic approximation of all further orders: psi, mean radiance of light scattered more than once (Hillaire 2020)."""

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import columns_table
from airlight.daylight.sphere import Sphere, make_sphere, sunlight
from airlight.reference.daylight import TOP_HEIGHT, Array

HEIGHTS, HALF, COUNT, AZIMUTHS = 24, 16, 8, 9


def psi_heights() -> Array:
    """Give the heights (H,), m, at which psi is solved."""
    return np.asarray(TOP_HEIGHT * np.linspace(0, 1, HEIGHTS) ** 3)


def psi_sphere(air: Coefficients) -> Sphere:
    """Place the rays by which psi is integrated."""
    return make_sphere(air, psi_heights(), HALF, COUNT)


def scattered(air: Coefficients, sphere: Sphere) -> Array:
    """Evaluate (H, D, N, W) what a node scatters, times transmittance to the eye and weight: sums to the part that an even light leaves."""
    return np.asarray(sphere.left * (sphere.nodes.density[..., :2] @ air.scattering))


def solve_psi(air: Coefficients, sphere: Sphere, sun: float) -> Array:
    """Integrate (H, W) psi, 1/sr, for a sun at an elevation, radians: L2 / (1 - f), Hillaire 2020, equations 5 to 10.

    L2: mean over directions of light scattered once, as if evenly, or by the ground; f: the part of an even light that is scattered once more.
    """
    weights, share = scattered(air, sphere), sphere.solid / (4 * np.pi)
    light, ground = sunlight(air, sphere, sun, np.linspace(0, np.pi, AZIMUTHS), columns_table())
    mean = np.full(AZIMUTHS, 1 / (AZIMUTHS - 1))
    mean[[0, -1]] /= 2
    by_air = np.einsum("hdanw,a,hdnw->hdw", light, mean, weights, optimize=True) / (4 * np.pi)
    by_ground = np.einsum("hdaw,a->hdw", ground, mean) * sphere.ground * air.ground_albedo / np.pi
    once = (share[..., None] * (by_air + by_ground)).sum(axis=1)
    again = (share[..., None] * weights.sum(axis=2)).sum(axis=1)
    return np.asarray(once / (1 - again))
