"""Draws what dims lights without hiding them: beside the shadow map of each, how far the first four surfaces that are seen through are in
each texel, by depth peeling (Everitt 2001), and what is left of the light behind each. pygfx's own pipelines draw it, and nothing of the
scene is touched.
"""

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
from airlight.pygfx.panes import DEPTH, OVER, PREMULTIPLIED, is_opaque, is_seen_through, mode_of
from airlight.pygfx.prepass import shown, silhouette
from airlight.shadows import Shadow, fit

PACK = "pygfx/glass_pack.wgsl"
SIDE = 1024  # texels at most
SURFACES = 4  # as in glass.wgsl
BYTES = 16  # of a texel


class _Peel(private.Blender):
    """Keeps what the k-th surface lets through, and its depth."""

    def __init__(self, k: int) -> None:
        super().__init__(f"glass {k}", "pygfx/cast.wgsl")
        self.k = k

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        return [{"format": "rgba16float", "write_mask": 1 << self.k}]

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> dict[str, Any]:
        return {"format": "depth32float", "depth_write_enabled": True, "depth_compare": "greater"}


class GlassMaps:
    """Draws the maps of lights over what is seen through: visible meshes that are blended over what is behind them.

    A light's map is a buffer, of each view row by row: a texel is four half floats, the depths of the first surfaces as in a shadow map,
    and four unorm16, what is left of the light behind each. It is kept while neither the light nor anything that these are drawn from
    changes.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._bounds = Bounds()
        self._blenders = [_Peel(k) for k in range(SURFACES)]
        self._states: dict[int, Any] = {}
        self._made: Any = weakref.WeakKeyDictionary()  # object -> material -> its pipelines, one a surface
        self._textures: tuple[Any, ...] = ()  # passed; depths of surfaces
        self._views: list[Any] = []
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
        contents = [self.contents(thing) for thing in found]
        for i, shadow in enumerate(shadows):
            side = min(max(shadow.size // (2 if exact else 4), 1), SIDE)
            size = BYTES * side * side * len(shadow.views)
            if i == len(self._buffers) or self._buffers[i][0].size != size:
                self._buffers[i : i + 1] = [(self.device.buffer(size=size), None)]
            buffer, shown_now = self._buffers[i]
            key = contents, hulls.tobytes(), [view.matrix.tobytes() for view in shadow.views]
            shadow.glass, shadow.glass_side = buffer, side
            if shown_now == key:
                continue
            self._buffers[i] = buffer, None  # it may be left unfinished
            self._fit(side)
            for number, view in enumerate(shadow.views):
                inside = [found[j] for j in np.flatnonzero(fit.reached(view.matrix, shadow.size, hulls)).tolist()]
                self.draw_view(fit.clip(view.matrix, shadow.size), inside, timer)
                self._pack(buffer, number * side * side, side, timer)
            self._buffers[i] = buffer, key

    def contents(self, thing: Any) -> list[Any]:
        """Lists what a thing's part of a map is drawn from: as long as that is equal, so is the part."""
        return private.contents(self._pipelines(thing, 0, self._state(0)))

    def _fit(self, side: int) -> None:
        if self._textures and self._textures[0].size[0] == side:
            return
        usage = self.device.wgpu.TextureUsage
        flags = usage.RENDER_ATTACHMENT | usage.TEXTURE_BINDING
        depths = self.device.device.create_texture(size=(side, side, SURFACES), format="depth32float", usage=flags)
        self._textures = self.device.texture(side, side, "rgba16float"), depths
        self._views = [depths.create_view(dimension="2d", base_array_layer=k, array_layer_count=1) for k in range(SURFACES)]

    def draw_view(self, clip: Matrix, found: Sequence[Any], timer: Timer | None) -> None:
        """Draws the first surfaces that a view of a light sees, one behind the other."""
        passed, _ = self._textures
        side = passed.size[0]
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
            state = self._state(k)
            state.bind(self._views[k - 1])  # the first reads none
            drawn = [self._pipelines(thing, k, state) for thing in found]
            private.upload()
            color = {"view": passed.create_view(), "load_op": "load" if k else "clear", "store_op": "store", "clear_value": (1, 1, 1, 1)}
            depth = {"view": self._views[k], "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store"}
            run = encoder.begin_render_pass(color_attachments=[color], depth_stencil_attachment=depth, **timing(timer, "glass", encoder))
            for pipelines in drawn:
                pipelines.draw(run, state)
            run.end()
        self.device.submit(encoder)

    def _state(self, k: int) -> Any:
        base = private.unlit(self._blenders[k])
        if k not in self._states or self._states[k].base is not base:
            code = private_panes.code_of("pygfx/glass_peel.wgsl", GLASS_FIRST=str(k == 0).lower())
            self._states[k] = private_panes.State(base, self._blenders[k], code, (DEPTH,))
        return self._states[k]

    def _pipelines(self, thing: Any, k: int, state: Any) -> Any:
        made = self._made.setdefault(thing, weakref.WeakKeyDictionary()).setdefault(thing.material, {})
        if k not in made:
            made[k] = private.Pipelines(silhouette, private.TwoSided)
        made[k].update(thing, state)
        return made[k]

    def _pack(self, buffer: Any, begin: int, side: int, timer: Timer | None) -> None:
        """Packs what was drawn into a buffer, from a texel of it on."""
        self.device.queue.write_buffer(self._begin, 0, np.array([begin], np.uint32).tobytes())
        passed, depths = self._textures
        encoder = self.device.encoder()
        pipeline = self.device.pipeline(PACK, "pack_glass")
        bind = self.device.bind(PACK, depths.create_view(dimension="2d-array"), passed, buffer, self._begin)
        compute(encoder, pipeline, bind, (-(-side // 8), -(-side // 8)), "glass", timer)
        self.device.submit(encoder)


def _passes_light(thing: Any) -> bool:
    """Tells whether a mesh dims light by its opacity."""
    material = thing.material
    if not isinstance(thing, gfx.Mesh) or material is None or not is_bounded(thing.geometry):
        return False
    return is_seen_through(thing) and not is_opaque(thing) and mode_of(material.alpha_config) in (OVER, PREMULTIPLIED)
