"""Traces light of second and higher orders through a round atmosphere backwards, by chance: an independent truth of what is solved.

One wavelength at a time, straight rays, collisions with a null collision's majorant, the sun met from each collision. Only the sun's
transmittance is the package's.
"""

import numpy as np

from airlight.daylight.coefficients import Coefficients
from airlight.daylight.columns import sun_transmittance
from airlight.reference.daylight import GROUND_RADIUS, TOP_RADIUS

MOST = 400  # collisions


def densities(height: np.ndarray) -> np.ndarray:
    ozone = np.maximum(1 - np.abs(height - 25e3) / 15e3, 0)
    return np.stack([np.exp(-height / 8000), np.exp(-height / 1200), ozone], axis=-1)


def phase(kind: np.ndarray, cosine: np.ndarray, g: float) -> np.ndarray:
    rayleigh = 3 / (16 * np.pi) * (1 + cosine**2)
    aerosol = 3 / (8 * np.pi) * (1 - g * g) * (1 + cosine**2) / ((2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5)
    return np.where(kind == 0, rayleigh, aerosol)


def turned(direction: np.ndarray, cosine: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Directions (N, 3) under a cosine to others."""
    helper = np.where(np.abs(direction[:, 2:]) < 0.9, [[0.0, 0, 1]], [[1.0, 0, 0]])
    across = np.cross(direction, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    third, sine = np.cross(direction, across), np.sqrt(np.maximum(1 - cosine**2, 0))
    return cosine[:, None] * direction + sine[:, None] * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * third)


def multiple(
    air: Coefficients, wavelength: int, view: float, azimuth: float, sun: float, altitude: float, paths: int, seed: int = 0,
    from_ground: bool = False,
) -> tuple[float, float]:  # fmt: skip
    """Radiance of second and higher orders of air (all light that is turned twice or more), and its standard error. Degrees, m.

    from_ground: count the light too that the ground sends straight to the eye.
    """
    random = np.random.default_rng(seed)
    view, azimuth, sun = np.radians([view, azimuth, sun])
    to_sun = np.array([np.cos(sun), 0, np.sin(sun)])
    position = np.tile([0, 0, GROUND_RADIUS + altitude], (paths, 1))
    direction = np.tile([np.cos(view) * np.cos(azimuth), np.cos(view) * np.sin(azimuth), np.sin(view)], (paths, 1))
    extinction, scattering = air.extinction[:, wavelength], air.scattering[:, wavelength]
    albedo, g, majorant = air.ground_albedo[wavelength], air.anisotropy, air.extinction[:, wavelength].sum()
    total, weight, turns = np.zeros(paths), np.ones(paths), np.zeros(paths, int)
    alive = np.arange(paths)
    one = air._replace(**{name: getattr(air, name)[wavelength : wavelength + 1] for name in ("rayleigh", "aerosol_extinction", "ozone")})

    def sunlight(where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        radius = np.linalg.norm(where, axis=1)
        cosine = where @ to_sun / radius
        return sun_transmittance(np.maximum(radius - GROUND_RADIUS, 0), cosine, one.extinction)[:, 0], cosine

    for _ in range(MOST * 20):
        if not len(alive):
            break
        x, d = position[alive], direction[alive]
        step = random.exponential(1 / majorant, len(alive))
        along, squared = (x * d).sum(axis=1), (x * x).sum(axis=1)
        under = along**2 - squared + GROUND_RADIUS**2
        ground = np.where((under > 0) & (along < 0), np.maximum(-along - np.sqrt(np.maximum(under, 0)), 0), np.inf)
        top = -along + np.sqrt(np.maximum(along**2 - squared + TOP_RADIUS**2, 0))
        grounded, gone = ground <= step, (top <= step) & (ground > step)
        x = x + np.where(grounded, ground, step)[:, None] * d
        keep = ~gone
        # the ground
        at = np.flatnonzero(grounded)
        if len(at):
            i = alive[at]
            light, cosine = sunlight(x[at])
            counts = (turns[i] > 0) | from_ground
            total[i] += counts * weight[i] * albedo / np.pi * np.maximum(cosine, 0) * light
            weight[i] *= albedo * counts
            turns[i] += 1
            up = x[at] / np.linalg.norm(x[at], axis=1, keepdims=True)
            x[at] = up * (GROUND_RADIUS + 1e-3)
            d[at] = turned(up, np.sqrt(random.random(len(at))), 2 * np.pi * random.random(len(at)))
            keep[at] &= weight[i] > 0
        # the air
        at = np.flatnonzero(~grounded & ~gone)
        there = densities(np.linalg.norm(x[at], axis=1) - GROUND_RADIUS)
        real = random.random(len(at)) * majorant < there @ extinction
        at, there = at[real], there[real]
        if len(at):
            i = alive[at]
            parts = there[:, :2] * scattering
            weight[i] *= parts.sum(axis=1) / (there @ extinction)
            kind = (random.random(len(at)) * parts.sum(axis=1) >= parts[:, 0]).astype(int)
            light, _ = sunlight(x[at])
            cosine = d[at] @ to_sun
            total[i] += (turns[i] > 0) * weight[i] * phase(kind, cosine, g) * light
            u = random.random(len(at))
            lobe = (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
            new = np.where(kind == 0, 2 * u - 1, lobe)
            weight[i] *= np.where(kind == 0, 0.75 * (1 + new**2), 1.5 * (1 + new**2) / (2 + g * g))
            d[at] = turned(d[at], new, 2 * np.pi * random.random(len(at)))
            turns[i] += 1
            live = np.where(turns[i] > 4, np.minimum(weight[i] * 2, 1), 1)  # Russian roulette
            dies = random.random(len(at)) >= live
            weight[i] = np.where(dies, 0, weight[i] / np.maximum(live, 1e-30))
            keep[at] &= ~dies
        position[alive], direction[alive] = x, d
        alive = alive[keep]
    return float(total.mean()), float(total.std() / np.sqrt(paths))
