"""Keyframes between their times (glTF 2.0, appendix C), in NumPy, and the matrices that come of them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


def unit(quaternion: np.ndarray) -> np.ndarray:
    """(4,) x, y, z, w of length 1; no turn where there is none to take."""
    length = float(np.linalg.norm(quaternion))
    return quaternion / length if length > 1e-9 else np.array([0.0, 0.0, 0.0, 1.0])


def slerp(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    """From one unit quaternion to another, the short way round."""
    dot = float(a @ b)
    if dot < 0:
        b, dot = -b, -dot
    if dot > 0.9995:
        return unit(a + (b - a) * share)
    angle = np.arccos(dot)
    return unit((np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle))


@dataclass(frozen=True)
class Track:
    """What moves one property of one node.

    times: (K,) seconds, growing. values: (K, n), or (K, 3, n) for CUBICSPLINE: tangent in, value, tangent out.
    """

    node: int
    path: Literal["translation", "rotation", "scale", "weights"]
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"]
    times: np.ndarray
    values: np.ndarray

    def at(self, t: float) -> np.ndarray:
        """(n,) the value at t seconds; before the first and after the last time that of the nearest."""
        last = len(self.times) - 1
        i = int(np.searchsorted(self.times, t, "right")) - 1
        values = self.values[:, 1] if self.interpolation == "CUBICSPLINE" else self.values
        if i < 0 or i >= last or self.interpolation == "STEP":
            found = values[min(max(i, 0), last)]
            return unit(found) if self.path == "rotation" else found
        step = float(self.times[i + 1] - self.times[i])
        share = (t - float(self.times[i])) / step
        if self.interpolation == "LINEAR":
            if self.path == "rotation":
                return slerp(unit(values[i]), unit(values[i + 1]), share)
            return values[i] + (values[i + 1] - values[i]) * share
        square, cube = share**2, share**3
        found = (
            (2 * cube - 3 * square + 1) * values[i]
            + step * (cube - 2 * square + share) * self.values[i, 2]
            + (-2 * cube + 3 * square) * values[i + 1]
            + step * (cube - square) * self.values[i + 1, 0]
        )
        return unit(found) if self.path == "rotation" else found


def compose(translation: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(4, 4) from a translation, a unit quaternion and a scale."""
    x, y, z, w = rotation
    out = np.eye(4)
    out[:3, :3] = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ) * np.asarray(scale)
    out[:3, 3] = translation
    return out
