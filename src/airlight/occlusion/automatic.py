"""Occlusion of a picture: checks of what it needs, and the threshold where none is given."""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from airlight.errors import AirlightError
from airlight.gpu.slices import let_go
from airlight.lights import ImageLight
from airlight.luminance import REC709_F32
from airlight.options import Parameters
from airlight.options.shafts import SMOOTHNESS, THRESHOLD
from airlight.scatter.methods import check_picture

LIGHT_RADIUS_WIDTHS = 0.02  # of the width: the light's own disc
LEAST_WHITE = 0.05  # of white: darker pictures are taken to hold no light


def check(p: Parameters, has_alpha: bool, has_depth: bool) -> None:
    """Raise AirlightError for a method that needs a scene, or an occlusion that needs what the picture has not."""
    check_picture(p.method)
    if p.occlusion == "depth" and not has_depth:
        raise AirlightError("occlusion depth needs a depth map: give --depth FILE (or depth=)")
    if p.occlusion == "alpha" and not has_alpha:
        raise AirlightError("occlusion alpha needs an image with an alpha channel; use luminance, or give a mask")


def auto_threshold(p: Parameters, image: Any, lights: Sequence[ImageLight], bounded: bool = True) -> Parameters:
    """Choose threshold and smoothness for a picture whose light is darker than white, where none are given.

    image: (H, W, 3) linear, a coarse one will do. White is the brightest of the picture's 99.9th percentile and the 90th
    percentile around each light; the default knee is in units of it. Parameters that say their threshold stay as they are.
    bounded: white is no brighter than 1 and no darker than LEAST_WHITE, as in pictures of integers.
    """
    if p.occlusion not in ("luminance", "contrast") or p.threshold is not None:
        return p
    y = image @ REC709_F32
    height, width = y.shape
    let_go()
    levels = [np.percentile(y, 99.9)]
    rows, columns = np.ogrid[:height, :width]
    for light in lights:
        let_go()
        column, row = light.position[0] * width, light.position[1] * height
        near = np.hypot(columns + 0.5 - column, rows + 0.5 - row) <= max(LIGHT_RADIUS_WIDTHS * width, 1)
        if near.any():
            levels.append(np.percentile(y[near], 90))
    white = float(np.clip(max(levels), LEAST_WHITE, 1.0)) if bounded else max(float(np.nan_to_num(max(levels))), 0.0) or 1.0
    white = min(white, 65504 / 2)
    smoothness = p.smoothness if p.smoothness is not None else SMOOTHNESS * white
    return msgspec.structs.replace(p, threshold=THRESHOLD * white, smoothness=smoothness)
