"""Draws what dims lights, or colours them, without hiding them: beside the shadow map of each, how far the first surfaces that are seen
through are in each texel, by depth peeling (Everitt 2001), and what is left of the light behind each. pygfx's own pipelines draw it, and
nothing of the scene is touched.
"""

import math
import weakref
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute, timing
from airlight.projection import Matrix
from airlight.pygfx import private, private_panes
from airlight.pygfx.bounds import Bounds
from airlight.pygfx.casters import is_bounded
from airlight.pygfx.lights import SceneLight
from airlight.pygfx.panes import DARKEN, DEPTH, OVER, PREMULTIPLIED, TINT, VEILS, is_opaque, is_seen_through, mode_of
from airlight.pygfx.prepass import shown, silhouette
from airlight.shadows import Shadow, ShadowView, fit

PACK = "pygfx/glass_pack.wgsl"
SIDE = 1024  # texels at most
MOST_BYTES = 2**27  # of a buffer that any device binds
SURFACES = 4  # as in glass.wgsl; the last of them are all that lie behind the others
BYTES = {False: 16, True: 32}  # of a texel, without colours and with them
DIMMING = (OVER, PREMULTIPLIED, TINT, DARKEN)  # ways to be blended by which less light passes


class _Peel(private.Blender):
    """Keeps what the k-th surface takes from the light, and its depth; of the last the sums over all that are there."""

    def __init__(self, k: int) -> None:
        super().__init__(f"glass {k}", "pygfx/cast.wgsl")
        self.last = k == SURFACES - 1

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        added = {"operation": "add", "src_factor": "one", "dst_factor": "one"}
        blend = {"blend": {"color": added, "alpha": added}} if self.last else {}
        return [{"format": "rgba16float", "write_mask": 15, **blend}]

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> dict[str, Any]:
        return {"format": "depth32float", "depth_write_enabled": not self.last, "depth_compare": "always" if self.last else "greater"}


class GlassMaps:
    """Draws the maps of lights over what is seen through: visible meshes that are blended over what is behind them, or tint it.

    A light's map is a buffer, of each view row by row: a texel is four half floats, the depths of the first three surfaces as in a shadow
    map and the mean of the others', and what is left of the light behind each: four unorm16, or, where any surface of the map colours the
    light, four codes of `pack_left`. It is kept while neither the light nor anything that these are drawn from changes.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._bounds = Bounds()
        self._blenders = [_Peel(k) for k in range(SURFACES)]
        self._states: dict[tuple[int, int], Any] = {}  # of a surface's number, and of how it is blended
        self._made: Any = weakref.WeakKeyDictionary()  # object -> material -> its pipelines, one a surface
        self._textures: tuple[Any, ...] = ()  # what surfaces take from the light; their depths
        self._views: list[tuple[Any, Any]] = []
        self._begin = device.buffer(np.zeros(4, np.uint32).tobytes())
        self._buffers: list[Any] = []  # of each light, and what it shows

    def gather(self, scene: Any, exclude: Iterable[Any], lights: Sequence[SceneLight]) -> tuple[list[Any], Matrix]:
        """Gathers what lets light through, and (N, 8, 3) its hulls in the world."""
        bodies = {id(light.target) for light in lights if light.emitter}
        found = [thing for thing in shown(scene, exclude) if id(thing) not in bodies and _passes_light(thing)]
        for thing in found:
            private.update_object(thing)
        hulls = self._bounds.hulls(found)
        placed = np.isfinite(hulls.sum(axis=(1, 2))) & np.ptp(hulls, axis=1).any(axis=1)
        return [thing for thing, kept in zip(found, placed, strict=True) if kept], hulls[placed]

    def draw(self, shadows: Sequence[Shadow], found: Sequence[Any], hulls: Matrix, exact: bool, timer: Timer | None) -> None:
        """Draws and submits the maps of lights, and puts each into its Shadow. exact: for the exact walk, finer ones."""
        del self._buffers[len(shadows) :]
        contents = self.contents(found)
        for i, shadow in enumerate(shadows):
            seen = self._reached(shadow.views, shadow.size, hulls)
            coloured = any(is_coloured(found[j]) for j in {j for own in seen for j in own})
            most = math.isqrt(MOST_BYTES // (BYTES[coloured] * len(shadow.views)))
            side = min(max(shadow.size // (2 if exact else 4), 1), SIDE, most)
            size = BYTES[coloured] * side * side * len(shadow.views)
            if i == len(self._buffers) or self._buffers[i][0].size != size:
                self._buffers[i : i + 1] = [(self.device.buffer(size=size), None)]
            buffer, shown_now = self._buffers[i]
            key = contents, hulls.tobytes(), [view.matrix.tobytes() for view in shadow.views], coloured, shadow.drawn
            shadow.glass, shadow.glass_side, shadow.coloured = buffer, side, coloured
            if shown_now == key:
                continue
            self._buffers[i] = buffer, None  # it may be left unfinished
            one = {"dimension": "2d", "array_layer_count": 1}
            solid = [shadow.texture.create_view(base_array_layer=k, **one) for k in range(len(shadow.views))]
            self.fill(buffer, 0, side, shadow.views, solid, shadow.size, found, hulls, coloured, timer)
            self._buffers[i] = buffer, key

    def contents(self, found: Sequence[Any]) -> list[Any]:
        """Lists what things are drawn from, to tell whether it has changed."""
        return [private.contents(self._pipelines(thing, 0)[0]) for thing in found]

    def fill(
        self,
        buffer: Any,
        begin: int,
        side: int,
        views: Sequence[ShadowView],
        solid: Sequence[Any],
        size: int,
        found: Sequence[Any],
        hulls: Matrix,
        coloured: bool,
        timer: Timer | None,
    ) -> None:
        """Draws and submits maps of side x side texels into a buffer, from a texel of it on. solid: the layers of the shadow map of these
        views, drawn already, of this size."""
        self._fit(side)
        for view, layer, inside in zip(views, solid, self._reached(views, size, hulls), strict=True):
            self.draw_view(fit.clip(view.matrix, size), [found[j] for j in inside], timer)
            self._pack(buffer, begin, layer, side, coloured, timer)
            begin += side * side

    def _reached(self, views: Sequence[ShadowView], size: int, hulls: Matrix) -> list[list[int]]:
        return [np.flatnonzero(fit.reached(view.matrix, size, hulls)).tolist() for view in views]

    def _fit(self, side: int) -> None:
        if self._textures and self._textures[0].size[0] == side:
            return
        usage = self.device.wgpu.TextureUsage
        flags = usage.RENDER_ATTACHMENT | usage.TEXTURE_BINDING
        kinds = "rgba16float", "depth32float"
        self._textures = tuple(self.device.device.create_texture(size=(side, side, SURFACES), format=kind, usage=flags) for kind in kinds)
        one = {"dimension": "2d", "array_layer_count": 1}
        self._views = [tuple(texture.create_view(base_array_layer=k, **one) for texture in self._textures) for k in range(SURFACES)]

    def draw_view(self, clip: Matrix, found: Sequence[Any], timer: Timer | None) -> None:
        """Draws the first surfaces that a view of a light sees, one behind the other."""
        side = self._textures[0].size[0]
        private.write_camera(
            None,
            projection_transform=clip.T,
            projection_transform_inv=np.linalg.inv(clip).T,
            ndc_offset=(1.0, 1.0, 0.0, 0.0),
            physical_size=(side, side),
            logical_size=(side, side),
        )
        encoder = self.device.encoder()
        for k in range(SURFACES):
            drawn = [self._pipelines(thing, k) for thing in found]
            private.upload()
            taken, depths = self._views[k]
            color = {"view": taken, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
            depth = {"view": depths, "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store"}
            run = encoder.begin_render_pass(color_attachments=[color], depth_stencil_attachment=depth, **timing(timer, "glass", encoder))
            for pipelines, state in drawn:
                pipelines.draw(run, state)
            run.end()
        self.device.submit(encoder)

    def _state(self, k: int, mode: int) -> Any:
        base = private.unlit(self._blenders[k])
        if (k, mode) not in self._states or self._states[k, mode].base is not base:
            constants = {"GLASS_FIRST": str(k == 0).lower(), "GLASS_MODE": f"{mode}u"}
            code = private_panes.code_of("pygfx/glass_peel.wgsl", **constants)
            self._states[k, mode] = private_panes.State(base, self._blenders[k], code, (DEPTH,))
        self._states[k, mode].bind(self._views[k - 1][1] if self._views else self._no_depth())  # the first reads none
        return self._states[k, mode]

    def _no_depth(self) -> Any:
        self._fit(1)
        return self._views[0][1]

    def _pipelines(self, thing: Any, k: int) -> tuple[Any, Any]:
        """Finds the pipelines of a thing as the k-th surface, up to date, and their state."""
        mode = mode_of(thing.material.alpha_config) or OVER
        state = self._state(k, mode)
        made = self._made.setdefault(thing, weakref.WeakKeyDictionary()).setdefault(thing.material, {})
        if (k, mode) not in made:
            made[k, mode] = private.Pipelines(silhouette, private.TwoSided)
        made[k, mode].update(thing, state)
        return made[k, mode], state

    def _pack(self, buffer: Any, begin: int, solid: Any, side: int, coloured: bool, timer: Timer | None) -> None:
        """Packs what was drawn into a buffer, from a texel of it on."""
        self.device.queue.write_buffer(self._begin, 0, np.array([begin], np.uint32).tobytes())
        taken, depths = (texture.create_view(dimension="2d-array") for texture in self._textures)
        encoder = self.device.encoder()
        pipeline = self.device.pipeline(PACK, "pack_glass", COLOURED=coloured)
        bind = self.device.bind(PACK, depths, taken, buffer, self._begin, solid)
        compute(encoder, pipeline, bind, (-(-side // 8), -(-side // 8)), "glass", timer)
        self.device.submit(encoder)


def _passes_light(thing: Any) -> bool:
    """Tells whether a mesh dims light by its opacity, or tints it."""
    material = thing.material
    if not isinstance(thing, gfx.Mesh) or material is None or not is_bounded(thing.geometry):
        return False
    return is_seen_through(thing) and not is_opaque(thing) and mode_of(material.alpha_config) in DIMMING


def is_coloured(thing: Any) -> bool:
    """Tells whether light that passes a mesh may be of another colour than before."""
    material = thing.material
    if mode_of(material.alpha_config) not in VEILS:
        return False
    if getattr(material, "map", None) is not None or getattr(thing.geometry, "colors", None) is not None:
        return True
    return len(set(material.color.to_physical()[:3])) > 1
