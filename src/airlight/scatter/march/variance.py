"""Makes the moments of shadow maps' depths, for variance shadow maps."""

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import parts
from airlight.gpu.timing import Timer, compute

MOMENTS = "scatter/march/moments.wgsl"
PASSES = ("along_rows", "along_columns")
GROUP = 8  # invocations along a workgroup


class Moments:
    """Holds mean and variance of the depths of shadow maps, rg32float, 2-D arrays as they are.

    views: of the texture of each map, in their order. A map of one texel stands for none, and is left alone.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.views: list[Any] = []
        self._made: list[tuple[Any, Any, list[Any]]] = []  # a shadow map, a view of its moments, the bind groups of PASSES
        self._rows: dict[Any, Any] = {}  # of each size of maps, a view of what their rows are averaged into
        self._of: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()  # what moments, by their views, were last made of
        self._row = device.buffer(np.zeros(4, np.uint32).tobytes(), uniform=True)

    def fit(self, shadows: Sequence[Any]) -> None:
        """Allocates moments for the textures of shadow maps."""
        held = {id(made[0]): made for made in self._made}
        self._made = [held[id(shadow)] if id(shadow) in held else self._make(shadow) for shadow in shadows]
        self.views = [view for _, view, _ in self._made]
        sizes = {shadow.size for shadow in shadows}
        self._rows = {size: view for size, view in self._rows.items() if size in sizes}

    def _make(self, shadow: Any) -> tuple[Any, Any, list[Any]]:
        device, view = self.device, self._texture(shadow.size)
        if shadow.size[0] == 1:
            return shadow, view, []
        if shadow.size not in self._rows:
            self._rows[shadow.size] = self._texture(shadow.size)
        rows = self._rows[shadow.size]
        for name in PASSES:
            device.pipeline(MOMENTS, name)  # before its layout is known
        map_view = shadow.create_view(dimension="2d-array")
        binds = [device.bind(MOMENTS, map_view, source, target, self._row) for source, target in ((view, rows), (rows, view))]
        return shadow, view, binds

    def _texture(self, size: tuple[int, int, int]) -> Any:
        """Creates a texture of moments; returns its view."""
        usage = self.device.wgpu.TextureUsage
        flags = usage.STORAGE_BINDING | usage.TEXTURE_BINDING | usage.COPY_SRC
        return self.device.device.create_texture(size=size, format="rg32float", usage=flags).create_view(dimension="2d-array")

    def record(self, encoder: Any, radius: int, drawn: Sequence[Any], timer: Timer | None = None) -> None:
        """Records the passes that average the depths over `radius` texels to each side, but of maps that are as they were.

        drawn: of each map, see Shadow.
        """
        for (shadow, view, binds), now in zip(self._made, drawn, strict=True):
            if now is not None and self._of.get(view) == (now, radius):
                continue
            self._of.pop(view, None)  # they may be left unfinished
            size, _, layers = shadow.size
            count = -(-size // GROUP)
            for name, bind in zip(PASSES, binds, strict=bool(binds)):
                pipeline = self.device.pipeline(MOMENTS, name, RADIUS=radius)
                for row, down in parts(count, kind=("moments", size)):
                    self.device.queue.write_buffer(self._row, 0, np.array([row * GROUP], np.uint32).tobytes())
                    compute(encoder, pipeline, bind, (count, down, layers), "march moments", timer)
            self._of[view] = now, radius
