"""Judges numbers that a light is given, and scales vectors, whatever their size."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt


def is_finite(value: Any) -> bool:
    """Tell whether this is a number that a float holds; a boolean and a text are none."""
    if isinstance(value, bool | np.bool_ | str | bytes):
        return False
    try:
        return math.isfinite(value)
    except (TypeError, ValueError, OverflowError):  # the last of an integer beyond all floats
        return False


def are_finite(values: Any, count: int) -> bool:
    """Tell whether these are so many numbers that floats hold."""
    try:
        return len(values) == count and all(is_finite(v) for v in values)
    except TypeError:
        return False


def unit(v: Any) -> npt.NDArray[np.float64]:
    """Normalise a vector (3,), however long or short; one of length 0 stays."""
    found = np.array([float(x) for x in v])
    most = float(np.abs(found).max())
    if not 0 < most < math.inf:
        return found
    found = found / most  # by which squares neither overflow nor vanish
    return found / np.linalg.norm(found)


def unit_plane(plane: Any) -> tuple[float, float, float, float]:
    """Normalise a plane (a, b, c, d), so that d is its distance from the origin; infinite where it is too far away for a float."""
    a, b, c, d = (float(v) for v in plane)
    most = max(abs(a), abs(b), abs(c))
    a, b, c, d = a / most, b / most, c / most, d / most
    size = math.hypot(a, b, c)
    return a / size, b / size, c / size, d / size
