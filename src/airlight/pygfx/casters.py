"""Draws shadow maps of our own: a scene's depths as its lights see them, by pygfx's own pipelines, so that poses, instances, bones, morph
targets and the holes of alpha tests are followed. Where the maps lie: `airlight.lights`. Nothing of the scene is touched.
"""

import weakref
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.slices import current, parts
from airlight.gpu.timing import Timer, timing
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import Matrix
from airlight.pygfx import private
from airlight.pygfx.bounds import Bounds
from airlight.pygfx.lights import SceneLight
from airlight.pygfx.prepass import pattern, shown, silhouette, solid, strength
from airlight.pygfx.punctual import GFX_KINDS
from airlight.shadows import Shadow, fit

FORMAT = "depth32float"
BAND = 1024  # texels of a map's height that are drawn at once, in work that is done in slices
HALF_TEXEL = 0.5  # of the slope of depth over a texel, along x or y, whichever is more


class Role(private.Blender):
    """Says how casters of one kind are drawn.

    sloped: nearer to the light by half a texel's slope, as a surface is at a texel's border, so that its dark side is dark in all of it.
    """

    def __init__(self, name: str, output: str, sloped: bool = False) -> None:
        super().__init__(name + (" sloped" if sloped else ""), output)
        self.sloped = Role(name, output, sloped=True) if not sloped else self

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        return []

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> dict[str, Any]:
        bias = {"depth_bias_slope_scale": HALF_TEXEL} if self.sloped is self else {}
        return {"format": FORMAT, "depth_write_enabled": True, "depth_compare": "greater", **bias}


Gathered = tuple[list[tuple[Any, Role]], Matrix]  # casters with their roles, and (N, 8, 3), their hulls in the world
BLENDED = ("auto", "blend", "weighted_blend", "dither", "bayer")  # by alpha, over what is behind
CAST = Role("casters", "pygfx/cast.wgsl")
HALF = Role("casters by halves", "pygfx/cast_half.wgsl")
OPAQUE = Role("casters where opaque", "pygfx/cast_opaque.wgsl")


def role(mesh: Any, material: Any) -> Role | None:
    """Chooses how a mesh casts; None where one sees through all of it, or where it is told to write no depth, as skies are.

    What pygfx blends though it may well be solid ("auto" with a map that has an alpha) casts where that is at least a half, and what is
    meant to be blended where it is opaque, as leaves are whose edges alone are soft; or where its alpha test says, if it writes depth.
    """
    if not material.depth_write and (material.depth_write_is_set or material.alpha_method == "opaque"):
        return None
    if solid(mesh, material):
        return CAST
    mode = material.alpha_mode
    if mode not in BLENDED or material.opacity < 1 or getattr(getattr(material, "color", None), "a", 1.0) < 1:
        return None
    if private.alpha_tested(material) and material.depth_write:
        return CAST
    if mode == "auto":
        return HALF
    return OPAQUE if pattern(mesh, material) else CAST


# layer, while its map is there -> what it holds, whichever Casters drew it: those of surfaces are shared by renderers
_drawn: Any = weakref.WeakKeyDictionary()


class Casters:
    """Draws the shadow maps of lights over a scene's casters.

    These are its visible meshes, where they are solid (see `role`), whatever their cast_shadow says; not pygfx's helpers, nor what is in
    `exclude` or below it, nor the bodies of lights: emitters that are targets of `lights`, and what glows around a gfx light
    that is below or right above it. Both sides cast. scene, lights, exclude may be set at any time.
    """

    def __init__(self, device: Any, scene: Any, lights: Sequence[SceneLight] = (), exclude: Iterable[Any] = ()) -> None:
        self.device = Device.of(device)
        self.scene, self.lights, self.exclude = scene, lights, exclude
        self._bounds = Bounds()
        self._made: Any = weakref.WeakKeyDictionary()  # object -> material -> role -> its pipelines
        self._states: dict[Role, Any] = {}  # kept, or they would be made anew each time
        self.still: Any = None  # says what casters are like: layers are kept while it does and none moves; None: all are drawn anew
        self._maps: list[tuple[Any, list[Any]]] = []  # texture, a view of each layer

    def draw(
        self,
        view: Any,
        projection: Any,
        lights: Sequence[PunctualLight],
        medium: ResolvedMedium,
        timer: Timer | None = None,
        gathered: Gathered | None = None,
        glass: Matrix | None = None,
    ) -> list[Shadow]:
        """Draws and submits a shadow map for each light, for a camera with matrices view (world to view space) and projection (to clip
        space). gathered: what `gather` gave for this frame; glass: (N, 8, 3) hulls of what dims light, which the maps hold too. The
        textures stay while their size and number do. Raises AirlightError where the device makes none so large."""
        found, hulls = gathered or self.gather()
        size = medium.shadow_size
        self._fit(size, [light.shadow_layers(medium) for light in lights])
        shadows = []
        drawn: list[tuple[Matrix, int, Any]] = []
        for light, (texture, layers) in zip(lights, self._maps):
            views = light.shadow_views(view, projection, hulls if glass is None else np.concatenate([hulls, glass]), medium)
            drawn += [(one.matrix, size, layer) for one, layer in zip(views, layers)]
            shadows.append(Shadow(texture, size, views))
        self.draw_layers(drawn, ([(mesh, role.sloped) for mesh, role in found], hulls), timer)
        for shadow, (_, layers) in zip(shadows, self._maps, strict=True):
            keys = [_drawn.get(layer) for layer in layers[: len(shadow.views)]]
            shadow.drawn = None if None in keys else keys
        return shadows

    def draw_layers(self, layers: Sequence[tuple[Matrix, int, Any]], gathered: Gathered, timer: Timer | None = None) -> None:
        """Draws and submits layers of shadow maps: the matrix of a ShadowView, the map's side, a view of the layer's texture."""
        found, hulls = gathered
        states = self._states = {role: private.unlit(role) for role in {role for _, role in found}}
        drawn: list[tuple[Any, Any]] = []
        for mesh, role in found:
            made = self._made.setdefault(mesh, weakref.WeakKeyDictionary()).setdefault(mesh.material, {})
            if role not in made:
                made[role] = private.Pipelines(silhouette, private.TwoSided)
            made[role].update(mesh, states[role])
            drawn.append((made[role], states[role]))
        for matrix, size, layer in layers:
            inside = np.flatnonzero(fit.reached(matrix, size, hulls))
            now = [drawn[i] for i in inside]
            # pipelines are of a mesh with its material: whatever is shown, hidden, moved or made anew differs, said to be still or not
            key = self.still, matrix.tobytes(), hulls[inside].tobytes(), [pipelines for pipelines, _ in now]
            if self.still is not None and _drawn.get(layer) == key:
                continue
            _drawn.pop(layer, None)  # it may be left unfinished
            self.draw_layer(fit.clip(matrix, size), size, layer, now, timer)
            if self.still is not None:
                _drawn[layer] = key

    def _fit(self, size: int, counts: Sequence[int]) -> None:
        """Allocates a texture of `size` for each light, with so many layers."""
        if size > self.device.max_side:
            raise AirlightError(f"shadow_size {size}: this device makes no texture larger than {self.device.max_side}; set that or less")
        del self._maps[len(counts) :]
        usage = self.device.wgpu.TextureUsage
        flags = usage.RENDER_ATTACHMENT | usage.TEXTURE_BINDING | usage.COPY_SRC
        for i, count in enumerate(counts):
            if i < len(self._maps) and self._maps[i][0].size == (size, size, count):
                continue
            texture = self.device.device.create_texture(size=(size, size, count), format=FORMAT, usage=flags)
            one = {"dimension": "2d", "array_layer_count": 1}
            self._maps[i : i + 1] = [(texture, [texture.create_view(base_array_layer=layer, **one) for layer in range(count)])]

    def draw_layer(self, clip: Matrix, size: int, layer: Any, drawn: list[tuple[Any, Any]], timer: Timer | None) -> None:
        """Draw a layer. clip: world to clip space, in the buffer that all pygfx's shaders share; so each layer is submitted by itself."""
        private.write_camera(
            None,
            projection_transform=clip.T,
            projection_transform_inv=np.linalg.inv(clip).T,
            ndc_offset=(1.0, 1.0, 0.0, 0.0),
            physical_size=(size, size),
            logical_size=(size, size),
        )
        private.upload()
        encoder = self.device.encoder()
        target = {"view": layer, "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store"}
        band = BAND if current() else size
        for top in range(0, size, band):
            for first, count in parts(len(drawn), kind=("casters", size)) if drawn else [(0, 0)]:
                run = encoder.begin_render_pass(color_attachments=[], depth_stencil_attachment=target, **timing(timer, "shadows", encoder))
                run.set_scissor_rect(0, top, size, min(band, size - top))
                for pipelines, state in drawn[first : first + count]:
                    pipelines.draw(run, state)
                run.end()
                encoder.divide()
                target["depth_load_op"] = "load"
        self.device.submit(encoder)

    def gather(self) -> Gathered:
        """Gathers the casters as they are now."""
        found, lights = [], []
        for thing in shown(self.scene, self.exclude):
            if isinstance(thing, tuple(GFX_KINDS)):
                lights.append(thing)
            elif isinstance(thing, gfx.Mesh) and thing.material is not None and is_bounded(thing.geometry):
                own = role(thing, thing.material)
                if own is not None:
                    found.append((thing, own))
        for thing, _ in found:
            private.update_object(thing)
        hulls = self._bounds.hulls([thing for thing, _ in found])
        bodies = {id(light.target) for light in self.lights if light.emitter}
        bodies |= self._glowing(found, hulls, lights)
        placed = np.isfinite(hulls.sum(axis=(1, 2))) & np.ptp(hulls, axis=1).any(axis=1)  # not nowhere, nor scaled to a point
        kept = [i for i, (thing, _) in enumerate(found) if placed[i] and id(thing) not in bodies]
        return [found[i] for i in kept], hulls[kept]

    def _glowing(self, found: list[tuple[Any, Role]], hulls: Matrix, lights: list[Any]) -> set[int]:
        """Finds the ids of the meshes that glow and have a light in them which is below, or right above."""
        at = {id(thing): i for i, (thing, _) in enumerate(found)}
        bodies: set[int] = set()
        for light in lights:
            near = list(light.children)
            above = light.parent
            while above is not None:
                near.append(above)
                above = above.parent
            for thing in near:
                i = at.get(id(thing))
                if i is not None and strength(thing.material) != 0:
                    position = light.world.position
                    if (hulls[i].min(axis=0) <= position).all() and (position <= hulls[i].max(axis=0)).all():
                        bodies.add(id(thing))
        return bodies


def height(gathered: Gathered) -> float | None:
    """Measures the height of what casts, m; None where nothing does."""
    return float(np.ptp(gathered[1][..., 1])) if len(gathered[1]) else None


def is_bounded(geometry: Any) -> bool:
    """Tells whether a geometry has vertices."""
    positions = getattr(geometry, "positions", None)
    return positions is not None and positions.data is not None and len(positions.data) > 0
