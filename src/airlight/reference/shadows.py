"""Evaluates the functions of pygfx/shadow_kernel.wgsl in float64, each under its shader's name. Arrays broadcast; vectors lie along the
last axis.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]
KERNEL_RADIUS = 2.0  # texels
BEHIND = 0.25  # texels behind the plane, and four times the bias more, begins what tells nothing of the surface


def kernel_weight(x: Any) -> Array:
    """Evaluates the kernel's weight, 0..1, so many texels from its middle."""
    return np.asarray(np.maximum(1 - np.square(np.asarray(x, float) / KERNEL_RADIUS), 0) ** 2)


def cube_face(direction: Any) -> npt.NDArray[np.int64]:
    """Numbers the faces of a cube, +X, -X, +Y, -Y, +Z, -Z, that directions (..., 3) from its middle meet."""
    direction = np.asarray(direction, float)
    axis = np.abs(direction).argmax(axis=-1)
    return np.asarray(2 * axis + (np.take_along_axis(direction, axis[..., None], axis=-1)[..., 0] <= 0))


def map_derivative(at: Any, step: Any) -> Array:
    """Differentiates (..., 3) x, y and depth in a map with respect to a step; place and step (..., 4) are homogeneous."""
    at, step = np.asarray(at, float), np.asarray(step, float)
    return np.asarray((step[..., :3] - at[..., :3] / at[..., 3:] * step[..., 3:]) / at[..., 3:])


def depth_slope(u: Any, v: Any, area: Any) -> Array:
    """Finds (..., 2) the slope of depth over x and y from their derivatives (..., 3) along two steps; area: the least that these are taken
    to span."""
    u, v = np.asarray(u, float), np.asarray(v, float)
    spanned = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    divisor = np.where(spanned >= 0, np.maximum(spanned, area), np.minimum(spanned, -np.asarray(area, float)))
    over = [u[..., 2] * v[..., 1] - v[..., 2] * u[..., 1], v[..., 2] * u[..., 0] - u[..., 2] * v[..., 0]]
    return np.asarray(np.stack(over, axis=-1) / divisor[..., None])


def weigh_texels(weight: Any, above: Any, bias: Any, casts: Any) -> Array:
    """Sums the weights of the texels (..., N) of a kernel: (..., 2), of what is lit, and of what tells of the surface. above: texels that
    they stand off its plane towards the light; bias: texels; casts: (...) bool, whether the surface is in the map."""
    behind = (above < -BEHIND - 4 * np.asarray(bias, float)) & np.asarray(casts)[..., None]
    told = np.where(behind, 0, np.asarray(weight, float))
    return np.stack([np.where(above > bias, 0, told).sum(axis=-1), told.sum(axis=-1)], axis=-1)
