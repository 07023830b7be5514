"""Reads volumes as a user writes them, `FILE` with how it joins the air behind it:
`;blend=B;factor=F;grid=NAME;bounds=x0,y0,z0,x1,y1,z1;scale=S;up=z`; and loads them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.particles import FORMATS as OF_PARTICLES
from airlight.files.volumes import FORMATS, UP, read_volume
from airlight.jobs.density_text import FACTOR, SCALE, FileDensity, Grammar
from airlight.medium.field import BLENDS, Field

FORM = "FILE, then ;blend=add;factor=1;grid=density;bounds=x0,y0,z0,x1,y1,z1;scale=1;up=y"
GRAMMAR = Grammar(
    "volume", FORM, {"grid": "name"}, {"blend": BLENDS, "up": UP}, {"factor": FACTOR, "scale": SCALE}, {"bounds": "x0,y0,z0,x1,y1,z1"}
)


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
    path, known = GRAMMAR.read(text)
    if path.lower().endswith(OF_PARTICLES) and not path.lower().endswith(tuple(FORMATS)):
        raise AirlightError(f"{path}: holds particles, not a volume; give it by --particles")
    return VolumeText(path, **known)


class FileVolume(FileDensity):
    """Gives the density of a volume's file, or of the frame's."""

    def __init__(self, written: VolumeText, frame: int = 1) -> None:
        super().__init__(written.path, frame)
        self.written = written

    def _read(self, path: str, cells: int) -> Field:
        w = self.written
        bounds = None if w.bounds is None else np.array(w.bounds).reshape(2, 3)
        told = self._field is None  # what is mended is told of the first file of a sequence
        return Field(read_volume(path, w.grid, bounds, w.scale, w.up, tell=told), w.blend, w.factor)


def tell_apart(field: Field, centre: Any, radius: float) -> None:
    """Warn of a volume that lies nowhere near a scene, a ball around centre (3,), m: with where it lies, and where the scene does."""
    low, high = field.volume.bounds
    nearest_place = np.clip(np.asarray(centre, float), low, high)
    if np.linalg.norm(nearest_place - centre) <= radius:
        return
    box, middle = f"{_place(low)} to {_place(high)}", _place(np.asarray(centre, float))
    cure = "it may need a scale, or up=z" if field.volume.path else "move it"
    warn(f"{field.volume.path or 'a volume'}: lies outside the scene, at {box} m, which is {radius:.4g} m around {middle}; {cure}")


def _place(point: np.ndarray) -> str:
    """Write a place (3,), m, to a metre at least: also far from the origin, as in coordinates of maps."""
    return ", ".join(f"{v:.4g}" if abs(v) < 1e4 else f"{v:.0f}" for v in point)
