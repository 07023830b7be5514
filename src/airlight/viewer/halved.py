"""The classic sum on a small copy of a picture, for pictures while something is dragged."""

from typing import Any

import numpy as np

from airlight.files.images import of_codes
from airlight.viewer.state import ViewerState

SIDE = 800  # px of the longer side above which the copy is made


def follow(view: Any, state: ViewerState) -> bool:
    """Let a PictureView show its small copy with the sum as the state says it now. True if it has to be called again."""
    if view.half is None:
        view.half = _copy(view)
    half = view.half
    version = half.version
    again: bool = half.update(state, True)
    if half.version != version or view.pair is not half.pair:
        view.version += 1
    view.pair, view.settings, view.ramp, view.done = half.pair, half.settings, half.ramp, None
    return again


def _copy(view: Any) -> Any:
    step = -(-max(view.size) // SIDE)
    codes = np.ascontiguousarray(view.pixels[::step, ::step, : 4 if view.has_alpha else 3])
    half = type(view)(view.device, of_codes(codes, "small copy"))
    half.coarse, half.picture_scale = view.coarse, view.picture_scale
    return half
