"""Shapes of lights: what a light's intensity is multiplied by, direction by direction or place by place. NumPy only, float64.

A shape is seen from the light, along axes (3, 3) whose rows are right, up and ahead, unit vectors in the world.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.lights.numbers import is_finite, unit

Array = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class Cookie:
    """Holds a picture that a light sends out, also called gobo.

    pixels: (H, W, 3) linear RGB factors, 0 or more; row 0 is on top, column 0 on the left, as seen from the light. size: m, the width of
    one of a directional light's, which repeat. revision: another for other pixels of the same cookie, as of a film's.
    """

    pixels: Array
    size: float = field(default=1.0, kw_only=True)
    revision = 0

    def __post_init__(self) -> None:
        shape = np.shape(self.pixels)
        if len(shape) != 3 or shape[2] != 3 or not min(shape):
            raise AirlightError(f"a cookie's pixels must be (H, W, 3) with a pixel at least, not {shape}; read_cookie reads a file's")
        if not (is_finite(self.size) and self.size > 0):
            raise AirlightError(f"a cookie's size must be above 0 m, not {self.size!r}")

    def __repr__(self) -> str:
        """Write its size, not its pixels."""
        height, width = self.pixels.shape[:2]
        return f"Cookie({width} x {height} pixels, size={self.size:g})"

    def at(self, uv: Any, repeats: bool = False) -> Array:
        """Interpolates (..., 3) between the centres of pixels at places uv (..., 2), 0..1 from the left and from the top; beyond the
        outermost centres it is as there, or repeats."""
        height, width = self.pixels.shape[:2]
        place = np.asarray(uv, float) * (width, height) - 0.5
        low = np.floor(place)
        part = place - low
        pair = np.stack([low, low + 1], axis=-1).astype(np.int64)
        x, y = (pair[..., i, :] % n if repeats else np.clip(pair[..., i, :], 0, n - 1) for i, n in enumerate((width, height)))
        top, bottom = (_mixed(self.pixels[y[..., j], x[..., 0]], self.pixels[y[..., j], x[..., 1]], part[..., :1]) for j in (0, 1))
        return _mixed(top, bottom, part[..., 1:])


class Photometry(Protocol):
    """Says how strong a light is in which direction, as files of lamps' makers do."""

    def at(self, q: Any) -> Array:
        """Evaluates (...) the factor of the light's intensity, 0..1, in directions q (..., 3), of any length, along right, up and ahead."""
        ...

    @property
    def table(self) -> Array:
        """Samples (R, C) the factors for a texture: rows from ahead to behind, 0 to 180 degrees with both ends, columns from right by way
        of up, 0 to 360 degrees without the last."""
        ...


def _mixed(a: Any, b: Any, share: Any) -> Array:
    return np.asarray(a + share * (np.asarray(b, float) - a))


def axes_along(ahead: Any, up: Any) -> Array:
    """Makes axes (3, 3), right, up, ahead, whose up is as near to `up` (3,) as can be; where that lies along `ahead`, as near to -Z."""
    z = unit(ahead)
    right = np.cross(z, unit(up))
    if np.linalg.norm(right) < 1e-9:
        right = np.cross(z, (0.0, 0.0, -1.0))
    x = right / np.linalg.norm(right)
    return np.stack([x, np.cross(x, z), z])
