"""Interpolate keyframes (glTF 2.0, appendix C), in NumPy, and compose the matrices that come of them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


def unit(quaternion: np.ndarray) -> np.ndarray:
    """Normalise (..., 4) x, y, z, w; no turn where there is none to take."""
    length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return np.where(length > 1e-9, quaternion / np.maximum(length, 1e-9), np.array([0.0, 0.0, 0.0, 1.0]))


def slerp(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    """Interpolate from one unit quaternion to another, the short way round."""
    dot = float(a @ b)
    if dot < 0:
        b, dot = -b, -dot
    if dot > 0.9995:
        return unit(a + (b - a) * share)
    angle = np.arccos(dot)
    return unit((np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle))


@dataclass(frozen=True)
class Track:
    """Moves one property of one node.

    times: (K,) float32 seconds, growing. values: float32 (K, n), or (K, 3, n) for CUBICSPLINE: tangent in, value, tangent out.
    """

    node: int
    path: Literal["translation", "rotation", "scale", "weights"]
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"]
    times: np.ndarray
    values: np.ndarray

    def at(self, t: float) -> np.ndarray:
        """Interpolate the value at t seconds, (n,) float64; before the first and after the last time that of the nearest."""
        last = len(self.times) - 1
        i = int(np.searchsorted(self.times, t, "right")) - 1
        if i < 0 or i >= last or self.interpolation == "STEP":
            return self._finished(self._value(min(max(i, 0), last)))
        before, after = self._value(i), self._value(i + 1)
        step = float(self.times[i + 1]) - float(self.times[i])
        share = min(max((t - float(self.times[i])) / step, 0.0), 1.0)
        if self.interpolation == "LINEAR":
            return slerp(unit(before), unit(after), share) if self.path == "rotation" else before + (after - before) * share
        square, cube = share**2, share**3
        return self._finished(
            (2 * cube - 3 * square + 1) * before
            + step * (cube - 2 * square + share) * self.values[i, 2].astype(np.float64)
            + (-2 * cube + 3 * square) * after
            + step * (cube - square) * self.values[i + 1, 0].astype(np.float64)
        )

    def least(self) -> float:
        """Bound how small its numbers become, from below: 0 where they may change their sign."""
        if self.interpolation == "CUBICSPLINE":
            return 0.0 if (np.diff(self.values[:, 1], axis=0) != 0).any() else float(np.abs(self.values[:, 1]).min())
        passes = (self.values.min(axis=0) < 0) & (self.values.max(axis=0) > 0)
        return 0.0 if passes.any() else float(np.abs(self.values).min())

    def _value(self, i: int) -> np.ndarray:
        return (self.values[i, 1] if self.interpolation == "CUBICSPLINE" else self.values[i]).astype(np.float64)

    def _finished(self, value: np.ndarray) -> np.ndarray:
        return unit(value) if self.path == "rotation" else value


THIN = 1e-6  # least scale: what is flatter has no inverse, which normals need
LEAST = THIN**3  # least product of scales, from the root down: single floats hold its square


def thick(matrix: np.ndarray, least: float = THIN) -> np.ndarray:
    """Scale (..., 4, 4) up where a direction is scaled by less than `least`."""
    u, sizes, v = np.linalg.svd(matrix[..., :3, :3])
    matrix = matrix.copy()
    whole = (sizes[..., 2] >= least)[..., None, None]
    matrix[..., :3, :3] = np.where(whole, matrix[..., :3, :3], u * np.maximum(sizes, least)[..., None, :] @ v)
    return matrix


def compose(translation: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Compose (..., 4, 4) of translations, unit quaternions and scales."""
    x, y, z, w = np.moveaxis(rotation, -1, 0)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    out = np.zeros((*x.shape, 4, 4))
    out[..., :3, :3] = np.moveaxis(turn, (0, 1), (-2, -1)) * scale[..., None, :]
    out[..., :3, 3] = translation
    out[..., 3, 3] = 1
    return out
