"""Computes layers of pictures in memory: on a device, or by the reference where there is none; checks the planes beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.composite.blend import CompositeSettings
from airlight.errors import AirlightError, MachineError, warn
from airlight.files import Picture
from airlight.gpu.device import Device
from airlight.lights import ImageLight
from airlight.look.near import nearness, subject_nearness
from airlight.luminance import REC709_F32
from airlight.occlusion.automatic import check as check_inputs
from airlight.options import Parameters
from airlight.planes import by_rows
from airlight.reference import fallback
from airlight.scatter.render import PictureRenderer, render_codes, render_layer

FloatArray = npt.NDArray[np.float32]
Where = PictureRenderer | Device | str | None  # None: the fastest adapter


def open_renderer(device: Any) -> PictureRenderer | None:
    """Open what to compute on; None, with a warning that says how to get one, where there is no adapter."""
    if isinstance(device, PictureRenderer):
        return device
    try:
        return PictureRenderer(device, keep=0)
    except MachineError as error:
        warn(f"{error}; going on without, by the NumPy reference, which is much slower")
        return None


def checked_plane(name: str, plane: Any, shape: tuple[int, int]) -> FloatArray | None:
    """Check a mask or depth map (H, W) against the image's size, and make it float32."""
    if plane is None:
        return None
    array = np.asarray(plane)
    if array.ndim != 2:
        raise AirlightError(f"the {name} has the shape {array.shape}: give (H, W), as (height, width) of the image")
    if array.shape != shape:
        size = " x ".join(str(n) for n in array.shape[:2][::-1])
        raise AirlightError(f"the {name} is {size} pixels, the image {shape[1]} x {shape[0]}: they must be of one size")
    if array.dtype.kind != "f" and array.dtype not in (bool, np.uint8, np.uint16):
        raise AirlightError(f"the {name} is of type {array.dtype}: give bool, uint8, uint16 or float in 0..1")
    scale = float(np.iinfo(array.dtype).max) if array.dtype.kind == "u" else 1.0
    values = np.nan_to_num(array.astype(np.float32) / np.float32(scale), nan=0.0, posinf=3e38, neginf=-3e38)
    return values if name == "depth" else np.clip(values, 0, 1)


def rgba_pixels(rgb: FloatArray, alpha: Any) -> FloatArray:
    """Make (H, W, 4) as the GPU takes them; rgb is finite, as all that is read or handed in is mended."""
    pixels = np.empty((*rgb.shape[:2], 4), np.float32)

    def rows(first: int, last: int) -> None:
        for i in range(3):  # one by one: NumPy is twice as fast at it
            pixels[first:last, :, i] = rgb[first:last, :, i]
        pixels[first:last, :, 3] = 1.0 if alpha is None else alpha[first:last]

    by_rows(rows, len(rgb))
    return pixels


def where_lit(added: FloatArray) -> npt.NDArray[np.bool_]:
    """Mark (H, W) where something was added."""
    lit = added != 0
    return lit[..., 0] | lit[..., 1] | lit[..., 2]


def gpu_inputs(
    picture: Picture, parameters: Sequence[Parameters], mask: Any = None, depth: Any = None
) -> tuple[FloatArray, dict[str, Any]]:
    """Make of a picture from a file and its planes what scatter.render takes: (H, W, 4) and {mask, depth}, checked for the parameters."""
    for p in parameters:
        check_inputs(p, picture.alpha is not None, depth is not None)
    shape = (picture.height, picture.width)
    planes = {"mask": checked_plane("mask", mask, shape), "depth": checked_plane("depth", depth, shape), "luminance": picture.luminance}
    return rgba_pixels(picture.linear(), picture.alpha), planes


def compute_layer(
    rgb: FloatArray,
    alpha: Any,
    lights: list[ImageLight],
    p: Parameters,
    mask: Any,
    depth: Any,
    device: PictureRenderer | None,
    *,
    fraction: bool = False,
    luminance: Any = REC709_F32,
    profile: Any = None,
) -> FloatArray:
    """Compute the layer, (H, W, 3), by the GPU, or by the reference where there is none; the rest as `render_layer`."""
    check_inputs(p, alpha is not None, depth is not None)
    if device is None:
        return fallback.layer(rgb, lights, p, alpha=alpha, depth=depth, mask=mask, fraction=fraction, luminance=luminance)
    pixels = rgba_pixels(rgb, alpha)
    return render_layer(device, pixels, lights, p, mask=mask, depth=depth, fraction=fraction, luminance=luminance, profile=profile)


def compute_codes(
    image: Any,
    alpha: Any,
    lights: list[ImageLight],
    p: Parameters,
    settings: CompositeSettings,
    mask: Any,
    depth: Any,
    device: PictureRenderer,
    profile: Any = None,
) -> tuple[Any, CompositeSettings]:
    """Put shafts on sRGB codes (H, W, 3 or 4) uint8, giving (H, W, 3) uint8: decoded, composited, encoded by the GPU; and the
    settings as measured."""
    has_alpha = image.shape[2] == 4
    check_inputs(p, has_alpha or alpha is not None, depth is not None)
    codes = image
    if not has_alpha or alpha is not None:
        codes = np.empty((*image.shape[:2], 4), np.uint8)
        codes[..., :3] = image[..., :3]
        codes[..., 3] = 255 if alpha is None else np.rint(255 * np.clip(alpha, 0, 1))
    out, settings = render_codes(device, codes, lights, p, settings, mask=mask, depth=depth, profile=profile)
    return np.ascontiguousarray(out[..., :3]), settings


def hiding_nearness(depth: Any, subject: Any, shape: tuple[int, int], near_range: tuple[float, float], wrap: float) -> FloatArray | None:
    """Give (H, W), what shafts pass behind, by a depth map and a subject's mask; None where neither is given. Raises AirlightError."""
    far, masked = checked_plane("depth", depth, shape), checked_plane("subject", subject, shape)
    planes = [] if far is None else [nearness(far, near_range)]
    if masked is not None:
        planes.append(subject_nearness(masked, wrap))
    return np.asarray(np.maximum.reduce(planes), np.float32) if planes else None
