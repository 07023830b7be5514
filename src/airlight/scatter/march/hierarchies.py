"""Builds the two-level min-max depth hierarchies of shadow maps, which the exact walk steps through."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import parts
from airlight.gpu.timing import Timer, compute

HIERARCHY = "scatter/march/build_hierarchy.wgsl"
GROUP = 8  # invocations along a workgroup
TILE = 8  # texels along a tile of the depth hierarchy, and tiles along a tile of tiles


def tile_count(size: int) -> int:
    """Count the tiles of both levels of the depth hierarchy of one view of a shadow map of size x size."""
    fine, coarse = -(-size // TILE), -(-size // TILE**2)
    return fine * fine + coarse * coarse


class Hierarchies:
    """Holds the hierarchies of shadow maps. buffers: one a map, of the last `fit`."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.buffers: list[Any] = []
        self._row = device.buffer(np.zeros(4, np.uint32).tobytes(), uniform=True)  # of tiles at which a pass begins

    def fit(self, maps: Sequence[Any]) -> None:
        """Allocate a buffer for each map."""
        del self.buffers[len(maps) :]
        for i, texture in enumerate(maps):
            size = 4 * tile_count(texture.size[0]) * texture.size[2]
            if i == len(self.buffers) or self.buffers[i].size != size:
                self.buffers[i : i + 1] = [self.device.buffer(size=size)]

    def record(self, encoder: Any, maps: Sequence[Any], nothing: Any, timer: Timer | None) -> None:
        """Record the passes that build the hierarchy of each map that `fit` had, but of `nothing`."""
        for texture, buffer in zip(maps, self.buffers, strict=True):
            if texture is nothing:
                continue
            size, _, layers = texture.size
            for entry, along in (("fine", TILE), ("coarse", TILE**2)):
                pipeline = self.device.pipeline(HIERARCHY, entry)
                count = -(-size // (along * GROUP))
                bind = self.device.bind(HIERARCHY, texture.create_view(dimension="2d-array"), buffer, self._row)
                for row, down in parts(count, kind=(entry, size)):
                    self.device.queue.write_buffer(self._row, 0, np.array([row * GROUP], np.uint32).tobytes())
                    compute(encoder, pipeline, bind, (count, down, layers), "march tiles", timer)
