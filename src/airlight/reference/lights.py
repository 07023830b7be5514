"""Attenuation of punctual lights (glTF, KHR_lights_punctual) in float64: twins of lights/irradiance.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]


def cone_ramp(cosine: Any, scale: Any, offset: Any) -> Array:
    """Evaluates the root of a spot's angular falloff, 0..1, from the cosine to its axis and `PunctualLight.cone`."""
    return np.asarray(np.clip(np.asarray(cosine, float) * scale + offset, 0, 1))


def range_window(d: Any, range: Any) -> Array:
    """Evaluates the attenuation by a light's range, 0..1, at distances d from it, metres; range 0: none."""
    d, range = np.broadcast_arrays(np.asarray(d, float), np.asarray(range, float))
    return np.where(range > 0, np.maximum(1 - (d / np.where(range > 0, range, 1)) ** 4, 0), 1.0)
