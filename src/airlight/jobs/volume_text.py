"""Reads volumes as a user writes them, `FILE` with how it joins the air behind it:
`;blend=B;factor=F;grid=NAME;bounds=x0,y0,z0,x1,y1,z1;scale=S;up=z`; and loads them."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.particles import FORMATS as OF_PARTICLES
from airlight.files.volumes import FORMATS, UP, file_of_frame, read_volume
from airlight.medium.field import BLENDS, Field
from airlight.messages import nearest

FORM = "FILE, then ;blend=add;factor=1;grid=density;bounds=x0,y0,z0,x1,y1,z1;scale=1;up=y"
KEYS = ("blend", "factor", "grid", "bounds", "scale", "up")
_WORDS = {"blend": BLENDS, "up": UP}
_LARGEST = {"factor": 1e9, "scale": 1e9}


@dataclass(frozen=True)
class VolumeText:
    """Holds a volume as it is written. bounds: the outer faces of a dense grid, in its own axes and units; None: the file's own."""

    path: str
    blend: str = "add"
    factor: float = 1.0
    grid: str | None = None
    bounds: tuple[float, ...] | None = None
    scale: float = 1.0
    up: str | None = None


def read_volume_text(text: str) -> VolumeText:
    """Read what was written, without a look at any file. Raises AirlightError."""
    path, *rest = (part.strip() for part in str(text).split(";"))
    known: dict[str, Any] = {}
    for part in filter(None, rest):
        name, _, value = (word.strip() for word in part.partition("="))
        if name not in KEYS or not value:
            raise AirlightError(f"cannot read {part!r} in the volume {text!r}{nearest(name, KEYS, f': write {FORM}')}")
        if name in known:
            raise AirlightError(f"{name} stands twice in the volume {text!r}; leave one out")
        known[name] = _value(name, value, text)
    if not path:
        raise AirlightError(f"cannot read the volume {text!r}: write {FORM}")
    if path.lower().endswith(OF_PARTICLES) and not path.lower().endswith(tuple(FORMATS)):
        raise AirlightError(f"{path}: holds particles, not a volume; give it by --particles")
    return VolumeText(path, **known)


def _value(name: str, value: str, text: str) -> Any:
    if name == "grid":
        return value
    if name in _WORDS:
        if value not in _WORDS[name]:
            raise AirlightError(f"{name} is {value!r} in the volume {text!r}{nearest(value, _WORDS[name])}; use {', '.join(_WORDS[name])}")
        return value
    count = 6 if name == "bounds" else 1
    try:
        numbers = tuple(float(part) for part in value.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        what = "six numbers, x0,y0,z0,x1,y1,z1" if count > 1 else "a number"
        raise AirlightError(f"{name} is {value} in the volume {text!r}; give {what}")
    if name == "bounds":
        return numbers
    if not 0 <= numbers[0] <= _LARGEST[name] or (name == "scale" and numbers[0] == 0):
        raise AirlightError(f"{name} is {value} in the volume {text!r}; give {'more than 0' if name == 'scale' else '0 or more'}")
    return numbers[0]


class FileVolume:
    """Gives the density of a file, of numbered files (`smoke.####.vdb`) that of `frame`, which may be set."""

    def __init__(self, written: VolumeText, frame: int = 1) -> None:
        self.written, self.frame = written, frame
        self._path = ""
        self._field: Field | None = None

    def field(self, cells: int = 128) -> Field:
        """Read the file of the frame: the same Field while it is the same. Raises AirlightError."""
        w = self.written
        path = file_of_frame(w.path, self.frame)
        if self._field is None or path != self._path:
            bounds = None if w.bounds is None else np.array(w.bounds).reshape(2, 3)
            told = self._field is None  # what is mended is told of the first file of a sequence
            volume = read_volume(path, w.grid, bounds, w.scale, w.up, tell=told)
            self._field, self._path = Field(volume, w.blend, w.factor), path
        return self._field


def tell_apart(field: Field, centre: Any, radius: float) -> None:
    """Warn of a volume that lies nowhere near a scene, a ball around centre (3,), m: with where it lies, and where the scene does."""
    low, high = field.volume.bounds
    nearest_place = np.clip(np.asarray(centre, float), low, high)
    if np.linalg.norm(nearest_place - centre) <= radius:
        return
    box = " to ".join(", ".join(f"{v:.4g}" for v in corner) for corner in (low, high))
    middle = ", ".join(f"{v:.4g}" for v in np.asarray(centre, float))
    cure = "it may need a scale, or up=z" if field.volume.path else "move it"
    warn(f"{field.volume.path or 'a volume'}: lies outside the scene, at {box} m, which is {radius:.4g} m around {middle}; {cure}")
