"""Light that a medium scatters: float64 twins of scatter/march/scene.wgsl, ray.wgsl and upsample.wgsl."""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.lamps import Lamp
from airlight.medium import Settled

Array = npt.NDArray[np.floating[Any]]


class Layer(NamedTuple):
    """What a medium does to a picture: (H, W, 3) in-scattered radiance, (H, W, 3) transmittance 0..1, (H, W) metres of each ray in it."""

    radiance: Array
    transmittance: Array
    path_length: Array


def henyey_greenstein(cosine: Any, g: float) -> Array:
    """1/sr; Henyey and Greenstein 1941."""
    return np.asarray((1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * np.asarray(cosine, float)) ** 1.5))


def phase(cosine: Any, kind: int, g: float, back: float, share: float) -> Array:
    """1/sr, of the cosine (1 where one looks into the light) and Settled.lobes; each integrates to 1 over the sphere.
    Henyey and Greenstein 1941, Cornette and Shanks 1992."""
    cosine = np.asarray(cosine, float)
    if kind == 2:
        return np.full_like(cosine, 1 / (4 * np.pi))
    if kind == 3:
        return np.asarray(3 / (16 * np.pi) * (1 + cosine**2))
    if kind == 4:
        return np.asarray(henyey_greenstein(cosine, g) * 1.5 * (1 + cosine**2) / (2 + g * g))
    first = henyey_greenstein(cosine, g)
    return first if kind == 0 else np.asarray((1 - share) * first + share * henyey_greenstein(cosine, back))


def scattered(lamp: Lamp, air: Settled, direction: Array, points: Array, t: Array) -> Array:
    """(..., 3) radiance that a metre of rays scatters to the eye from points (..., 3), t (...) metres away along unit directions."""
    kind, g, back, share = air.lobes(lamp)
    strength = lamp.strength * np.array(lamp.intensity)
    if lamp.is_sun:
        there = phase(direction @ np.array(lamp.direction), kind, g, back, share)
        return np.asarray(air.sigma_s * strength * there[..., None] * np.exp(-air.sigma_t * t[..., None]))
    away = points - np.array(lamp.position)
    d = np.linalg.norm(away, axis=-1)
    there = phase(-(away * direction).sum(axis=-1) / d, kind, g, back, share)
    scale, offset = lamp.cone()
    there = there * np.clip(away @ np.array(lamp.direction) / d * scale + offset, 0, 1) ** 2
    if lamp.range:
        there = there * np.maximum(1 - (d / lamp.range) ** 4, 0)
    return np.asarray(air.sigma_s * strength * (there / d**2)[..., None] * np.exp(-air.sigma_t * (t + d)[..., None]))


def taken_at(size: int, pixels: int) -> npt.NDArray[np.int64]:
    """The pixels, of so many along a side, at whose centres a march of a smaller size is computed."""
    return np.minimum((2 * np.arange(size) + 1) * pixels // (2 * size), pixels - 1)


def transmittance(t: Any, sigma_t: Any) -> Array:
    """(..., 3) e^(-sigma_t t) (Beer-Lambert) over paths t (...), m, in a medium of sigma_t (3,), 1/m."""
    return np.asarray(np.exp(-np.asarray(t, float)[..., None] * np.asarray(sigma_t, float)))


def until(t: Any, sigma_t: Any) -> Array:
    """(..., 3) m: the integral of the transmittance over ways (...) in a medium of sigma_t (3,), 1/m."""
    t, sigma_t = np.asarray(t, float)[..., None], np.asarray(sigma_t, float)
    return np.asarray(np.where(sigma_t > 0, -np.expm1(-sigma_t * t) / np.where(sigma_t > 0, sigma_t, 1), t))


def upsampled(marched: Array, ways: Array, sigma_t: Any) -> Array:
    """(H, W, 3) radiance of rays that are ways (H, W) long, m, from a march (h, w, 4) at a smaller size: radiance and ways.

    Neighbours count by their nearness and by the likeness of their ways (Kopf et al. 2007, Joint Bilateral Upsampling). Where none is
    like it, the nearest on a spiral is taken whose way is.
    """
    marched = np.asarray(marched, float)
    sizes = marched.shape[:2]
    at = []
    for size, pixels in zip(sizes, ways.shape, strict=True):
        ratio, middle = pixels / size, size // 2
        shift = taken_at(size, pixels)[middle] + 0.5 - (middle + 0.5) * ratio
        at.append((np.arange(pixels) + 0.5 - shift) / ratio - 0.5)

    def held(y: Any, x: Any, reach: Any) -> tuple[Array, Array]:
        texel = marched[np.clip(y, 0, sizes[0] - 1), np.clip(x, 0, sizes[1] - 1)]
        return texel, np.abs(texel[..., 3] - reach) / np.maximum(np.minimum(texel[..., 3], reach), 1e-6)

    y, x = np.meshgrid(*at, indexing="ij")
    sums, weights = np.zeros((*ways.shape, 3)), np.zeros((*ways.shape, 1))
    likest, least = np.zeros((*ways.shape, 4)), np.full(ways.shape, np.inf)
    for row, column in np.ndindex(4, 4):
        i, j = np.floor(y).astype(int) - 1 + row, np.floor(x).astype(int) - 1 + column
        texel, off = held(i, j, ways)
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
            texel, found = held(math.floor(row), math.floor(column), ways[p])
            if found < off:
                best, off = texel, found
            if off <= 0.2:
                break
        out[p] = best[:3] * np.minimum(until(ways[p], sigma_t) / np.maximum(until(best[3], sigma_t), 1e-20), 1)
    return np.asarray(out)
