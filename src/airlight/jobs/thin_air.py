"""Judges whether the light of a scene's lamps is seen in its air, which over a room is thin where kilometres of it are thick."""

import math
from typing import TYPE_CHECKING

from airlight.medium.resolve import ResolvedMedium, as_suits
from airlight.messages import number

if TYPE_CHECKING:
    import numpy as np

THIN_DEPTH = 0.05  # optical, over the scene's size: the usual one is 10 times this
BEAM_CONTRAST = 0.05  # of a beam's soft border to what lies behind it, that is noticed at a glance
BEAM_LINEAR = 4e-3  # code 13 of 255, on a display: a beam that is darker is not noticed before black
BEAM_SHARE = 0.025  # of the pixels: a beam that is noticed on fewer is the glow around its lamp


def depth_around(medium: ResolvedMedium, size: float, y: float) -> float:
    """Compute the optical depth of the air at a height over the scene's size. size, y: m."""
    dense = 1.0
    if medium.settings.fog == "exponential":
        dense = math.exp(min(-(y - medium.fog_base) / medium.fog_depth, 0.0))
    elif medium.settings.fog == "linear":
        top = medium.settings.fog_above
        dense = top + (1 - top) * min(max(1 - (y - medium.fog_base) / medium.fog_depth, 0.0), 1.0)
    return float(medium.sigma_t.mean()) * dense * size


def doubt_of_lamps(
    medium: ResolvedMedium, radius: float, heights: "dict[str, float]", light: "np.ndarray", picture: "np.ndarray"
) -> str | None:
    """Word one line where the air is so thin that the light of lamps is hardly seen in it, with its cure; else None.

    radius: of the scene, m; heights: m, of lamps, by name. light, picture: (n, 3) what the air scatters, and the picture, linear, for a
    display.
    """
    import numpy as np

    size = min(2 * radius, medium.max_distance)
    if not heights or size <= 0 or medium.varies or not medium.sigma_t.any():
        return None
    depths = {name: depth_around(medium, size, y) for name, y in heights.items()}
    name = max(depths, key=lambda one: depths[one])
    if depths[name] >= THIN_DEPTH:
        return None
    noticed = np.maximum(BEAM_CONTRAST * picture.max(axis=1), BEAM_LINEAR)
    if (light.max(axis=1) > noticed).mean() >= BEAM_SHARE:
        return None
    told = f"the air around {name} is so thin that its light is hardly seen there, an optical depth of {number(depths[name], 2)}"
    over = f"over the {number(size, 2)} m of the scene"
    if medium.settings.fog != "none":
        return f"{told} {over}: --fog-depth {number(size / 2, 2)} lets the fog reach it, or leave out --fog"
    return f"{told} {over}: --sigma-t {as_suits(medium, size)} shows it, or --medium smoke"
