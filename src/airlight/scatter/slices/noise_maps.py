"""Makes the tileable noise maps of printed slices."""

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

SIDE = 128  # texels
COARSEST = 2.0  # waves across a map, below which there are none
SPREAD = 0.22  # of values around one half


@cache
def noise_maps(seed: int) -> npt.NDArray[np.float32]:
    """Draw (SIDE, SIDE, 2) values 0..1, around one half, that go on beyond each border as they begin at the other: noise whose amplitude
    falls with the square of its frequency. seed: which."""
    rng: Any = np.random.default_rng(seed)
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(SIDE, 1 / SIDE), np.fft.fftfreq(SIDE, 1 / SIDE)))
    weight = np.where(frequency >= COARSEST, np.maximum(frequency, 1.0) ** -2.0, 0.0)
    waves = np.fft.ifft2(np.fft.fft2(rng.normal(size=(2, SIDE, SIDE))) * weight).real
    waves /= waves.std(axis=(1, 2), keepdims=True)
    return np.moveaxis(np.clip(0.5 + SPREAD * waves, 0, 1), 0, 2).astype(np.float32)
