"""Puts daylight on a picture: what is left of its own light, and what the air adds, on land and in the sky."""

import math
from typing import Any, NamedTuple

import numpy as np

from airlight.daylight.atmosphere import Atmosphere
from airlight.daylight.camera import Camera, direction_of
from airlight.reference.daylight import Array

KEEP, ADD, REPLACE = "keep", "air", "replace"  # of the sky
LOWEST_METERED = 5.0  # degrees: a lower sun leaves a picture as bright as one of 5
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
DISC = math.radians(0.2678)  # half the sun's angle
DISC_RADIANCE = 1 / (math.pi * math.sin(DISC) ** 2)  # of an irradiance of 1


class Daylit(NamedTuple):
    """Holds what rays (..., 3) gather for the sun's irradiance: L = L0 transmittance + (1 - D) single + multiple."""

    transmittance: Array
    single: Array
    multiple: Array


class Placed(NamedTuple):
    """Says what becomes of a picture L0 (..., 3): L0 through + added."""

    through: Array
    added: Array


def irradiance_of_white(air: Atmosphere, sun_elevation: float, altitude: float) -> float:
    """Compute the sun's irradiance above the air with which white that faces the sun has a luminance of 1.

    The elevation is taken as 5 degrees at least, so that dusk is darker than day.
    """
    left = air.sun(max(sun_elevation, LOWEST_METERED), altitude)
    return float(math.pi / (left @ LUMINANCE))


def place(light: Daylit, dark: Any, sky: Any, kind: str, attenuate: str, disc: Any = 0.0) -> Placed:
    """Place daylight on a picture.

    dark: D (..., 1), 0..1; sky: share (..., 1) of a pixel that is sky; kind: keep, air or replace, of that share. attenuate: "source", the
    sun's light scattered once is what shadows take; "all", Eq. 2 of GPU Gems 3, ch. 13, as printed. disc: radiance of the sun itself, for
    replace. Where D is 0, it is the air alone.
    """
    lit = 1 - dark
    if attenuate == "all":
        added, through = lit * (light.single + light.multiple), lit * light.transmittance
    else:
        added, through = lit * light.single + light.multiple, light.transmittance
    if kind == KEEP:
        whole = light.single + light.multiple
        kept = lit if attenuate == "all" else 1 - dark * np.clip(light.single / np.where(whole > 0, whole, 1), 0, 1) * (whole > 0)
        in_sky = Placed(np.broadcast_to(kept, light.transmittance.shape), np.zeros_like(added))
    elif kind == ADD:
        in_sky = Placed(through, added)
    else:
        in_sky = Placed(np.zeros_like(through), added + lit * disc)
    return Placed(through * (1 - sky) + in_sky.through * sky, added * (1 - sky) + in_sky.added * sky)


def disc_radiance(air: Atmosphere, camera: Camera, rays: Array, sun_azimuth: float, sun_elevation: float, altitude: float) -> Array:
    """Evaluate (..., 3) the radiance of the sun's disc, of an irradiance of 1, smoothed over a pixel. rays: (..., 3) directions."""
    towards = direction_of(sun_azimuth, sun_elevation)
    apart = np.linalg.norm(rays - towards, axis=-1)
    pixel = 1 / camera.focal
    cover = np.clip((DISC - apart) / pixel + 0.5, 0, 1) * min(1.0, (2 * DISC / pixel) ** 2)
    return np.asarray(cover[..., None] * DISC_RADIANCE * air.sun(sun_elevation, altitude, disc=True))


def gather_slowly(air: Atmosphere, rays: Array, metres: Array, sun_azimuth: float, sun_elevation: float, altitude: float) -> Daylit:
    """Gather daylight along rays (..., 3) up to metres (...), in float64: the truth, at some 10,000 rays a second."""
    elevation = np.degrees(np.arcsin(np.clip(rays[..., 1], -1, 1)))
    azimuth = np.degrees(np.arctan2(rays[..., 0], rays[..., 2])) - sun_azimuth
    parts = air.parts(elevation, azimuth, sun_elevation, altitude, metres)
    return Daylit(parts.transmittance, parts.single, parts.multiple)


def gather_printed(
    rays: Array, metres: Array, sun_azimuth: float, sun_elevation: float, beta_rayleigh: Any, beta_mie: Any, g: float
) -> Daylit:
    """Gather daylight in even air by Eq. 1 of GPU Gems 3, ch. 13, as Hoffman and Preetham 2002 have it. Arguments as `gather_slowly`."""
    from airlight.daylight.hoffman_preetham import LONGEST, hoffman_preetham

    length = np.minimum(metres, LONGEST)
    theta = np.degrees(np.arccos(np.clip(rays @ direction_of(sun_azimuth, sun_elevation), -1, 1)))
    single = hoffman_preetham(0.0, 1.0, beta_rayleigh, beta_mie, g, length, theta)
    left = np.exp(-(np.asarray(beta_rayleigh) + np.asarray(beta_mie)) * length[..., None])
    return Daylit(left, single, np.zeros_like(single))
