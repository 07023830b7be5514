"""Reads maps of depths as they are stored: their infinities say where there is sky."""

import numpy as np

from airlight.errors import AirlightError
from airlight.files import views
from airlight.files.decode import decode
from airlight.files.images import Picture, upright
from airlight.files.planes_of import plane_of_file, plane_of_picture
from airlight.luminance import REC709_F32

NAMES = ("Z", "DEPTH.Z", "DEPTH")


def read_depths(path: str | None, layer: str | None, picture: Picture, on_damage: str, view: str | None) -> tuple[np.ndarray, bool]:
    """Read depths (H, W) float32 as large as a picture, and tell whether they are whole numbers, which come as 0..1.

    path: None where they are a layer of the picture. layer: a channel of an EXR; unset: Z, or depth, or the luminance. Raises
    AirlightError.
    """
    values, whole = _values(path, layer, picture, on_damage, view)
    if values.shape != (picture.height, picture.width):
        size, own = f"{values.shape[1]} x {values.shape[0]}", f"{picture.width} x {picture.height}"
        raise AirlightError(f"{path or picture.path}: the depths are {size} pixels, the picture {own}: scale them to its size")
    return values, whole


def _values(path: str | None, layer: str | None, picture: Picture, on_damage: str, view: str | None) -> tuple[np.ndarray, bool]:
    if path is None:
        names = [*picture.channels, *picture.extra_names]
        index = _index(layer or "", names)
        if index is None or picture.codes.dtype.kind != "f":
            return plane_of_picture(picture, layer or "", view), False
        colours = picture.codes.shape[2]
        extra = picture.extra
        return (picture.codes[..., index] if index < colours or extra is None else extra[..., index - colours]), False
    pixels, spec, format, _ = decode(path, on_damage)
    orientation = spec.get_int_attribute("Orientation", 1)
    pixels = upright(pixels, orientation if 1 <= orientation <= 8 else 1)
    names = list(spec.channelnames)
    if format == "openexr":
        wanted = [layer] if layer is not None else list(NAMES)
        wanted = [views.in_view(one, view) for one in wanted if view in views.views_of(spec)[1:]] + wanted if view else wanted
        index = next((found for one in wanted if (found := _index(one, names)) is not None), None)
        if index is not None and (spec.width, spec.height) == (picture.width, picture.height):
            return np.ascontiguousarray(pixels[..., index], np.float32), False
        if layer is not None or index is not None:
            return plane_of_file(path, layer or names[index or 0], on_damage, view, picture, far=True), False
    elif layer is not None:
        raise AirlightError(f"{path}: has no channel {layer!r}: it is no EXR; leave --depth-layer out, and its luminance is taken")
    colour = pixels[..., : 1 if pixels.shape[2] < 3 else 3]
    whole = colour.dtype.kind != "f"
    values = colour.astype(np.float32)
    if whole:
        values /= np.float32(np.iinfo(colour.dtype).max)
    if values.shape[2] == 1 or (values[..., :1] == values).all():  # grey: as it is, infinities too
        return np.ascontiguousarray(values[..., 0]), whole
    with np.errstate(invalid="ignore", over="ignore"):  # of NaN and infinities, which the caller tells apart
        return values @ REC709_F32, whole


def _index(name: str, names: list[str]) -> int | None:
    """Find a channel by its name, whatever its case."""
    return next((i for i, one in enumerate(names) if one.upper() == name.upper()), None)
