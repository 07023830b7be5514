"""Renders pictures that were read from files, in either look."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.composite.blend import CompositeSettings, auto_levels_of, resolve
from airlight.composite.blend import blend as blend_layer
from airlight.files import Picture
from airlight.layers import Where, checked_plane, compute_codes, compute_layer, hiding_nearness, open_renderer, where_lit
from airlight.lights import ImageLight
from airlight.look.apply import HALF_MAX
from airlight.look.apply import apply as apply_look
from airlight.look.near import NEAR_RANGE
from airlight.look.resolve import ResolvedLook
from airlight.options import Composite, Look, Parameters
from airlight.planes import by_rows

FloatArray = npt.NDArray[np.float32]


@dataclass
class Rendered:
    """Holds a rendered picture: either encoded, (H, W, 3) uint8, or the rest: pixels, and layer as it was added, (H, W, 3) float32
    linear in the picture's RGB, the layer premultiplied; changed, (H, W) bool, where the picture may have changed."""

    pixels: FloatArray | None = None
    layer: FloatArray | None = None
    changed: npt.NDArray[np.bool_] | None = None
    encoded: npt.NDArray[np.uint8] | None = None
    held: CompositeSettings | ResolvedLook | None = None  # what was measured: for the next frame
    message: str = ""  # one line for the user
    transmittance: FloatArray | None = None  # of the air of daylight, (H, W, 3)
    z: FloatArray | None = None  # m along the view's axis, (H, W)


def render_picture(
    picture: Picture,
    lights: list[ImageLight],
    parameters: Parameters,
    composite: Composite | CompositeSettings | None = None,
    *,
    mask: Any = None,
    depth: Any = None,
    device: Where = None,
    profile: Any = None,
    float_output: bool = False,
    codes_only: bool = False,
) -> Rendered:
    """Render the classic look of a picture from a file, with parameters as `auto_threshold` gives them.

    profile: a list to which (label, ms) of each pass is appended. codes_only: 8-bit sRGB codes will do, and are cheaper.
    """
    settings = composite if isinstance(composite, CompositeSettings) else resolve(composite or Composite(), float_output)
    shape = (picture.height, picture.width)
    planes = checked_plane("mask", mask, shape), checked_plane("depth", depth, shape)
    chosen = open_renderer(device)
    if chosen is not None and codes_only and _is_plain(picture) and not settings.adapt:
        encoded, settings = compute_codes(picture.codes, None, lights, parameters, settings, *planes, chosen, profile)
        return Rendered(encoded=encoded, held=settings)
    rgb = picture.linear()
    layer = compute_layer(rgb, picture.alpha, lights, parameters, *planes, chosen, luminance=picture.luminance, profile=profile)
    settings = auto_levels_of(rgb, layer, settings, picture.luminance)
    pixels, added = blend_layer(rgb, layer, settings, picture.luminance)
    changed = where_lit(added) | (settings.adapt > 0)
    return Rendered(pixels, added, changed, held=settings)


def render_look(
    picture: Picture,
    lights: Sequence[ImageLight],
    look: Look,
    *,
    quality: str = "normal",
    mask: Any = None,
    depth: Any = None,
    subject: Any = None,
    near_range: tuple[float, float] = NEAR_RANGE,
    held: ResolvedLook | None = None,
    device: Where = None,
    profile: Any = None,
    float_output: bool = False,
    codes_only: bool = False,
) -> Rendered:
    """Render the smart look of a picture from a file.

    mask, depth, subject: (H, W), as `add_light_shafts`; held: of a frame before, to keep; lights: none, where the picture is to stay as it
    is; the rest as `render_picture`.
    """
    shape = (picture.height, picture.width)
    near = hiding_nearness(depth, subject, shape, near_range, look.wrap)
    chosen = open_renderer(device) if lights else None
    codes = chosen is not None and codes_only and _is_plain(picture)
    if not lights:
        return _untouched(picture, codes_only)
    coarse = picture.rec709(picture.linear(coarse=True))
    pixels = picture.codes[..., :3] if codes else picture.rec709(picture.linear())
    masked = checked_plane("mask", mask, shape)
    options: dict[str, Any] = {"near": near, "masked": masked, "held": held, "quality": quality, "profile": profile}
    options["grey"] = picture.colour_codes.shape[2] == 1
    done = apply_look(chosen, pixels, coarse, lights, look, float_output=float_output, **options)
    message = done.resolved.message
    if done.codes is not None:
        return Rendered(encoded=done.codes, held=done.resolved, message=message)
    if done.added is None or done.taken is None:
        return dataclasses.replace(_untouched(picture, codes_only), held=done.resolved, message=message)
    added = picture.from_rec709(done.added)
    out = picture.linear()

    def rows(first: int, last: int) -> None:
        if float_output:  # as an EXR holds it: its picture is to be the sum of what is stored
            added[first:last] = np.clip(added[first:last], -HALF_MAX, HALF_MAX).astype(np.float16)
        out[first:last] *= 1 - done.taken[first:last, :, None]  # type: ignore[index]
        out[first:last] += added[first:last]

    by_rows(rows, len(out))
    changed = where_lit(added) | (done.taken != 0)
    return Rendered(out, added, changed, held=done.resolved, message=message)


def _untouched(picture: Picture, codes_only: bool) -> Rendered:
    """Give the picture as it is, with a layer of nothing."""
    if codes_only and _is_plain(picture):
        return Rendered(encoded=np.ascontiguousarray(picture.codes[..., :3]))
    rgb = picture.linear()
    return Rendered(rgb, np.zeros_like(rgb), np.zeros(rgb.shape[:2], bool))


def _is_plain(picture: Picture) -> bool:
    """Tell whether the picture holds sRGB codes of 8 bits, with colour, that are its light over black."""
    codes = picture.codes
    plain = picture.encoding == "srgb" and picture.to_709 is None and codes.dtype == np.uint8 and codes.shape[2] >= 3
    return plain and not picture.is_transparent
