"""Light that a medium scatters: float64 twins of scatter/march/scene.wgsl and ray.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lamps import Lamp
from airlight.medium import Settled

Array = npt.NDArray[np.floating[Any]]


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
