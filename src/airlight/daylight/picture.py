"""Measures how bright daylight is in a picture."""

import math
from typing import Any

import numpy as np

from airlight.daylight.atmosphere import Atmosphere
from airlight.luminance import REC709

LOWEST_METERED = 5.0  # degrees: a lower sun leaves a picture as bright as one of 5, so that dusk is dark


def irradiance_of_white(air: Atmosphere, sun_elevation: float, altitude: float) -> float:
    """Compute the sun's irradiance above the air with which white that faces the sun has a luminance of 1: pi / Y(Ts)."""
    return float(math.pi / (air.sun(max(sun_elevation, LOWEST_METERED), altitude) @ REC709))


def sky_strength(air: Atmosphere, own: Any, elevation: Any, azimuth: Any, sun_elevation: float, altitude: float) -> float:
    """Compute the irradiance above the air that a photograph's own sky stands for: the median of its luminances (N,) over the model's.

    elevation, azimuth from the sun: (N,) degrees.
    """
    model = air.sky(elevation, azimuth, sun_elevation, altitude) @ REC709
    return float(np.median(np.asarray(own) / np.maximum(model, 1e-12)))
