"""Draws the shadows that lights cast on surfaces, in place of pygfx's: maps of our own, with the casters, cut-outs, skins and morphs that
those of a medium have.
"""

import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pygfx as gfx

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.projection import Matrix
from airlight.pygfx import private
from airlight.pygfx.casters import Casters, Gathered
from airlight.pygfx.glass_maps import MOST_BYTES, GlassMaps
from airlight.pygfx.origin import root_of
from airlight.pygfx.private_surfaces import TEXEL
from airlight.pygfx.punctual import GFX_KINDS
from airlight.pygfx.surface_shapes import SurfaceShapes
from airlight.shadows import ShadowView, fit
from airlight.shadows.fit import basis, orthographic_view

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

SIZES = {"flat": 1536, "cube": 1024}  # texels along a map of a sun or a spot, and along a face of a point's
GLASS_SIZES = {"flat": 1024, "cube": 512}  # and of what dims them, where all of that is no more than a buffer holds; else halves of these
BORDER = 6.37  # texels around a lamp's map, that filters read; no round number, lest edges that lie at such are on texels' centres


class SurfaceShadows:
    """Lets surfaces of a LightShafts' scene, where its renderer draws that, take their shadows from maps of ours.

    Lights cast as their cast_shadow says, objects as theirs does if they are solid (`Casters`), and shadows fall where receive_shadow says.
    A sun's map holds all that casts, or what its shadow camera sees where that is less; depths, bias and cull mode have no effect. What
    lets light through dims and colours it as in the air, whatever its cast_shadow says, but with Medium.transparency "none".
    """

    sizes = SIZES

    def __init__(self, shafts: "LightShafts") -> None:
        self._shafts = weakref.ref(shafts)
        self._casters = Casters(shafts.device, shafts.scene)
        self._shapes = SurfaceShapes()
        self._glass = GlassMaps(shafts.device)
        self._found: tuple[list[Any], Any] = [], None  # what lets light through, and its hulls
        self._sides: dict[str, int] = {}
        private.shade_surfaces(shafts.renderer, self)

    def wants(self, lights: Any) -> bool:
        """Tells whether some of pygfx's lights cast shadows, and are of the scene."""
        shafts = self._shafts()
        every = [light for kind in private.KINDS for light in lights[f"{kind}_lights"]]
        if shafts is None or not every or root_of(every[0]) is not root_of(shafts.scene):
            return False
        return any(light.cast_shadow for light in every) or any(map(any, self.shapes(lights).values()))

    def shapes(self, lights: Any) -> dict[str, list[PunctualLight | None]]:
        """Finds the shapes of pygfx's lights, by kind; None of one that has none."""
        shafts = self._shafts()
        return self._shapes.of(lights, shafts.lights if shafts is not None else ())

    def write_shapes(self, state: private.SurfaceState, shapes: Sequence[PunctualLight]) -> None:
        """Writes the shapes of a state's lights."""
        self._shapes.write(state, shapes)

    def glass_texels(self, layers: dict[str, int]) -> int:
        """Counts the texels of maps of what dims lights; layers: of each kind of map. Gathers that."""
        shafts = self._shafts()
        assert shafts is not None
        none = shafts.medium.transparency == "none"
        self._found = ([], None) if none else self._glass.gather(shafts.scene, (), shafts.lights)
        if not self._found[0]:
            return 0
        self._sides = dict(GLASS_SIZES)
        while (texels := sum(count * self._sides[name] ** 2 for name, count in layers.items())) * TEXEL > MOST_BYTES:
            self._sides = {name: side // 2 for name, side in self._sides.items()}
        return texels

    def draw(self, state: private.SurfaceState) -> None:
        """Draws and submits the maps of a state, and writes where they lie."""
        shafts = self._shafts()
        assert shafts is not None
        casters = self._casters
        casters.scene, casters.lights, casters.still = shafts.scene, shafts.lights, shafts.still
        gathered = _casting(casters.gather())
        free = {name: iter(layers) for name, layers in state.maps.items()}
        drawn: list[tuple[Any, int, Any]] = []
        scales, fitted = [], []
        reached = gathered[1] if state.glass is None else np.concatenate([gathered[1], self._found[1]])
        for light, name in state.casters:
            size = SIZES[name]
            fitted.append((surface_views(light, reached, size), name, len(drawn)))
            for view in fitted[-1][0]:
                drawn.append((view.matrix, size, next(free[name])))
                sun = isinstance(light, gfx.DirectionalLight)
                scales.append([view.texel, 0, view.depth_scale, 0] if sun else [0, view.texel, 0, 1 / view.depth_scale])
        casters.draw_layers(drawn, gathered)
        glass = [] if state.glass is None else self._draw_glass(state.glass, fitted, [layer for _, _, layer in drawn], gathered)
        views = np.array([matrix for matrix, _, _ in drawn]).reshape(-1, 4, 4)  # none, where lights have shapes and cast no shadow
        state.write(views, np.reshape(scales, (-1, 4)), (thing for thing, _ in gathered[0]), glass)

    def _draw_glass(self, binding: Any, fitted: list[tuple[list[ShadowView], str, int]], layers: Any, gathered: Gathered) -> list[Any]:
        """Draws what dims lights, where it has changed, and lists where it lies. fitted: of each light its views, the name of its map, and
        which of the layers, drawn already, is its first."""
        found, hulls = self._found
        own = id(self._glass), hulls.tobytes(), self._glass.contents(found), self._casters.still, gathered[1].tobytes()
        begin, glass = 0, []
        for i, (views, name, first) in enumerate(fitted):
            side, size, solid = self._sides[name], SIZES[name], layers[first : first + len(views)]
            key = *own, [view.matrix.tobytes() for view in views]
            if binding.filled.pop(i, None) != key:
                self._glass.fill(binding.buffer, begin, side, views, solid, size, found, hulls, True, None)
            binding.filled[i] = key
            glass += [[begin + k * side * side, side, size, 0] for k in range(len(views))]
            begin += len(views) * side * side
        return glass


def surface_views(light: Any, hulls: Matrix, size: int) -> list[ShadowView]:
    """Fits the views of a gfx light's map to hulls (N, 8, 3), world."""
    kind = next(kind for kind in GFX_KINDS if isinstance(light, kind))
    punctual = GFX_KINDS[kind](light, (1.0, 1.0, 1.0), 0.0, {})
    if isinstance(light, gfx.DirectionalLight):
        axes, camera = basis(punctual.axis()), light.shadow.camera
        at = np.asarray(light.world.position, np.float64)
        hulls = hulls if len(hulls) else at + np.zeros((1, 8, 3))
        local = hulls @ axes.T
        box = axes @ at, float(np.hypot(camera.width, camera.height)) / 2 / camera.zoom
        return [orthographic_view(axes, *fit.held_half(local, box), size, local, (0.0, np.inf))]
    views = punctual.shadow_views(np.eye(4), np.eye(4), hulls, resolve(Medium(), March(shadow_size=size), "normal", 1.0))
    share = (size - 2 * fit.MARGIN_TEXELS) / (size - 2 * BORDER)
    return [ShadowView(fit.with_border(view.matrix, size, BORDER), view.span, view.texel * share, view.depth_scale) for view in views]


def _casting(gathered: Gathered) -> Gathered:
    """Leaves those that cast shadows on surfaces, by their cast_shadow."""
    found, hulls = gathered
    kept = [i for i, (thing, _) in enumerate(found) if thing.cast_shadow]
    return [found[i] for i in kept], hulls[kept]
