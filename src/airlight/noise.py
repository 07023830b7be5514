"""Blue noise: where samples lie in their step (13.8), and the grain that hides the steps of 8-bit codes."""

from functools import cache
from importlib.resources import files

import numpy as np


@cache
def blue_noise() -> np.ndarray:
    """Load a (256, 256) tile of float32 in (0, 1), each of 65,536 values once. Made by OpenImageIO's ImageBufAlgo.noise("blue")."""
    ranks = np.frombuffer(files("airlight").joinpath("data/bluenoise256.u16").read_bytes(), "<u2").reshape(256, 256)
    return (ranks.astype(np.float32) + np.float32(0.5)) / np.float32(65536)


@cache
def dither() -> np.ndarray:
    """Stack the tile from three far apart positions, (256, 256, 3), so that the grain has no colour of its own; the mean is one half."""
    noise = blue_noise()
    return np.stack([noise, np.roll(noise, (97, 151), (0, 1)), np.roll(noise, (181, 61), (0, 1))], axis=2)
