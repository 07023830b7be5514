"""The planes that evidence for a light is read from, on one small copy of the picture."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from airlight.arrays import to_linear
from airlight.luminance import REC709_F32
from airlight.planes import Array, blur, shrink

COPY_SIDE_PX = 400
FIELD_SIDE_PX = 64  # of the light field, which is smooth
SIGNAL_BLUR = 0.003  # of the long side: below it lie noise and glints
WHITE_PERCENTILE = 99.95
CODE_STEP = 3e-4  # the darkest 8-bit sRGB code above black, linear
FALLOFF_CORE = 0.03  # widths within which a light's field no longer grows

LONE = 8.0  # times the second brightest of its neighbours: brighter pixels of floats are a renderer's noise, no light
FIREFLY = 1000.0  # times the 99.9th percentile: brighter pixels of floats are taken for faults


def linear_copy(image: Any, bounded: bool = False) -> Array:
    """Shrink an image as in airlight.light_shafts to (h, w, 3) linear of at most COPY_SIDE_PX, without nan, inf or negative values.

    bounded: its floats are decoded from codes, whose lone bright pixels may be lamps; of others they are a renderer's noise.
    """
    image = np.asarray(image)
    if image.dtype.kind == "f" and image.ndim in (2, 3) and image.size:
        if image.ndim == 2:
            image = image[..., None]
        image = image[..., :3] if image.shape[2] >= 3 else image[..., :1]
        if not np.isfinite(image).all():
            finite = image[np.isfinite(image)]
            most = float(finite.max()) if finite.size else 0.0
            image = np.nan_to_num(image, nan=0.0, posinf=most, neginf=0.0)
    else:
        image = to_linear(image)[0]
    if image.dtype.kind == "f":  # a few wild pixels must not outshine all that is averaged with them
        image = image if bounded else without_fireflies(image)
        usual = float(np.percentile(image, 99.9)) if image.size else 0.0
        image = np.minimum(image, min(FIREFLY * max(usual, 1e-30), float(np.finfo(image.dtype).max)))
    small = shrink(np.maximum(image.astype(np.float64 if image.dtype.itemsize > 4 else np.float32, copy=False), 0), COPY_SIDE_PX)
    small = np.where(small > 1e-12 * small.max(), small, 0)  # no remainders of running sums
    return np.repeat(small, 3, axis=2) if small.shape[2] == 1 else small


def without_fireflies(image: Array) -> Array:
    """Dim the lone hot pixels, or pairs of them, of a picture (H, W, C) of floats to the second brightest of their neighbours."""
    if image.size == 0 or min(image.shape[:2]) < 3:
        return image
    most = image.max(axis=2)
    first, second = np.zeros_like(most), np.zeros_like(most)
    height, width = most.shape
    wide = np.pad(most, 1)
    for y, x in ((y, x) for y in range(3) for x in range(3) if (y, x) != (1, 1)):
        near = wide[y : y + height, x : x + width]
        np.maximum(second, np.minimum(first, near), out=second)
        np.maximum(first, near, out=first)
    lone = most > LONE * np.maximum(second, 0)
    if not lone.any():
        return image
    mended = image.copy()
    mended[lone] *= (np.maximum(second[lone], 0) / most[lone])[:, None]
    return mended


@dataclass(frozen=True)
class Signals:
    """Holds planes of a picture. rgb: (h, w, 3) linear, scaled so that the luminance's 99.95th percentile is 1; suns of a float picture lie
    above it."""

    rgb: Array

    @classmethod
    def of(cls, linear: Array) -> "Signals | None":
        """Scale a copy; None where it holds nothing to search: too few pixels, black, or all the same."""
        if min(linear.shape[:2]) < 8:
            return None
        luminance = linear.astype(np.float64) @ REC709_F32
        white = float(np.percentile(luminance, WHITE_PERCENTILE))
        if white <= 0:
            white = float(luminance.max())
        typical = float(np.percentile(luminance, 90))
        if 0 < typical < CODE_STEP * white:  # a range that no 8-bit picture holds: as a camera would, let the light itself clip
            white = typical / (10 * CODE_STEP)
        if white <= 0 or luminance.max() - luminance.min() < 1e-3 * luminance.max():
            return None
        return cls((linear / white).astype(np.float32))

    @property
    def shape(self) -> tuple[int, int]:
        return self.rgb.shape[0], self.rgb.shape[1]

    @property
    def long_side(self) -> int:
        return max(self.shape)

    @property
    def aspect(self) -> float:
        """Divide height by width: y in widths is y normalised times it."""
        return self.shape[0] / self.shape[1]

    @cached_property
    def luminance(self) -> Array:
        return self.rgb @ REC709_F32

    @cached_property
    def value(self) -> Array:
        """Average luminance and the largest channel, so that coloured lights count."""
        return blur((self.luminance + self.rgb.max(axis=2)) / 2, SIGNAL_BLUR * self.long_side)

    @cached_property
    def whiteness(self) -> Array:
        """Take the smallest channel: the last to clip, so that it tells a sun from the sky round it when that is overexposed."""
        return blur(self.rgb.min(axis=2), SIGNAL_BLUR * self.long_side)

    @cached_property
    def warmth(self) -> Array:
        """Take the largest channel where red outweighs blue: a low sun is both bright and red."""
        soft = np.stack([blur(self.rgb[..., c], SIGNAL_BLUR * self.long_side) for c in range(3)], axis=2)
        largest = soft.max(axis=2)
        redness = np.clip((soft[..., 0] - soft[..., 2]) / np.maximum(largest, 1e-3), 0, 1)
        return largest * (0.2 + 0.8 * redness)

    @cached_property
    def redness_spread(self) -> float:
        redness = (self.rgb[..., 0] - self.rgb[..., 2]) / np.maximum(self.rgb.max(axis=2), 1e-3)
        return float(np.clip(redness, 0, 1).std())

    @cached_property
    def field(self) -> Array:
        """Estimate the light that the surroundings receive, in perceptual steps; what shines itself is left out by `falloff`."""
        return np.cbrt(np.minimum(shrink(self.luminance, FIELD_SIDE_PX), 1.0))

    @cached_property
    def _field_grid(self) -> tuple[Array, Array]:
        y, x = np.indices(self.field.shape) + 0.5
        return x / self.field.shape[1], y / self.field.shape[1]

    def falloff(self, position: tuple[float, float], hidden: Array | None = None, logarithmic: bool = True) -> float:
        """Correlate the light field with -log distance from a position, 1 where the surroundings fade away from it.

        The mean of two correlations: over the picture as it is, and with each row's mean taken out, since a sky above a ground
        fades downwards without a light's doing. `hidden` is the share of each of the field's cells that the
        light itself covers: only what it lights tells. With the square of the
        distance in place of its logarithm, it tells how well a lens's vignette would explain the same.
        """
        x, y = self._field_grid
        weight = np.ones_like(x) if hidden is None else np.where(hidden < 0.5, 1 - hidden, 0)
        if weight.sum() < 0.15 * weight.size:
            return 0.0
        squared = (x - position[0]) ** 2 + (y - position[1] * self.aspect) ** 2
        near = -0.5 * np.log(squared + FALLOFF_CORE**2) if logarithmic else -squared
        total = 0.0
        for axis in (None, 1):
            norm = np.maximum(weight.sum(axis=axis, keepdims=True), 1e-9)
            a = self.field - (self.field * weight).sum(axis=axis, keepdims=True) / norm
            b = near - (near * weight).sum(axis=axis, keepdims=True) / norm
            # a field that hardly varies, as black does, tells nothing: the floor is a step of 1 % in its variance
            power = (a * a * weight).sum() + 1e-4 * weight.sum()
            total += float((a * b * weight).sum() / np.sqrt(power * (b * b * weight).sum() + 1e-12))
        return total / 2
