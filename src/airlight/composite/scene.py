"""Composites a layer with the picture of a rendered scene, on the GPU: exposure, light adaptation, extinction, view
transform, debug views."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.composite import view
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute, divide, timing

BALANCE, MERGE = "composite/balance.wgsl", "composite/scene_merge.wgsl"
UNIFORMS = struct_dtype("composite/scene_uniforms.wgsl", "SceneUniforms")
MAX_LIGHTS: int = UNIFORMS["aim"].shape[0]
DEBUG_VIEWS = {None: 0, "occlusion": 1, "source": 2, "lines": 3}  # numbered as in scene_merge.wgsl
MEASURED_PIXELS = 14400  # about, of a picture, by adaptation


@dataclass(frozen=True)
class SceneLayer:
    """Holds the textures that a method has made for a scene; the others are None.

    Of a screen method: source and shafts, rgba16float, of any size. Of a medium, of the picture's size: radiance, in-scattered, and
    transmittance, RGB; None where that is 1 everywhere.
    """

    source: Any = None
    shafts: Any = None
    radiance: Any = None
    transmittance: Any = None


@dataclass(frozen=True)
class SceneCompositeSettings:
    """Says how a layer is composited: override constants of scene.wgsl and scene_merge.wgsl.

    is_lit: whether a light is seen; contrast, gather: of shafts; extinction: whether a medium attenuates surfaces; done: whether the
    picture holds a medium's layer already; adapt: whether light
    adaptation is on; expose: whether the exposure is other than 1; view_transform: its name; debug: one of DEBUG_VIEWS.
    """

    is_lit: bool = False
    contrast: bool = False
    gather: bool = False
    extinction: bool = False
    done: bool = False
    adapt: bool = False
    expose: bool = False
    view_transform: str = "none"
    debug: str | None = None


def measured_step(size: tuple[int, int]) -> int:
    """Returns n, where every n-th row and column of a picture of this size is measured."""
    return max(1, int(math.sqrt(size[0] * size[1] / MEASURED_PIXELS)))


class SceneComposite:
    """Records the passes that put a layer on a picture. uniforms: a buffer of UNIFORMS.

    looked: buffer of what pygfx/look.wgsl measures of the picture, for contrast. balance: buffer of (scale, white; average, least, greatest
    in stops) of light adaptation; has_balance: whether it holds a frame's.
    """

    def __init__(self, device: Device, uniforms: Any) -> None:
        self.device, self.uniforms = device, uniforms
        self.looked, self.balance = device.buffer(size=32), device.buffer(size=32)
        self.has_balance = False
        self._tables: dict[str, Any] = {}  # of view transforms, by name; "": one that none needs
        self._layer: SceneLayer | None = None  # that is bound
        self._binds: dict[Any, Any] = {}

    def record(
        self,
        encoder: Any,
        color: Any,
        depth: Any,
        layer: SceneLayer,
        settings: SceneCompositeSettings,
        target: Any,
        timer: Timer | None = None,
    ) -> None:
        """Records the passes, from the picture's color and depth, textures, to target, a view."""
        device, format = self.device, target.texture.format
        transform = view.number(settings.view_transform)
        last = {"ADAPT": settings.adapt, "EXPOSE": settings.expose, "VIEW": transform, "SHOW": DEBUG_VIEWS[settings.debug]}
        merging: dict[str, Any] = {"LIT": settings.is_lit, "CONTRAST": settings.contrast, "GATHER": settings.gather}
        if layer.radiance is not None:
            merging = {"MEDIUM": True, "EXTINCTION": settings.extinction and layer.transmittance is not None, "DONE": settings.done}
        else:  # before it is wanted
            device.raster(MERGE, "cover", "merge", format, **(merging | {"LIT": not settings.is_lit}), **last)
        measure = device.pipeline(BALANCE, "measure", STEP=measured_step(color.size[:2]), **merging)
        merge = device.raster(MERGE, "cover", "merge", format, **merging, **last)
        measure_bind, merge_bind = self._bound(color, depth, layer, settings.view_transform if transform == view.TABLE else "")
        if settings.adapt:
            compute(encoder, measure, measure_bind, (1, 1), "adapt", timer)
            self.has_balance = True
        attachment = {"view": target, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        run = encoder.begin_render_pass(color_attachments=[attachment], **timing(timer, "merge", encoder))
        run.set_pipeline(merge)
        run.set_bind_group(0, merge_bind)
        run.draw(3)
        run.end()
        divide(encoder)

    def _table(self, name: str) -> Any:
        """Uploads the table of a view transform; of "" a texel."""
        if name not in self._tables:
            codes = view.table(name) if name else np.zeros((1, 1, 1, 4), np.float16)
            side, usage = codes.shape[0], self.device.wgpu.TextureUsage
            texture = self.device.device.create_texture(
                size=(side, side, side), dimension="3d", format="rgba16float", usage=usage.TEXTURE_BINDING | usage.COPY_DST
            )
            layout = {"bytes_per_row": side * 8, "rows_per_image": side}
            self.device.queue.write_texture({"texture": texture}, codes, layout, (side, side, side))
            self._tables[name] = texture
        return self._tables[name]

    def shared(self, color: Any, depth: Any, layer: SceneLayer) -> tuple[Any, ...]:
        """Lists what scene.wgsl binds, bindings 0 to 8; where a layer has no such texture, none is read, and the picture stands there."""
        parts = layer.shafts, layer.radiance, layer.transmittance
        shafts, radiance, transmittance = (color if part is None else part for part in parts)
        return self.uniforms, color, depth, shafts, self.device.sampler(), self.looked, radiance, self.balance, transmittance

    def _bound(self, color: Any, depth: Any, layer: SceneLayer, view_transform: str) -> tuple[Any, Any]:
        """Makes the bind groups for the renderer's textures once for each of the two that it draws on in turn."""
        key = id(color), id(depth), view_transform
        if layer != self._layer or (key not in self._binds and len(self._binds) > 3):
            self._layer = layer
            self._binds.clear()
        if key not in self._binds:
            device, source = self.device, color if layer.source is None else layer.source
            shared = self.shared(color, depth, layer)
            # all are held, so that no id is used again
            self._binds[key] = shared, device.bind(BALANCE, *shared), device.bind(MERGE, *shared, source, self._table(view_transform))
        _, measure, merge = self._binds[key]
        return measure, merge
