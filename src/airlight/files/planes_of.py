"""Choose one plane of a file: a channel, a layer's luminance, or an object of a Cryptomatte."""

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.files import channels, cryptomatte, views
from airlight.files.decode import decode
from airlight.files.images import Picture, finite, upright
from airlight.luminance import REC709_F32
from airlight.messages import nearest


def plane_of_picture(picture: Picture, text: str, view: str | None = None) -> np.ndarray:
    """Choose a plane of a picture that is read: (H, W) float32. Arguments and errors as `plane_of_file`."""
    names = [*picture.channels, *picture.extra_names]
    colours = picture.codes.shape[2]
    if picture.codes.dtype.kind != "f":
        raise AirlightError(f"{picture.path}: has no channel {text!r}: it is no EXR; name the file that has it")

    def plane(i: int) -> np.ndarray:
        return picture.codes[..., i] if i < colours or picture.extra is None else picture.extra[..., i - colours]

    return _chosen(text, names, plane, picture.spec, picture.path, view)


def plane_of_file(
    path: str | os.PathLike[str],
    text: str,
    on_damage: str = "error",
    view: str | None = None,
    like: Picture | None = None,
    far: bool = False,
) -> np.ndarray:
    """Choose a plane of an EXR: (H, W) float32, as stored, infinite values as the largest finite ones.

    text: a channel (`Z`, `matte.A`), a layer with R G B, or an object of a Cryptomatte, `MATTE/OBJECT` or `OBJECT`, in which * and ? stand
    for any. view: of a stereo EXR, the view whose channel of that name is meant first. like: a picture of the same display window, whose
    data window the plane is put into, with 0 beyond its own, or its largest value if `far`. Raises AirlightError, listing what there is.
    """
    name = os.fsdecode(path)
    pixels, spec, format, _ = decode(name, on_damage)
    if format != "openexr":
        raise AirlightError(f"{name}: has no channel {text!r}: it is no EXR; leave that out, and its luminance is taken")
    orientation = spec.get_int_attribute("Orientation", 1)
    pixels = upright(pixels, orientation if 1 <= orientation <= 8 else 1)
    found = _chosen(text, list(spec.channelnames), lambda i: pixels[..., i], spec, name, view)
    return found if like is None or orientation > 1 else _placed(found, spec, like, far)


def _placed(plane: np.ndarray, spec: Any, like: Picture, far: bool) -> np.ndarray:
    """Put a plane where it lies in a picture's data window; as it is where the display windows are of different sizes."""
    x, y, width, height = like.data_window
    left, top = spec.x - spec.full_x - (x - like.display_window[0]), spec.y - spec.full_y - (y - like.display_window[1])
    if (spec.full_width, spec.full_height) != like.display_window[2:] or (left, top, *plane.shape) == (0, 0, height, width):
        return plane
    result = np.full((height, width), plane.max() if far else 0, np.float32)
    rows, columns = (slice(max(at, 0), max(at + size, 0)) for at, size in ((top, plane.shape[0]), (left, plane.shape[1])))
    target = result[rows, columns]
    target[...] = plane[max(-top, 0) :, max(-left, 0) :][: target.shape[0], : target.shape[1]]
    return result


def _chosen(text: str, names: Sequence[str], plane: Callable[[int], np.ndarray], spec: Any, path: str, view: str | None) -> np.ndarray:
    known = views.views_of(spec)
    places = {name.lower(): i for i, name in reversed(list(enumerate(names)))}
    layers: dict[str, dict[str, int]] = {}
    for i, name in enumerate(names):
        layer, kind = channels.split(name)
        layers.setdefault(layer.lower(), {}).setdefault(kind, i)
    for wanted in (views.in_view(text, view), text) if view in known[1:] and view is not None else (text,):
        if wanted.lower() in places:
            return _fine(plane(places[wanted.lower()]), path)
        layer_of = layers.get(wanted.lower(), {}) if wanted else {}
        if all(colour in layer_of for colour in "RGB"):
            return _fine(sum(plane(layer_of[colour]) * weight for colour, weight in zip("RGB", REC709_F32, strict=True)), path)
        if len(layer_of) == 1:
            return _fine(plane(*layer_of.values()), path)
    mattes = cryptomatte.mattes(spec, names, path)
    found = cryptomatte.choose(mattes, text)
    if found is not None:
        return cryptomatte.coverage(*found, plane, path)
    of_mattes = {i for matte in mattes for pair in matte.pairs for i in pair}
    there = [name for i, name in enumerate(names) if i not in of_mattes and not name.startswith("airlight.")]
    objects = [f"{matte.name}/{name}" for matte in mattes for name in matte.manifest]
    objects += [f"{matte.name}/OBJECT" for matte in mattes if not matte.manifest]
    hint = nearest(text, [*there, *objects, *(one for matte in mattes for one in matte.manifest)])
    more = f" and the objects {', '.join(objects[:4])}{' ...' if len(objects) > 4 else ''}" if objects else ""
    raise AirlightError(f"{path}: has no channel {text!r}, and no such layer or object{hint} (it has {', '.join(there[:8])}{more})")


def _fine(value: Any, path: str) -> np.ndarray:
    return finite(np.ascontiguousarray(np.asarray(value, np.float32)[..., None]), path)[..., 0]
