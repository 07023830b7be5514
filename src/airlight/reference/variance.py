"""Evaluates the functions of scatter/march/variance.wgsl in float64, each under its shader's name, and the moments that they read."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]


def biased_receiver_depth(depth: Any, bias: Any, is_directional: bool) -> Array:
    """Moves depths of receivers towards the light by the bias."""
    depth = np.asarray(depth, float)
    return np.asarray(depth + bias if is_directional else depth / np.maximum(1 - bias * depth, 1e-6))


def mix_moments(a: Any, b: Any, part: Any) -> Array:
    """Mixes distributions, each a mean and a variance (..., 2), by a part of the second."""
    a, b, part = np.asarray(a, float), np.asarray(b, float), np.asarray(part, float)
    (first, square_a), (second, square_b) = ((one[..., 0], one[..., 0] ** 2 + one[..., 1]) for one in (a, b))
    mean, square = (1 - part) * first + part * second, (1 - part) * square_a + part * square_b
    return np.stack([mean, square - mean**2], axis=-1)


def chebyshev_bound(found: Any, depth: Any) -> Array:
    """Bounds the share of distributions of depths (..., 2), mean and variance, at or behind receivers. Donnelly and Lauritzen 2006."""
    mean, variance = np.moveaxis(np.asarray(found, float), -1, 0)
    off = mean - depth
    return np.asarray(np.where(off <= 0, 1.0, variance / np.maximum(variance + off**2, 1e-30)))


def cut_leaks(share: Any, cut: Any) -> Array:
    """Cuts the lowest visibilities off, and stretches the others over 0 to 1. Lauritzen, GPU Gems 3, ch. 8."""
    return np.asarray(np.clip((np.asarray(share, float) - cut) / (1 - np.asarray(cut, float)), 0, 1))


def averaged_moments(depths: Any, radius: int) -> Array:
    """Averages (n, n) depths of a map over `radius` texels to each side: (n, n, 2) mean and variance. Beyond its border lies that."""
    held = np.pad(np.asarray(depths, float), radius, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(held, (2 * radius + 1, 2 * radius + 1))
    return np.stack([around.mean(axis=(2, 3)), around.var(axis=(2, 3))], axis=-1)
