"""The classic sum on a small copy of a picture, for pictures while something is dragged."""

from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.viewer.state import ViewerState

if TYPE_CHECKING:
    from airlight.viewer.picture import PictureView

SIDE = 800  # px of the longer side above which the copy is made


def follow(view: "PictureView", state: ViewerState) -> bool:
    """Let a view show its small copy with the sum as the state says it now. True if it has to be called again."""
    if view.half is None:
        view.half = _copy(view)
    half = view.half
    version = half.version
    again: bool = half.update(state, True)
    if half.version != version or view.pair is not half.pair:
        view.version += 1
    view.pair, view.settings, view.ramp, view.done = half.pair, half.settings, half.ramp, None
    return again


def _copy(view: "PictureView") -> Any:
    from airlight.viewer.app import from_array
    from airlight.viewer.picture import PictureView

    step = -(-max(view.size) // SIDE)
    pixels = np.ascontiguousarray(view.pixels[::step, ::step])
    half = PictureView(view.device, from_array(pixels if view.has_alpha else pixels[..., :3]))
    half.coarse, half.picture_scale = view.coarse, view.picture_scale
    return half
