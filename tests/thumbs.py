"""The shipped photographs at the size of a thumbnail: small enough for any test, and a light and shafts are still found in them."""

from functools import cache
from pathlib import Path

import numpy as np

from airlight.colour import encode_codes
from airlight.files import read_image
from airlight.planes import shrink

PHOTOS = Path(__file__).parent.parent / "examples" / "photos"
OPENING, SUN = "casa-mila", "hill-sunset"  # of which kind the light is, with much to spare


@cache
def linear(name: str = OPENING, side: int = 96) -> np.ndarray:
    """(H, W, 3) float32, not to be written to."""
    small = shrink(read_image(PHOTOS / f"{name}.jpg").linear(), side).astype(np.float32)
    small.setflags(write=False)
    return small


def codes(name: str = OPENING, side: int = 96) -> np.ndarray:
    return encode_codes(linear(name, side), np.uint8, dither=False)
