"""Evaluates the light that a medium scatters, in float64: twins of medium/*.wgsl, and the integrand of a march."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import PHASES, ResolvedMedium

Array = npt.NDArray[np.floating[Any]]


class Layer(NamedTuple):
    """Holds what a medium does to a picture: (H, W, 3) in-scattered radiance and transmittance, 0..1, and (H, W) metres of rays in it."""

    radiance: Array
    transmittance: Array
    path_length: Array


def henyey_greenstein(apart: Any, g: Any) -> Array:
    """Evaluates the Henyey-Greenstein phase function, 1/sr, of apart (..., 2) = (1 - cosine, 1 + cosine). Henyey and Greenstein 1941."""
    apart = np.asarray(apart, float)
    squared = (1 - np.abs(g)) ** 2 + 2 * np.abs(g) * np.where(np.asarray(g) < 0, apart[..., 1], apart[..., 0])
    return np.asarray((1 - np.square(g)) / (4 * np.pi * squared**1.5))


def phase_apart(apart: Any, lobes: Any, kind: int) -> Array:
    """Evaluates a phase function, 1/sr, of apart (..., 2) = (1 - cosine, 1 + cosine); each integrates to 1 over the sphere.

    lobes: (..., 3) g, g of the second lobe, its share; kind: index of resolve.PHASES. Henyey and Greenstein 1941, Cornette and Shanks 1992.
    """
    apart, lobes = np.asarray(apart, float), np.asarray(lobes, float)
    cosine, g, back, share = (apart[..., 1] - apart[..., 0]) / 2, lobes[..., 0], lobes[..., 1], lobes[..., 2]
    name = PHASES[kind]
    if name == "isotropic":
        return np.full_like(cosine, 1 / (4 * np.pi))
    if name == "rayleigh":
        return np.asarray(3 / (16 * np.pi) * (1 + cosine**2))
    first = henyey_greenstein(apart, g)
    if name == "cornette-shanks":
        return np.asarray(first * 1.5 * (1 + cosine**2) / (2 + g * g))
    return first if name == "henyey-greenstein" else np.asarray((1 - share) * first + share * henyey_greenstein(apart, back))


def phase(cosine: Any, lobes: Any, kind: int) -> Array:
    """Evaluates a phase function, 1/sr, of the cosine, which is 1 where one looks into the light. lobes, kind: see `phase_apart`."""
    cosine = np.asarray(cosine, float)
    return phase_apart(np.stack([1 - cosine, 1 + cosine], axis=-1), lobes, kind)


def phase_between(a: Any, b: Any, lobes: Any, kind: int) -> Array:
    """Evaluates a phase function, 1/sr, between unit vectors (..., 3), towards the point and the light. lobes, kind: see `phase_apart`."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return phase_apart(np.stack([((a - b) ** 2).sum(axis=-1), ((a + b) ** 2).sum(axis=-1)], axis=-1) / 2, lobes, kind)


def glow_between(a: Any, b: Any, kappa: Any) -> Array:
    """Evaluates the lobe of a glow around a light, 1/sr, between unit vectors (..., 3): e^(-kappa (1 - cosine)), normalised over the
    sphere. Fisher 1953."""
    squared = ((np.asarray(a, float) - np.asarray(b, float)) ** 2).sum(axis=-1)
    return np.asarray(kappa * np.exp(-kappa * squared / 2) / (2 * np.pi * -np.expm1(-2 * np.asarray(kappa, float))))


def in_scattered(light: PunctualLight, medium: ResolvedMedium, direction: Array, points: Array, t: Array) -> Array:
    """Evaluates (..., 3) radiance that a metre of rays scatters to the eye from points (..., 3), t (...) metres away along unit
    directions."""
    kind, *lobes = medium.lobes(light.anisotropy)
    medium, glow = light.own_medium(medium), medium.settings.sun_glow if light.directional else 0.0
    to_light, path_length, irradiance = light.incident(points)
    there = (1 - glow) * phase((to_light * direction).sum(axis=-1), lobes, kind)
    there = (there + glow * glow_between(to_light, direction, medium.glow_concentration)) * irradiance
    power = medium.sigma_s * light.strength * np.array(light.intensity)
    return np.asarray(power * there[..., None] * light.colour(points) * transmittance(t + path_length, medium.sigma_t))


def transmittance(t: Any, sigma_t: Any) -> Array:
    """Evaluates (..., 3) e^(-sigma_t t) (Beer-Lambert) over paths t (...), m, in a medium of sigma_t (3,), 1/m."""
    return np.asarray(np.exp(-np.asarray(t, float)[..., None] * np.asarray(sigma_t, float)))


def mean_transmittance(x: Any) -> Array:
    """Evaluates (1 - e^-x) / x, the mean transmittance up to an optical depth x."""
    x = np.asarray(x, float)
    return np.asarray(np.where(x > 0, -np.expm1(-x) / np.where(x > 0, x, 1), 1.0))


def transmittance_integral(t: Any, sigma_t: Any) -> Array:
    """Integrates the transmittance along paths of length t (...), m: (..., 3) m, in a medium of sigma_t (3,), 1/m."""
    t = np.asarray(t, float)[..., None]
    return np.asarray(t * mean_transmittance(np.asarray(sigma_t, float) * t))
