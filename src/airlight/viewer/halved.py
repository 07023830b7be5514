"""Smaller copies of a picture: as large as it is shown, and for the classic sum while something is dragged."""

from typing import Any

import numpy as np

from airlight.files.images import of_codes
from airlight.viewer.state import ViewerState

LONGEST = 1920  # px of the longer side; larger pictures are shown, and their shafts computed, at this size
SIDE = 800  # px of the longer side above which the copy is made


def shrunk(pixels: np.ndarray, longest: int = LONGEST) -> np.ndarray:
    """Shrink a picture to as large as it is shown, (H, W, C) float32."""
    height, width, channels = pixels.shape
    if max(height, width) <= longest:
        return pixels
    import OpenImageIO as oiio

    factor = longest / max(height, width)
    shape = max(1, round(factor * width)), max(1, round(factor * height))
    source = oiio.ImageBuf(np.ascontiguousarray(pixels, np.float32))
    resized = oiio.ImageBufAlgo.resize(source, "box", 0.0, oiio.ROI(0, shape[0], 0, shape[1], 0, 1, 0, channels))
    return np.ascontiguousarray(resized.get_pixels(oiio.FLOAT)).reshape(shape[1], shape[0], channels)


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
