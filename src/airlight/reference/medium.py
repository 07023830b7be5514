"""Light that a medium scatters, in float64: twins of medium/*.wgsl and scatter/march/*.wgsl."""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import PHASES, ResolvedMedium

Array = npt.NDArray[np.floating[Any]]


class Layer(NamedTuple):
    """What a medium does to a picture: (H, W, 3) in-scattered radiance, (H, W, 3) transmittance 0..1, (H, W) metres of each ray in it."""

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


def in_scattered(light: PunctualLight, medium: ResolvedMedium, direction: Array, points: Array, t: Array) -> Array:
    """Evaluates (..., 3) radiance that a metre of rays scatters to the eye from points (..., 3), t (...) metres away along unit
    directions."""
    kind, *lobes = medium.lobes(light.anisotropy)
    to_light, path_length, irradiance = light.incident(points)
    there = phase((to_light * direction).sum(axis=-1), lobes, kind) * irradiance
    power = medium.sigma_s * light.strength * np.array(light.intensity)
    return np.asarray(power * there[..., None] * transmittance(t + path_length, medium.sigma_t))


def sampled_pixel(size: int, pixels: int) -> npt.NDArray[np.int64]:
    """Finds the pixels, of so many along a side, at whose centres a march of a smaller size is sampled."""
    return np.minimum((2 * np.arange(size) + 1) * pixels // (2 * size), pixels - 1)


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


def relative_difference(a: Any, b: Any) -> Array:
    """Computes the difference of two lengths, relative to the shorter one."""
    return np.asarray(np.abs(a - b) / np.maximum(np.minimum(a, b), 1e-6))


def upsampled(marched: Array, lengths: Array, sigma_t: Any) -> Array:
    """Upsamples to (H, W, 3) radiance, of rays of lengths (H, W), m, a march (h, w, 4) at a smaller size: radiance and lengths.

    Neighbours are weighted by their nearness and by the likeness of their lengths (Kopf et al. 2007, Joint Bilateral Upsampling). Where
    none is alike, the nearest on a spiral that is, is taken.
    """
    marched = np.asarray(marched, float)
    sizes = marched.shape[:2]
    at = []
    for size, pixels in zip(sizes, lengths.shape, strict=True):
        ratio, middle = pixels / size, size // 2
        shift = sampled_pixel(size, pixels)[middle] + 0.5 - (middle + 0.5) * ratio
        at.append((np.arange(pixels) + 0.5 - shift) / ratio - 0.5)

    def held(y: Any, x: Any, reach: Any) -> tuple[Array, Array]:
        texel = marched[np.clip(y, 0, sizes[0] - 1), np.clip(x, 0, sizes[1] - 1)]
        return texel, relative_difference(texel[..., 3], reach)

    y, x = np.meshgrid(*at, indexing="ij")
    sums, weights = np.zeros((*lengths.shape, 3)), np.zeros((*lengths.shape, 1))
    likest, least = np.zeros((*lengths.shape, 4)), np.full(lengths.shape, np.inf)
    for row, column in np.ndindex(4, 4):
        i, j = np.floor(y).astype(int) - 1 + row, np.floor(x).astype(int) - 1 + column
        texel, off = held(i, j, lengths)
        near = np.maximum(2 - np.abs(i - y), 0) * np.maximum(2 - np.abs(j - x), 0)
        weight = (near * np.exp(-24 * off) + 1e-20)[..., None]
        sums, weights = sums + weight * texel[..., :3], weights + weight
        better = (off < least) & (near > 1e-3)
        likest, least = np.where(better[..., None], texel, likest), np.where(better, off, least)
    out = sums / weights
    for p in zip(*np.nonzero(least > 0.2), strict=True):
        best, off = likest[p], least[p]
        for k in range(64):
            angle, radius = 2.3999632 * k, np.sqrt(k + 4)
            row, column = y[p] + 0.5 + radius * np.sin(angle), x[p] + 0.5 + radius * np.cos(angle)
            texel, found = held(math.floor(row), math.floor(column), lengths[p])
            if found < off:
                best, off = texel, found
            if off <= 0.2:
                break
        own, its = (transmittance_integral(length, sigma_t) for length in (lengths[p], best[3]))
        out[p] = best[:3] * np.minimum(own / np.maximum(its, 1e-20), 1)
    return np.asarray(out)
