"""Turns a cookie of a light of the image plane into a factor over the angle around it. NumPy only, float64.

The cookie is held with its middle upon the light. In each direction the factor is the mean of the wedge there, out to the largest circle
that the picture holds. Angles are parts of a turn, clockwise in the picture, from straight up.
"""

import math
import os
import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.arrays import to_linear
from airlight.errors import AirlightError
from airlight.lights.shape import Cookie
from airlight.planes import block_means

Array = npt.NDArray[np.floating[Any]]
ANGLES = 4096  # of a table; a power of 2, as in wgsl/around.wgsl
ENTRIES = 2 * ANGLES - 1
SIDE = 1024  # pixels along a cookie's side, of which a table is made

_tables: Any = weakref.WeakKeyDictionary()


def as_cookie(cookie: Any) -> Cookie:
    """Make a Cookie of one, or of an image in memory, as `to_linear` takes it. Raises AirlightError."""
    if isinstance(cookie, Cookie):
        return cookie
    if isinstance(cookie, str | bytes | os.PathLike):
        raise AirlightError(f"cookie {cookie!r}: give airlight.read_cookie of the file, or an array")
    return Cookie(np.maximum(to_linear(cookie)[0], 0))


def around_table(cookie: Cookie | None) -> npt.NDArray[np.float32] | None:
    """Make of a cookie the table that `reference.around.around_factor` and the shaders read: (ENTRIES, 4) float32, RGB factors of ANGLES
    directions, then the means of pairs of them, and so on down to one; None where there is no cookie, or a white one. The same array while
    the cookie is the same. Raises AirlightError."""
    if cookie is None:
        return None
    known = _tables.get(cookie)
    if known is None or known[0] != cookie.revision:
        known = _tables[cookie] = cookie.revision, _table(cookie.pixels)
    found: npt.NDArray[np.float32] | None = known[1]
    return found


def _table(pixels: Array) -> npt.NDArray[np.float32] | None:
    if not (np.isfinite(pixels).all() and np.min(pixels) >= 0):
        raise AirlightError("a cookie's pixels must be finite and 0 or more")
    if (pixels == 1).all():
        return None
    factor = -(-min(pixels.shape[:2]) // SIDE)
    side = min(pixels.shape[:2]) // factor * factor  # of the square in the middle, of which no more counts
    y, x = ((n - side) // 2 for n in pixels.shape[:2])
    level = wedges(Cookie(block_means(pixels[y : y + side, x : x + side], factor)))
    table = np.zeros((ENTRIES, 4), np.float32)
    at = 0
    while len(level):
        table[at : at + len(level), :3] = level
        at, level = at + len(level), (level[::2] + level[1::2]) / 2 if len(level) > 1 else level[:0]
    return table


def wedges(cookie: Cookie, angles: int = ANGLES) -> Array:
    """Average a cookie over each of so many wedges about its middle: (angles, 3), the first from straight up on, clockwise."""
    height, width = cookie.pixels.shape[:2]
    radius = 0.5 * min(width, height)
    turn = 2 * math.pi * (np.arange(angles) + 0.5) / angles
    across, down = np.sin(turn) / width, -np.cos(turn) / height
    rings = max(math.ceil(radius), 8)
    total, weight = np.zeros((angles, 3)), 0.0
    for ring in (np.arange(rings) + 0.5) / rings:
        total += ring * cookie.at(0.5 + radius * ring * np.stack([across, down], axis=-1))
        weight += ring
    return np.asarray(total / weight)
