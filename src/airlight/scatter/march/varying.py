"""Keeps on the device what of a medium's density varies: voxels, and the tables of what dims each light."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.lights.punctual import PunctualLight
from airlight.medium.field import BLENDS
from airlight.medium.noise import noise_record
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import eye_rays
from airlight.scatter.march.atlas import Atlas, filters, solid
from airlight.scatter.march.shade import Shade, fit_shade

FIELD = struct_dtype("scatter/march/field.wgsl", "Field")
MAX_GRIDS = FIELD["grids"].shape[0]
UNBOUND = 1e9  # index
Array = np.ndarray


@dataclass(frozen=True)
class Dimming:
    """Says what dims a light on its way through a density that varies.

    shade: where its table lies; None: nothing but closed forms dims it. is_texture: whether the table is in a texture too. resources: what
    shade.wgsl reads but a cookie, by the numbers of their bindings.
    """

    shade: Shade | None
    is_texture: bool
    resources: dict[int, Any]


class Varying:
    """Holds the buffers of a march through a density that varies.

    record: of scatter/march/field.wgsl's Field. voxels: all grids' densities, float32, one after the other. atlas: of them, for steps.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.record = device.buffer(size=FIELD.itemsize, uniform=True)
        self.voxels = device.buffer(size=16)
        self.atlas = Atlas(device)
        self.no_table = solid(device, (1, 1, 1), "r16float")  # stands where a light's is in no texture
        self._held: list[tuple[Any, int]] = []  # densities that were written, and their first voxels
        self._filled: list[Any] = []  # densities, and where they are more than 0
        self._tables: list[tuple[Any, Any, Any]] = []  # a buffer of each light, a texture of the same, and what is in them

    def update(self, view: Any, projection: Any, width: int, medium: ResolvedMedium) -> None:
        """Write what the next march sees: view (4, 4) from what is drawn to view space; width: pixels across. Raises AirlightError."""
        self._write_voxels(medium)
        self.atlas.update([] if medium.exact else [field.volume.density for field in medium.fields])
        out = np.zeros((), FIELD)
        rays, flat = eye_rays(projection)
        wide = abs(float(rays[0])) / width
        out["pixel"], out["flat_pixel"] = wide * (1 - flat), wide * flat
        into = np.linalg.inv(np.asarray(view, np.float64))
        m = medium.settings
        eye = into[:3, 3] + medium.origin
        for name, value in noise_record(eye, m.wind, medium.time, medium.noise_size, m.noise_seed, m.noise_amount, m.noise_octaves).items():
            out["noise"][name] = value
        out["noise_rows"][:, :3] = into[:3, :3]
        for at, field, (_, first) in zip(out["grids"], medium.fields, self._held):
            at["rows"] = (index_rows(field.volume.matrix, medium.origin) @ into)[:3]
            at["count"], at["first"] = field.volume.density.shape[::-1], first
            slabs = self._slabs(field.volume.density) if field.blend in ("add", "max") else np.array([[-UNBOUND] * 3, [UNBOUND] * 3] * 2)
            at["low_sums"], at["high_sums"], at["low_differences"], at["high_differences"] = slabs
            at["factor"], at["edge"], at["blend"] = field.factor, field.volume.edge, BLENDS.index(field.blend)
        if self.atlas.corners:
            texel = 1 / np.array(self.atlas.texture.size, float)
            out["atlas_texel"] = texel
            for at, corner in zip(out["grids"], self.atlas.corners):
                at["corner"] = (np.array(corner) + 0.5) * texel
        self.device.queue.write_buffer(self.record, 0, out.tobytes())

    def _slabs(self, density: Array) -> Array:
        """Bound what is in a grid, once for each."""
        for had, slabs in self._filled:
            if had is density:
                return np.asarray(slabs)
        self._filled = [*self._filled[1 - MAX_GRIDS :], (density, slabs_of(density))]
        return np.asarray(self._filled[-1][1])

    def _write_voxels(self, medium: ResolvedMedium) -> None:
        """Write the densities that are not there yet."""
        wanted = [field.volume.density for field in medium.fields]
        if len(wanted) == len(self._held) and all(a is b for a, (b, _) in zip(wanted, self._held, strict=True)):
            return
        if len(wanted) > MAX_GRIDS:
            raise AirlightError(f"{len(wanted)} volumes are more than the {MAX_GRIDS} that a medium takes; leave some out")
        ends = np.cumsum([0, *(density.size for density in wanted)])
        size, most = 4 * int(ends[-1]), self.device.device.limits["max-storage-buffer-binding-size"]
        if size > most:
            raise AirlightError(
                f"{ends[-1]:,} voxels of {len(wanted)} volumes are more than this adapter's {most // 4:,}; leave some out, or coarsen them"
            )
        if self.voxels.size != max(size, 16):
            self.voxels, self._held = self.device.buffer(size=max(size, 16)), []
        for i, density in enumerate(wanted):
            first = int(ends[i])
            if i >= len(self._held) or self._held[i][0] is not density or self._held[i][1] != first:
                self.device.queue.write_buffer(self.voxels, 4 * first, np.ascontiguousarray(density, np.float32))
        self._held = [(density, int(first)) for density, first in zip(wanted, ends[:-1], strict=True)]

    def table(self, i: int, light: PunctualLight, medium: ResolvedMedium, region: Array | None) -> tuple[Shade | None, Any, Any, Any]:
        """Fit the i-th light's table: (where it lies, its buffer, its texture, None or what they have to be filled for, see `filled`). The
        texture is `no_table` for the exact walk, and where samplers do not interpolate. region: (2, 3), as it is drawn, where the air
        varies."""
        box = bounds(medium, region)
        shade = None if box is None else fit_shade(light, medium, box)
        while len(self._tables) <= i:
            self._tables.append((self.device.buffer(size=16), self.no_table, None))
        buffer, texture, had = self._tables[i]
        if shade is None:
            return None, buffer, self.no_table, None
        m = medium.settings
        noise = (m.noise_amount, medium.noise_size, m.noise_octaves, m.noise_seed, *((*m.wind, medium.time) if any(m.wind) else ()))
        air = medium.air, m.fog, medium.fog_base, medium.fog_depth, m.fog_above, medium.origin, noise
        grids = tuple((id(f.volume.density), f.volume.matrix.tobytes(), f.blend, f.factor) for f in medium.fields)
        key = shade.key, light.directional, None if shade.alone else air, grids
        if buffer.size != 4 * shade.size:
            buffer, had = self.device.buffer(size=4 * shade.size), None
        if medium.exact or not filters(self.device):
            texture = self.no_table
        elif texture.size != shade.texture_size:
            texture, had = solid(self.device, shade.texture_size, "r32float"), None
        self._tables[i] = buffer, texture, had
        return shade, buffer, texture, None if had == key else key

    def dimming(self, i: int | None = None, shade: Shade | None = None) -> Dimming:
        """Say what dims the i-th light, whose table lies so; None: nothing."""
        buffer, texture = (self.voxels, self.no_table) if i is None else self._tables[i][:2]
        linear = self.device.sampler()
        bound = {8: self.record, 9: self.voxels, 10: buffer, 15: self.atlas.texture, 16: linear, 17: texture}
        return Dimming(shade, texture is not self.no_table, bound)

    def filled(self, i: int, key: Any) -> None:
        """Note what the i-th light's table is filled for: when that is recorded, since a frame may be given up before."""
        self._tables[i] = *self._tables[i][:2], key


def slabs_of(density: Array) -> Array:
    """Bound (4, 3) where a grid (Z, Y, X) is not 0, interpolated: the least and the most of indices' x + y, y + z, z + x, and of x - y,
    y - z, z - x."""
    full = density != 0
    out = np.empty((4, 3))
    for k, (axis, turned) in enumerate(((0, True), (2, True), (1, False))):
        second, first = np.nonzero(full.any(axis=axis))
        if not turned:
            first, second = second, first
        if not len(first):
            return np.array([[-UNBOUND] * 3, [UNBOUND] * 3] * 2)
        total, less = first + second, first - second
        out[:, k] = total.min() - 2, total.max() + 2, less.min() - 2, less.max() + 2
    return out


def index_rows(matrix: Array, origin: Any) -> Array:
    """Invert a volume's matrix: (4, 4) from what is drawn, which lies at -origin in the world, to indices of voxels."""
    moved = np.eye(4)
    moved[:3, 3] = origin
    return np.asarray(np.linalg.inv(matrix) @ moved)


def bounds(medium: ResolvedMedium, region: Array | None) -> Array | None:
    """Bound (2, 3), as it is drawn, where density is more than the air's closed form. region: where the air varies."""
    boxes = [field.volume.bounds - np.asarray(medium.origin) for field in medium.fields]
    if medium.settings.noise_amount > 0 and medium.air > 0 and region is not None:
        boxes.append(region)
    if not boxes:
        return None
    return np.array([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])
