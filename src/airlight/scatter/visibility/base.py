"""Holds what the tables of visibility of suns and of lamps have in common: their resources, and how these are fitted and bound."""

import math
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.medium.resolve import ResolvedMedium
from airlight.scatter.march.records import LIGHT
from airlight.scatter.visibility.grid import EDGES, WORD, RowGrid

FOLDER = "scatter/visibility"
FARTHEST = f"{FOLDER}/farthest.wgsl"
GRID = struct_dtype(f"{FOLDER}/grid.wgsl", "Grid")
ROOM = 1.25  # factor of what is needed, where a resource is made anew because it was too small
ATLAS_STEP = 256  # texels, that the atlas is a multiple of
TILE_PX = 16  # as in grid.wgsl
GROUP, SQUARE = 64, 8  # invocations of a workgroup, and along one of pixels


class Table:
    """Holds one light's table for pictures of `pixels` (width, height).

    atlas: the texture of what is summed: rows below each other, layers of a row's rays side by side. buffers: by the names of the shaders'
    variables. counts: (blocks, maps).
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self._light = device.buffer(size=LIGHT.itemsize, uniform=True)
        self._grid = device.buffer(size=GRID.itemsize, uniform=True)
        self._parts = [device.buffer(size=16, uniform=True) for _ in EDGES]
        self.buffers: dict[str, Any] = {}
        self.atlas: Any = None
        across, down = (-(-side // TILE_PX) for side in pixels)
        self._tiles = [device.texture(across, down, "r32float") for _ in range(2)]
        self._binds: dict[Any, tuple[tuple[Any, ...], Any]] = {}
        self._shadow: Any = None
        self._core = device.buffer(size=24, uniform=True)
        self._core_groups = (0, 0)
        self._dispatches: list[tuple[int, int, int]] = []  # of each edge: its number, rows, words
        self.counts = (0, 0)

    def _fit(self, rows: RowGrid, count: int, blocks: int, layers: int, row_size: int, room: int) -> int:
        """Makes resources that are too small anew; returns the bytes that are taken: 0 where they are more than `room`, or a texture would
        be too large. count: of rows, of all maps; layers: of the atlas; row_size: bytes of a row's record."""
        words = rows.words
        atlas = int(rows.rays.max()) * layers, count
        sizes = {
            "rows": count * row_size,
            "planes": blocks * words * count * 16,
            "ray_ends": words * WORD * count * 4,
            "word_ends": words * count * 4,
        }
        wide, high = (-(-side // ATLAS_STEP) * ATLAS_STEP for side in atlas)
        total = int(wide * high * 8 + ROOM * sum(sizes.values()))
        largest = self.device.device.limits["max-storage-buffer-binding-size"]
        if total > room or max(wide, high) > self.device.max_side or sizes["planes"] > largest:
            return 0
        for name, need in sizes.items():
            if name not in self.buffers or self.buffers[name].size < need:
                self.buffers[name] = self.device.buffer(size=-(-min(int(ROOM * need), largest) // 16) * 16)
        if self.atlas is None or self.atlas.size[:2] != (wide, high):  # its size rounds where it is read: none but this frame counts
            self.atlas = self.device.texture(wide, high, "rgba16float")
        return total

    def _grid_record(self, rows: RowGrid, count: int, layers: int, medium: ResolvedMedium) -> np.ndarray:
        """Fills a GRID but for its maps."""
        out = np.zeros((), GRID)
        out["offset"], out["slope"], out["rate"] = rows.offset, rows.slope, rows.rate
        out["count"], out["layers"], out["words"] = count, layers, rows.words
        out["first"], out["rays"] = rows.first, rows.rays
        out["middle"], out["spread"] = (medium.sigma_t.max() + medium.sigma_t.min()) / 2, np.ptp(medium.sigma_t)
        out["tiles_about"] = math.ceil(rows.apart / TILE_PX)
        out["atlas_texel"] = 1 / np.array(self.atlas.size[:2], float)
        return out

    def _divide(self, rows: RowGrid) -> None:
        """Divides the rows by the edges through which they leave: those of one have as many words."""
        self._dispatches = []
        for k, (first, last) in enumerate(zip(rows.first.tolist(), rows.last.tolist(), strict=True)):
            if last >= first:
                part = np.array([first, last - first + 1, len(rows.begin), 0], np.uint32)
                self.device.queue.write_buffer(self._parts[k], 0, part.tobytes())
                self._dispatches.append((k, last - first + 1, int(rows.rays[k]) // WORD))

    def _place_core(self, rows: RowGrid, radius: float) -> tuple[int, int]:
        """Places the pixels up to so many around the epipole that are walked; returns the workgroups that hold them."""
        epipole, size = rows.epipole, np.array(self.pixels, float)
        low = np.clip(np.floor(epipole - radius), 0, size).astype(int)
        high = np.clip(np.ceil(epipole + radius), 0, size).astype(int)
        if (high <= low).any():
            return 0, 0
        data = np.array(epipole, np.float32).tobytes() + np.array(low, np.uint32).tobytes() + np.array([radius, 0], np.float32).tobytes()
        self.device.queue.write_buffer(self._core, 0, data)
        across, down = (-(-(high - low) // SQUARE)).tolist()
        return across, down

    def _record_farthest(self, encoder: Any, bound: tuple[Any, ...], before: Any, timer: Timer | None) -> Any:
        """Records how far the picture sees around its tiles; returns the texture of it. bound: what all shaders of tables bind first."""
        folded, spread = self._tiles
        squares = tuple(-(-side // (TILE_PX * SQUARE)) for side in self.pixels)
        for entry, source, target in (("fold", before, folded), ("spread", folded, spread)):
            pipeline = self.device.pipeline(FARTHEST, entry)
            bind = self._bound((FARTHEST, entry), FARTHEST, *bound, source, target, self.device.sampler("nearest"))
            compute(encoder, pipeline, bind, squares, "table ends", timer)
        return spread

    def _bound(self, key: Any, path: str, *parts: Any) -> Any:
        """Makes a bind group, or keeps it while `parts` are the same."""
        had = self._binds.get(key)
        if had is None or any(a is not b for a, b in zip(had[0], parts, strict=True)):
            seen = [part.create_view(dimension="2d-array") if part is self._shadow else part for part in parts]
            had = self._binds[key] = parts, self.device.bind(path, *seen)
        return had[1]
