"""Find the lowlands of a scene: the ground's height, drawn as a shadow map from straight above, and the density that lies over them."""

from typing import Any

import numpy as np

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
NARROW = 1 / 16  # of the scene's longer side: what is narrower, as a tree or somebody who walks, is no ground
UP = (0.0, 1.0, 0.0)


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

    def field(self, gathered: Gathered, level: float | None, density: float, cells: int = 128) -> Field | None:
        """Bake the lowlands as they are now: the same Field while they and the level stay; None where there are none, with a line.

        gathered: the casters of this frame, see `Casters.gather`. level: world y, m; None: none asked for. cells: along the longer side.
        Draws and waits where the casters' `still` is None or has changed. Raises AirlightError.
        """
        if level is None or density == 0:
            return None
        found = self.ground(gathered)
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
            lowest = "there is no ground" if found is None else f"the lowest is at {float(np.nanmin(found[0])):.4g} m"
            warn(f"basin_level = {level:g}: no ground lies below it: {lowest}; give a higher one")

    def ground(self, gathered: Gathered) -> tuple[np.ndarray, np.ndarray] | None:
        """Draw the ground's heights, unless nothing has changed: (SIZE, SIZE) world y, m, by z and x, NaN where there is none, and bounds
        (2, 2), the least x, z and the greatest. None where nothing is ground. The same objects while they are the same."""
        meshes, hulls = gathered
        if not len(hulls):
            return None
        width = NARROW * float(np.ptp(hulls[..., (0, 2)], axis=(0, 1)).max())
        wide = np.ptp(hulls[..., (0, 2)], axis=1).max(axis=1) >= width
        kept = [i for i in np.flatnonzero(wide) if not private.alpha_tested(meshes[i][0].material)]
        if not kept:
            return None
        own, boxes = [meshes[i] for i in kept], hulls[kept]
        origin = current_origin()
        still = self.casters.still
        key = still, [(id(mesh), id(mesh.material)) for mesh, _ in own], (boxes + origin).round(9).tobytes()
        if still is not None and self._drawn is not None and self._drawn[0] == key:
            return self._drawn[1]
        heights, bounds = self._draw(own, boxes, width)
        found = heights + origin[1], bounds + origin[[0, 2]]
        if self._drawn is not None and _same(found, self._drawn[1]):
            found = self._drawn[1]
        self._drawn = key, found
        return found

    def _draw(self, own: list[Any], boxes: Matrix, width: float) -> tuple[np.ndarray, np.ndarray]:
        """Draw heights from above, and read them: see `ground`, but near the origin."""
        device = self.casters.device
        if self._map is None:
            usage = device.wgpu.TextureUsage
            flags = usage.RENDER_ATTACHMENT | usage.COPY_SRC
            texture = device.device.create_texture(size=(SIZE, SIZE, 1), format=FORMAT, usage=flags)
            self._map = texture, texture.create_view()
        axes = fit.basis(UP)
        local = boxes @ axes.T
        low, high = local.min(axis=(0, 1)), local.max(axis=(0, 1))
        half = float((high - low)[:2].max()) / 2
        view = fit.orthographic_view(axes, (low + high) / 2, half, SIZE, local, (0.0, np.inf))
        self.casters.draw_layers([(view.matrix, SIZE, self._map[1])], (own, boxes))
        depth = np.frombuffer(device.read(self._map[0], 4), np.float32).reshape(SIZE, SIZE).astype(np.float64)
        across, along, up = view.matrix[0], view.matrix[1], view.matrix[2]
        heights = np.where(depth > 0, (depth - up[3]) / up[1], np.nan)
        ends = np.array([0.0, SIZE])
        bounds = np.column_stack([(ends - across[3]) / across[0], (ends - along[3]) / along[2]])
        return basin.without_narrow(heights, round(width / view.texel)), bounds


def _same(one: Any, other: Any) -> bool:
    return other is not None and all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))
