"""Measures how bright daylight is in a picture."""

import math
from typing import Any

import numpy as np

from airlight.daylight.atmosphere import Atmosphere
from airlight.luminance import REC709

EXACT = 0.6  # of what is left to white: light that is added is shown as it is up to there
MOST_IRRADIANCE = 1e9  # as of sun_strength: dense fog whose light is scattered once leaves nothing of the sun, nor a sky
LOWEST_METERED = 5.0  # degrees: a lower sun leaves a picture as bright as one of 5, so that dusk is dark


def irradiance_of_white(air: Atmosphere, sun_elevation: float, altitude: float, lowest: float = LOWEST_METERED) -> float:
    """Compute the sun's irradiance above the air with which white that faces the sun has a luminance of 1: pi / Y(Ts).

    Where haze leaves less of the sun than comes from the sky, it is white under the sky. lowest: degrees, as which a lower sun counts.
    """
    sun = max(sun_elevation, lowest)
    direct, sky = air.sun(sun, altitude) @ REC709, air.irradiance(sun, altitude)[1] @ REC709
    return float(math.pi / max(direct, sky, math.pi / MOST_IRRADIANCE))


def sky_strength(air: Atmosphere, own: Any, elevation: Any, azimuth: Any, sun_elevation: float, altitude: float) -> float:
    """Compute the irradiance above the air that a photograph's own sky stands for: the median of its luminances (N,) over the model's.

    elevation, azimuth from the sun: (N,) degrees.
    """
    model = air.sky(elevation, azimuth, sun_elevation, altitude) @ REC709
    return float(np.median(np.asarray(own) / np.maximum(model, 1e-12)))


def displayed(behind: Any, added: Any, weights: Any) -> Any:
    """Put light that is added (..., 3) on a picture (..., 3) that ends at white.

    Up to EXACT of what is left to white it is the sum; what is more approaches white without an edge. weights: as `within_white`.
    """
    total = behind + added
    own = np.clip(behind @ weights, 0, 1)
    room = np.maximum(1 - own, 1e-6)
    share = (added @ weights) / room
    bent = EXACT + (1 - EXACT) * -np.expm1(-np.maximum(share - EXACT, 0) / (1 - EXACT))
    wanted, grey = own + room * bent, total @ weights
    scale = np.where((share > EXACT) & (grey > wanted), wanted / np.maximum(grey, 1e-12), 1)
    return within_white(total * scale[..., None], weights)


def within_white(light: Any, weights: Any) -> Any:
    """Bring light (..., 3) within 0..1 by its own grey, so that it keeps its luminance where that is below 1, and else is white.

    What is brighter than white in red and green alone would be yellow, cut off by channels; film and eyes see it pale. weights: (3,) of the
    luminance.
    """
    grey = np.clip(light @ weights, 0, 1)[..., None]
    apart = light - grey
    most, least = apart.max(axis=-1, keepdims=True), apart.min(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        up, down = np.where(most > 1 - grey, (1 - grey) / most, 1), np.where(least < -grey, -grey / least, 1)
    beyond = ((light < 0) | (light > 1)).any(axis=-1, keepdims=True)
    return np.where(beyond, np.clip(grey + apart * np.minimum(up, down), 0, 1), light)
