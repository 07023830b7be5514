"""The classic sum on a small copy of a picture, for pictures while something is dragged."""

from typing import Any

import numpy as np

from airlight.colour import alpha_of
from airlight.files import Picture
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
    real = codes.dtype.kind == "f"
    picture = Picture(
        codes=codes,
        channels=("R", "G", "B", "A")[: codes.shape[2]],
        alpha=alpha_of(codes[..., 3]) if view.has_alpha else None,
        encoding="linear" if real else "srgb",
        path="small copy",
        spec=None,
        format="png",
        bits=codes.dtype.itemsize * 8,
        associated=real,
    )
    half = type(view)(view.device, picture)
    half.coarse, half.picture_scale = view.coarse, view.picture_scale
    return half
