"""Makes the moments of shadow maps' depths, for variance shadow maps."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import parts
from airlight.gpu.timing import Timer, compute

MOMENTS = "scatter/march/moments.wgsl"
TILE = 16  # texels along what a workgroup writes


class Moments:
    """Holds mean and variance of the depths of shadow maps, rg32float, 2-D arrays as they are.

    views: of the texture of each map; of one texel where there is no map.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.views: list[Any] = []
        self._made: list[tuple[Any, Any, Any]] = []  # a shadow map, its moments, their bind group
        self._row = device.buffer(np.zeros(4, np.uint32).tobytes(), uniform=True)

    def fit(self, shadows: Sequence[Any]) -> None:
        """Allocates moments for the textures of shadow maps; of those of one texel, or none, they are never read."""
        held = {id(shadow): (shadow, made, bind) for shadow, made, bind in self._made}
        self._made = [held[id(shadow)] if id(shadow) in held else self._make(shadow) for shadow in shadows]
        self.views = [made for _, made, _ in self._made]

    def _make(self, shadow: Any) -> tuple[Any, Any, Any]:
        usage = self.device.wgpu.TextureUsage
        texture = self.device.device.create_texture(
            size=shadow.size, format="rg32float", usage=usage.STORAGE_BINDING | usage.TEXTURE_BINDING | usage.COPY_SRC
        )
        view = texture.create_view(dimension="2d-array")
        self.device.pipeline(MOMENTS, "average")  # before its layout is known
        return shadow, view, self.device.bind(MOMENTS, shadow.create_view(dimension="2d-array"), view, self._row)

    def record(self, encoder: Any, radius: int, timer: Timer | None = None) -> None:
        """Records the passes that average the depths over `radius` texels to each side."""
        pipeline = self.device.pipeline(MOMENTS, "average", RADIUS=radius)
        for shadow, _, bind in self._made:
            size, _, layers = shadow.size
            count = -(-size // TILE)
            for row, down in parts(count, kind=("moments", size)) if size > 1 else ():
                self.device.queue.write_buffer(self._row, 0, np.array([row], np.uint32).tobytes())
                compute(encoder, pipeline, bind, (count, down, layers), "march moments", timer)
