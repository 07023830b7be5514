"""Makes projectors of spot lights of glTF files whose extras say so: `"extras": {"projector": {"fov": [40, 30], "cookie": 0}}`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_decode
from airlight.errors import AirlightError
from airlight.lights.numbers import is_finite
from airlight.lights.projector import MOST
from airlight.lights.shape import Cookie
from airlight.pygfx.projector import Projector
from airlight.scenes.gltf import images, schema
from airlight.scenes.gltf.materials import colour
from airlight.scenes.gltf.validate import Gltf

KEYS = ("fov", "near", "far", "falloff", "ambient", "clip")  # as of Projector; cookie: the number of an image of the file


def projector_of(gltf: Gltf, described: schema.Light) -> gfx.Light | None:
    """Make the projector that a spot light's extras describe; None where they do not, or, with a line, where they cannot."""
    extras = described.extras.get("projector") if isinstance(described.extras, dict) else None
    if described.type != "spot" or extras is None:
        return None
    what = f"the projector of light {described.name or 'without a name'!r}"
    try:
        known = _known(extras)
        cookie = None if extras.get("cookie") is None else _cookie(gltf, extras["cookie"])
        top = max(described.color)
        made = Projector(colour(tuple(v / top for v in described.color)), min(described.intensity * top, MOST), cookie=cookie, **known)
    except (AirlightError, TypeError, ValueError, IndexError) as error:
        gltf.tell("projector", f"{what} is shown as a spot: {error}")
        return None
    made.distance = described.range or 0
    made.name = described.name[:80]
    return made


def _known(extras: Any) -> dict[str, Any]:
    if not isinstance(extras, dict):
        raise ValueError("its extras are no object")
    unknown = [name for name in extras if name not in (*KEYS, "cookie")]
    if unknown:
        raise ValueError(f"it has no {unknown[0][:80]}; there is {', '.join((*KEYS, 'cookie'))}")
    known = {name: extras[name] for name in KEYS if extras.get(name) is not None}
    numbers = [*_flat([value for name, value in known.items() if name != "falloff"])]
    if not all(is_finite(v) for v in numbers):
        raise ValueError("its numbers are none")
    return known


def _flat(values: Sequence[Any]) -> list[Any]:
    found: list[Any] = []
    for value in values:
        found += _flat(value) if isinstance(value, list) else [value]
    return found


def _cookie(gltf: Gltf, index: Any) -> Cookie:
    """Read an image of the file as a cookie: sRGB codes, of which what is not opaque lets less through."""
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(gltf.document.images):
        raise ValueError(f"its cookie is image {repr(index)[:80]}, which the file has not")
    data, kind = gltf.image(index)
    codes = images.pixels(data, kind, f"image {index}").astype(np.float32) / 255
    return Cookie((srgb_decode(codes[..., :3]) * codes[..., 3:]).astype(np.float32))
