"""Reads particles as a user writes them, `FILE` or the NAME of points of the scene, with what they are made of behind it:
`;radius=R;density=D;sprite=FILE;blend=B;factor=F`, of a file `;scale=S;up=z`, of points `;draw=0`; and loads them."""

import os
from dataclasses import dataclass
from typing import Any

from airlight.baked import bake, empty, sprite_profile
from airlight.errors import AirlightError, warn
from airlight.files.particles import FORMATS, UP, read_particles
from airlight.files.volumes import FORMATS as OF_VOLUMES
from airlight.files.volumes import Volume
from airlight.jobs.density_text import FACTOR, SCALE, FileDensity, Grammar
from airlight.medium.field import BLENDS, Field
from airlight.messages import nearest, nearest_file

FORM = "FILE or NAME, then ;radius=0.2;density=1;sprite=FILE;blend=add;factor=1, of a file ;scale=1;up=z, of a scene's points ;draw=0"
GRAMMAR = Grammar(
    "particles", FORM, {"sprite": "file"}, {"blend": BLENDS, "up": UP, "draw": ("0", "1")},
    {"radius": (0.0, 1e9), "density": (0.0, 1e12), "factor": FACTOR, "scale": SCALE},
)  # fmt: skip
OF_FILES, OF_POINTS = ("scale", "up"), ("draw",)


@dataclass(frozen=True)
class ParticleText:
    """Holds particles as they are written. source: a file, or the name of points of the scene. radius, density: instead of their own."""

    source: str
    radius: float | None = None
    density: float | None = None
    sprite: str | None = None
    blend: str = "add"
    factor: float = 1.0
    scale: float = 1.0
    up: str | None = None
    draw: bool = True

    @property
    def is_file(self) -> bool:
        return self.source.lower().endswith(FORMATS)


def read_particle_text(text: str) -> ParticleText:
    """Read what was written, without a look at any file. Raises AirlightError."""
    source, known = GRAMMAR.read(text)
    known |= {"draw": known["draw"] == "1"} if "draw" in known else {}
    if source.lower().endswith(tuple(OF_VOLUMES)) and not source.lower().endswith(FORMATS):
        raise AirlightError(f"{source}: is a volume, not particles; give it by --volume")
    written = ParticleText(source, **known)
    wrong = next((key for key in (OF_POINTS if written.is_file else OF_FILES) if key in known), None)
    if wrong is not None:
        what = "particles of a file are never drawn" if written.is_file else f"it goes with a file, as {' or '.join(FORMATS)}"
        raise AirlightError(f"cannot use {wrong} in the particles {text!r}: {what}; leave it out")
    return written


class FileParticles(FileDensity):
    """Gives the density of a file's particles, or of the frame's; of no particles 0."""

    draw, kind, baked = False, "particles", True

    def __init__(self, written: ParticleText, frame: int = 1) -> None:
        super().__init__(written.source, frame)
        self.written = written
        self._profile = None if written.sprite is None else sprite_profile(written.sprite)

    def _read(self, path: str, cells: int) -> Field:
        return Field(self._baked(path, cells), self.written.blend, self.written.factor)

    def _baked(self, path: str, cells: int) -> Volume:
        w = self.written
        found = read_particles(path, w.scale, w.up)
        radius, density = w.radius if w.radius is not None else found.radii, w.density if w.density is not None else found.densities
        if not len(found.positions):
            if self._field is None:
                warn(f"{path}: has no particles")
            return empty(path)
        volume = bake(found.positions, radius, density, cells, self._profile, os.path.basename(path))
        for line in volume.told:
            warn(line)
        return volume


def load_particles(written: ParticleText, scene: Any, cells: int = 128, frame: int = 1) -> Any:
    """Load particles, for `LightShafts.fields`: FileParticles, or a ParticleField of the points in `scene`, a pygfx
    scene, that have the name, or hang on what has. cells: the `particle_cells` that they will be asked for; they are baked at once, since
    what is wrong should not be told in a frame. Raises AirlightError."""
    if written.is_file:
        made = FileParticles(written, frame)
        made.field(cells)
        return made
    from airlight.pygfx import ParticleField

    w = written
    points = points_named(scene, w.source)
    more: dict[str, Any] = {"sprite": w.sprite, "draw": w.draw, "blend": w.blend, "factor": w.factor, "name": w.source}
    field = ParticleField(points, radius=w.radius, density=w.density, **more)
    field.field(cells)
    return field


def points_named(scene: Any, name: str) -> list[Any]:
    """Find the points of a name, their own or that of what they hang on. Raises AirlightError."""
    import pygfx as gfx

    found: dict[str, list[Any]] = {}
    for one in scene.iter():
        if isinstance(one, gfx.Points):
            above = one
            while above is not None:
                if above.name:
                    found.setdefault(above.name, []).append(one)
                above = above.parent
    if name not in found:
        files = ", ".join(FORMATS)
        there = f"; there is {', '.join(list(found)[:12])}" if found else f"; it has no points: give a file, {files}"
        hint = f"; files of particles end with {files}" if os.path.isfile(name) else nearest(name, found) or nearest_file(name, there)
        raise AirlightError(f"--particles {name}: the scene has no points of that name{hint}")
    return found[name]
