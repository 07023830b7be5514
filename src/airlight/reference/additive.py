"""The fixed-function multipass of Fig. 13-5 in float64: scaled copies of the image, added in an 8-bit buffer."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.options import Parameters
from airlight.reference.radial import Array, at_points, bilinear, pixel_centres

WHITE = 255  # code of 1 in the buffers


def additive(emitted: Array, at: Sequence[float], p: Parameters) -> Array:
    """Add scaled copies: exposure / 255 min(255, sum_i round(f_i J(x - i (x - l) density / n))), f_i = min(decay^i weight / n, 1).

    J = round(255 emitted), at most 255: the buffer that is drawn. Each blend rounds and saturates, as the hardware's do.
    """
    drawn = np.floor(np.clip(emitted, 0, 1) * WHITE + 0.5)
    centres = pixel_centres(drawn.shape[1], drawn.shape[0])
    total = np.zeros_like(drawn)
    for i in range(p.samples):
        x = centres - i * p.density / p.samples * (centres - np.asarray(at))
        factor = min(p.decay**i * p.weight / p.samples, 1.0)
        total = np.minimum(total + np.floor(factor * bilinear(drawn, x[..., 0], x[..., 1], p.border) + 0.5), WHITE)
    return np.asarray(p.exposure * total / WHITE)


def reference(emitted: Array, at: Sequence[float], p: Parameters, *, points: Any = None, **_: Any) -> Array:
    """Give the layer of one white light, as `reference.radial.summed`."""
    return at_points(additive(emitted, at, p), points, p.border)
