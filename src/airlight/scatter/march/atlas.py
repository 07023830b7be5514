"""Keeps grids of densities in one texture, from which a sampler interpolates them faster than a shader does from a buffer."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device

Array = np.ndarray
MAX_TEXELS = 2**27  # 512 MiB
GAP = 1  # texels between two grids, of which rounding may let a trace in

Corner = tuple[int, int, int]


def arrange(counts: Sequence[Corner], most: int) -> tuple[Corner, list[Corner]] | None:
    """Stack grids of so many voxels along x, y, z: the size of the texture, and the texels of their first voxels. Along the axis that takes
    least room; None where it would be more than `most` along a side, or more than MAX_TEXELS in all."""
    best = None
    for axis in range(3):
        size = np.max(counts, axis=0)
        ends = np.cumsum([0, *(count[axis] + GAP for count in counts)])
        size[axis] = ends[-1] - GAP
        room = int(np.prod(size, dtype=np.int64))
        if size.max() <= most and room <= MAX_TEXELS and (best is None or room < best[0]):
            best = room, axis, size, ends[:-1]
    if best is None:
        return None
    _, axis, size, ends = best
    corners = np.zeros((len(counts), 3), int)
    corners[:, axis] = ends
    return _three(size), [_three(corner) for corner in corners]


def _three(values: Any) -> Corner:
    return int(values[0]), int(values[1]), int(values[2])


class Atlas:
    """Holds the texture, r32float. corners: texels of the grids' first voxels; none where the grids are in none."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.texture = self._nothing = solid(device, (1, 1, 1), "r16float")
        self.corners: list[Corner] = []
        self._held: list[Array] = []

    def update(self, grids: Sequence[Array]) -> None:
        """Write the grids (Z, Y, X) float32 that are not there yet."""
        counts = [_three(grid.shape[::-1]) for grid in grids]
        found = arrange(counts, self.device.device.limits["max-texture-dimension-3d"]) if grids and filters(self.device) else None
        if found is None:
            self.texture, self.corners, self._held = self._nothing, [], []
            return
        size, corners = found
        had = self._held if corners == self.corners and self.texture.size == size else []
        if not had:
            self.texture, self.corners = solid(self.device, size, "r32float"), corners
        for i, (grid, corner, count) in enumerate(zip(grids, corners, counts, strict=True)):
            if i >= len(had) or had[i] is not grid:
                into, layout = {"texture": self.texture, "origin": corner}, {"bytes_per_row": 4 * count[0], "rows_per_image": count[1]}
                self.device.queue.write_texture(into, np.ascontiguousarray(grid, np.float32), layout, count)
        self._held = list(grids)


def filters(device: Device) -> bool:
    """Tell if samplers interpolate float32."""
    return "float32-filterable" in device.device.features


def solid(device: Device, size: Corner, format: str) -> Any:
    """Create a 3-D texture to sample."""
    usage = device.wgpu.TextureUsage.TEXTURE_BINDING | device.wgpu.TextureUsage.COPY_DST
    return device.device.create_texture(size=size, format=format, dimension="3d", usage=usage)
