"""Let particles thicken the air: points of a scene, or arrays, baked into a density on a grid wherever they are in a frame."""

import contextlib
import copy
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.baked import bake, empty, sprite_profile
from airlight.errors import AirlightError, warn
from airlight.files.volumes.volume import Volume
from airlight.medium.field import Field
from airlight.pygfx.origin import current_origin

CELLS = 128  # where nobody says how many
NEGLIGIBLE = 1e-12  # of coordinates: how far points come to lie elsewhere by rounding alone


class ParticleField:
    """Gives the density of particles in a medium, for `LightShafts.fields`, baked anew where they have moved or changed.

    points: a gfx.Points, or several; an object with such below it; or (N, 3) positions in world metres. They count whether they are
    visible or not. radius: metres, (N,) for arrays, or one for all; None: half the points' size where that is in world or model space, else
    twice the mean spacing. density: at a particle's centre, (N,) or one for all; None: see `airlight.particles`. Points' alpha (of a vertex
    or of the colour, times the opacity) multiplies it. sprite: of the kernel, see `airlight.particles`; None: that of a
    gfx.PointsSpriteMaterial, else none. draw: whether the points are drawn too, see `undrawn`. blend, factor: of the field. cells: along
    the longest side of the grid; None: what the medium says. All but draw and sprite may be set, and positions, radius and density written
    into. Raises AirlightError.
    """

    def __init__(
        self,
        points: Any,
        *,
        radius: Any = None,
        density: Any = None,
        sprite: Any = None,
        draw: bool = True,
        blend: str = "add",
        factor: float = 1.0,
        cells: int | None = None,
        name: str = "",
    ) -> None:
        things = [points] if isinstance(points, gfx.WorldObject) else points
        of_scene = isinstance(things, Sequence) and bool(things) and all(isinstance(one, gfx.WorldObject) for one in things)
        self.points: list[gfx.Points] = [one for thing in things for one in _below(thing)] if of_scene else []
        if of_scene and not self.points:
            raise AirlightError(f"{name or things[0].name or 'particles'}: has no points; give a gfx.Points, or what has some below it")
        self.positions: Any = None if of_scene else points
        self.radius, self.density, self.draw, self.blend, self.factor, self.cells = radius, density, draw, blend, factor, cells
        self.name = name or (self.points[0].name if of_scene else "") or "particles"
        self._sprite = None if sprite is None else sprite_profile(sprite)
        self._known: list[Any] = []
        self._field: Field | None = None
        self._told: set[str] = set()
        Field(empty(self.name), blend, factor)  # raises for these

    def field(self, cells: int | None = None) -> Field:
        """Bake the particles as they are now: the same Field while nothing has changed, one of density 0 where there are none.

        cells: unless the particles have their own. Warns, once of each kind, of what was changed. Raises AirlightError.
        """
        cells = self.cells or cells or CELLS
        now = [self.positions, self.radius, self.density, cells, self.blend, self.factor]
        now += [value for one in self.points for value in _state(one)]
        if self._field is None or not all(map(_alike, now, self._known)):
            self._field = Field(self._baked(cells), self.blend, self.factor)
            self._known = [np.array(value) if isinstance(value, np.ndarray) else copy.copy(value) for value in now]  # may change in place
        return self._field

    def _baked(self, cells: int) -> Volume:
        positions, radius, profile, weight = self.positions, self.radius, self._sprite, None
        if self.positions is None:
            positions, radius, weight = self._gathered()
            profile = self._own_sprite() if profile is None else profile
        if not np.isfinite(positions).any():  # none, or not yet
            return empty(self.name)
        volume = bake(positions, radius, self.density, cells, profile, self.name, weight)
        for line in volume.told:
            kind = re.sub(r"[-+.\de]+", "", line)
            if kind not in self._told:
                self._told.add(kind)
                warn(line)
        return volume

    def _gathered(self) -> tuple[np.ndarray, Any, np.ndarray]:
        """Gather positions in the world, radii, and weights of the densities of all points."""
        positions, radii, weights = [], [], []
        for one in self.points:
            matrix, local = _placed(one), np.asarray(one.geometry.positions.data, np.float64)[:, :3]
            positions.append(local @ matrix[:3, :3].T + matrix[:3, 3])
            radii.append(_radii(one, matrix))
            weights.append(_weights(one))
        sized = [own for own in radii if own is not None]
        radius = np.concatenate(sized) if self.radius is None and len(sized) == len(radii) else self.radius
        return np.concatenate(positions), radius, np.concatenate(weights)

    def _own_sprite(self) -> np.ndarray | None:
        """Average the sprite of the first points that have one."""
        textures = (getattr(one.material, "sprite", None) for one in self.points)
        texture = next((one for one in textures if one is not None), None)
        return None if texture is None or texture.data is None else sprite_profile(np.asarray(texture.data))


@contextlib.contextmanager
def undrawn(fields: Iterable[Any]) -> Iterator[None]:
    """Leave the points that only count as density, of those ParticleFields that say draw=False, out of what is drawn while a block lasts.

    To be put around a renderer's render(scene, camera).
    """
    hidden = [one for field in fields if isinstance(field, ParticleField) and not field.draw for one in field.points if one.visible]
    for one in hidden:
        one.visible = False
    try:
        yield
    finally:
        for one in hidden:
            one.visible = True


def _below(thing: Any) -> Iterator[gfx.Points]:
    """Find the points in an object and below it."""
    return (one for one in thing.iter() if isinstance(one, gfx.Points) and getattr(one.geometry, "positions", None) is not None)


def _material(points: gfx.Points) -> Any:
    """Give the material of points; of those without one, which are not drawn, what pygfx would take."""
    return gfx.PointsMaterial() if points.material is None else points.material


def _placed(points: gfx.Points) -> np.ndarray:
    """Find (4, 4) where points are in the world, in which those that are drawn near the origin lie elsewhere."""
    matrix = np.array(points.world.matrix, np.float64)
    matrix[:3, 3] += current_origin()
    return matrix


def _state(points: gfx.Points) -> list[Any]:
    """List what a bake depends on. Revisions of buffers do not tell: those of what is never drawn stay as they are."""
    geometry, material = points.geometry, _material(points)
    held = [getattr(geometry, name, None) for name in ("positions", "sizes", "colors", "radii", "densities")]
    arrays = [None if one is None else one.data for one in (*held, getattr(material, "sprite", None))]
    modes = [str(mode) for mode in (material.size_space, material.size_mode, material.color_mode)]
    return [*arrays, *modes, material.size, *_plain_alpha(material), _placed(points)]


def _plain_alpha(material: Any) -> tuple[float, float]:
    return float(material.opacity), float(material.color.a)


def _radii(points: gfx.Points, matrix: np.ndarray) -> np.ndarray | None:
    """Give (N,) radii in the world: the geometry's `radii`, in its own space, or half the sizes; None where these are pixels."""
    material, geometry = _material(points), points.geometry
    scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    own = getattr(geometry, "radii", None)
    if own is not None:
        return np.asarray(own.data, np.float64).reshape(-1) * scale
    space = str(material.size_space).rpartition(".")[2]
    if space == "screen":
        return None
    sizes = getattr(geometry, "sizes", None) if str(material.size_mode).endswith("vertex") else None
    count = len(geometry.positions.data)
    diameters = np.full(count, float(material.size)) if sizes is None else np.asarray(sizes.data, np.float64).reshape(-1)[:count]
    return np.asarray(diameters / 2 * (scale if space == "model" else 1.0))


def _weights(points: gfx.Points) -> np.ndarray:
    """Give (N,) the alphas of points, 0 or more, times the geometry's `densities`, where it has these."""
    own = getattr(points.geometry, "densities", None)
    return _alphas(points) * (1.0 if own is None else np.asarray(own.data, np.float64).reshape(-1))


def _alphas(points: gfx.Points) -> np.ndarray:
    material, colors = _material(points), getattr(points.geometry, "colors", None)
    opacity, alpha = _plain_alpha(material)
    mode, count = str(material.color_mode).rpartition(".")[2], len(points.geometry.positions.data)
    if colors is None or mode not in ("auto", "vertex"):
        return np.full(count, opacity * (alpha if mode in ("auto", "uniform") else 1.0))
    data = np.asarray(colors.data)
    data = data[:, None] if data.ndim == 1 else data
    if data.shape[1] not in (2, 4):
        return np.full(count, opacity)
    alphas = data[:count, -1].astype(np.float64) / (1.0 if data.dtype.kind == "f" else np.iinfo(data.dtype).max)
    return np.asarray(opacity * np.maximum(alphas, 0))


def _alike(one: Any, other: Any) -> bool:
    """Tell whether two values are alike, matrices but for rounding."""
    if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
        return type(one) is type(other) and bool(one == other)
    if one.shape == (4, 4) == other.shape:
        return bool(np.allclose(one, other, rtol=NEGLIGIBLE, atol=NEGLIGIBLE * float(np.abs(one).max())))
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def follow(things: Iterable[Any], time: float, fps: float) -> None:
    """Bring densities and cookies that follow a frame's number, `frame`, to a time, s: frame 1 is at 0."""
    for thing in things:
        if hasattr(thing, "frame"):
            thing.frame = 1 + round(time * fps)
