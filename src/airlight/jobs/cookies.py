"""Reads the pictures that lights send out."""

import numpy as np

from airlight.errors import warn
from airlight.files.volumes import file_of_frame
from airlight.lights.shape import Cookie

MOST = 4096  # pixels along a side


def read_cookie(path: str, frame: int = 1, size: float = 1.0) -> Cookie:
    """Read an image as a Cookie, in linear RGB: what is not opaque lets as much less through. One of more than MOST pixels a side is
    averaged to that, and said so. frame: of numbered files, `gobo.####.png`; size: m, of a directional light's. Raises AirlightError."""
    from airlight.files import read_image

    found = file_of_frame(path, frame)
    picture = read_image(found)
    pixels = np.maximum(picture.rec709(picture.linear()), 0)
    side = max(pixels.shape[:2])
    if side > MOST:
        down, along = (-(-n // MOST) for n in pixels.shape[:2])
        rows, columns = pixels.shape[0] // down, pixels.shape[1] // along
        pixels = pixels[: rows * down, : columns * along].reshape(rows, down, columns, along, 3).mean(axis=(1, 3))
        warn(f"{found}: has {side:,} pixels along a side; as a cookie it is averaged to {max(rows, columns):,}")
    return Cookie(np.ascontiguousarray(pixels), size=size)
