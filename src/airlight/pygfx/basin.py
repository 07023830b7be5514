"""Find the lowlands of a scene: the ground's height, drawn as a shadow map from straight above, and the density that lies over them."""

from typing import Any

import numpy as np
import pygfx as gfx

from airlight.baked import basin_volume
from airlight.errors import warn
from airlight.medium import basin
from airlight.medium.field import Field
from airlight.projection import Matrix
from airlight.pygfx import private
from airlight.pygfx.casters import FORMAT, Casters, Gathered
from airlight.pygfx.origin import current_origin
from airlight.shadows import fit

SIZE = 512  # texels along the map's sides
NARROW = 1 / 16  # of the map's side: what is narrower, as a tree or somebody who walks, is no ground
ROUNDED = 0.5  # of how far the eye sees: steps of the middle of a map that follows it
UP, ACROSS = (0.0, 1.0, 0.0), [0, 2]


class Basin:
    """Gives the density of a scene's lowlands, see `medium.basin`, drawn anew where what may be ground has changed.

    That are the casters of shadows that are wider than NARROW, but for what an alpha test cuts, as leaves.
    """

    def __init__(self, casters: Casters) -> None:
        self.casters = casters
        self._map: Any = None  # the texture, a view of it
        self._drawn: Any = None  # what the map was drawn for, and what it told
        self._heights: tuple[np.ndarray, np.ndarray] | None = None
        self._key: Any = None
        self._field: Field | None = None
        self._told = False

    def field(
        self, gathered: Gathered, level: float | None, density: float, cells: int = 128, seen: tuple[Any, float] | None = None
    ) -> Field | None:
        """Bake the lowlands as they are now: the same Field while they and the level stay; None where there are none, with a line.

        gathered: the casters of this frame, see `Casters.gather`. level: world y, m; None: none asked for. cells: along the longer side.
        seen: (3,) the eye, and how far it sees, m, beyond which nothing is looked for; None: as far as the casters reach. Draws and waits
        where the ground has changed. Raises AirlightError.
        """
        if level is None or density == 0:
            return None
        found = self.ground(gathered, seen)
        key = level, density, cells
        if found is not self._heights or key != self._key:
            self._heights, self._key = found, key
            made = None if found is None else basin.bake(*found, level, cells)
            if made is None:
                self._tell(level, found)
            self._field = None if made is None else Field(basin_volume(*made), "add", density)
        return self._field

    def _tell(self, level: float, found: Any) -> None:
        if not self._told:
            self._told = True
            lowest = "there is no ground" if found is None else f"the lowest is at {round(float(np.nanmin(found[0])), 4):g} m"
            warn(f"basin_level = {level:g}: no ground lies below it: {lowest}; give a higher one")

    def ground(self, gathered: Gathered, seen: tuple[Any, float] | None = None) -> tuple[np.ndarray, np.ndarray] | None:
        """Draw the ground's heights, unless nothing has changed: (SIZE, SIZE) world y, m, by z and x, NaN where there is none, and bounds
        (2, 2), the least x, z and the greatest. None where nothing is ground. The same objects while they are the same."""
        meshes, hulls = gathered
        if not len(hulls):
            return None
        middle, half = _square(hulls, seen)
        width = NARROW * 2 * half
        low, high = hulls[..., ACROSS].min(axis=1), hulls[..., ACROSS].max(axis=1)
        wide = ((high - low).max(axis=1) >= width) & (low < middle + half).all(axis=1) & (high > middle - half).all(axis=1)
        kept = [i for i in np.flatnonzero(wide) if not private.alpha_tested(meshes[i][0].material)]
        if not kept:
            return None
        own, boxes, origin = [meshes[i] for i in kept], hulls[kept], current_origin()
        key = self.casters.still, (boxes + origin).round(9).tobytes(), (middle + origin[ACROSS]).round(6).tobytes(), half
        key += tuple(_state(mesh) for mesh, _ in own)
        if self._drawn is not None and self._drawn[0] == key and not any(_deforms(mesh) for mesh, _ in own if key[0] is None):
            return self._drawn[1]
        heights, bounds = self._draw(own, boxes, middle, half)
        found = heights + origin[1], bounds + origin[ACROSS]
        if self._drawn is not None and _same(found, self._drawn[1]):
            found = self._drawn[1]
        self._drawn = key, found
        return found

    def _draw(self, own: list[Any], boxes: Matrix, middle: Matrix, half: float) -> tuple[np.ndarray, np.ndarray]:
        """Draw heights from above over a square, and read them: see `ground`, but near the origin."""
        device = self.casters.device
        if self._map is None:
            usage = device.wgpu.TextureUsage
            flags = usage.RENDER_ATTACHMENT | usage.COPY_SRC
            texture = device.device.create_texture(size=(SIZE, SIZE, 1), format=FORMAT, usage=flags)
            self._map = texture, texture.create_view()
        axes = fit.basis(UP)
        centre = axes @ np.array([middle[0], 0.0, middle[1]])
        view = fit.orthographic_view(axes, centre, half, SIZE, boxes @ axes.T, (0.0, np.inf))
        self.casters.draw_layers([(view.matrix, SIZE, self._map[1])], (own, boxes))
        depth = np.frombuffer(device.read(self._map[0], 4), np.float32).reshape(SIZE, SIZE).astype(np.float64)
        across, along, up = view.matrix[0], view.matrix[1], view.matrix[2]
        heights = np.where(depth > 0, (depth - up[3]) / up[1], np.nan)
        ends = np.array([0.0, SIZE])
        bounds = np.column_stack([(ends - across[3]) / across[0], (ends - along[3]) / along[2]])
        return basin.without_narrow(heights, round(NARROW * 2 * half / view.texel)), bounds


def _square(hulls: Matrix, seen: tuple[Any, float] | None) -> tuple[Matrix, float]:
    """Choose (2,) the middle, x and z, and half the side of the square that the map holds: of all hulls, or, where that is smaller, around
    the eye, whose place is rounded, so that the square stays as the eye moves about."""
    low, high = hulls[..., ACROSS].min(axis=(0, 1)), hulls[..., ACROSS].max(axis=(0, 1))
    half = float((high - low).max()) / 2
    if seen is None or (1 + ROUNDED / 2) * seen[1] >= half:
        return (low + high) / 2, half
    step, origin = ROUNDED * seen[1], current_origin()
    return np.rint((np.asarray(seen[0]) + origin)[ACROSS] / step) * step - origin[ACROSS], (1 + ROUNDED / 2) * seen[1]


def _state(mesh: Any) -> tuple[Any, ...]:
    """Tell what a mesh's heights depend on, but for where its box lies."""
    buffers = [getattr(mesh.geometry, name, None) for name in ("positions", "indices")] + [getattr(mesh, "instance_buffer", None)]
    return (id(mesh), id(mesh.material), *(None if buffer is None else buffer.rev for buffer in buffers))


def _deforms(mesh: Any) -> bool:
    return isinstance(mesh, gfx.SkinnedMesh) or bool(getattr(mesh.geometry, "morph_positions", None))


def _same(one: Any, other: Any) -> bool:
    return other is not None and all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))
