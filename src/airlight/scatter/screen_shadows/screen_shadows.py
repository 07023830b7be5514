"""Plans and records lights of a medium that are seen in the picture: all of their light, less what the picture's own depth hides of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import FOGS, ResolvedMedium
from airlight.projection import eye_rays
from airlight.scatter.march.cookies import Cookies
from airlight.scatter.march.march import no_shadow
from airlight.scatter.march.records import FRAME, LIGHT, frame_record, light_record
from airlight.scatter.march.varying import Varying
from airlight.scatter.visibility.grid import Fineness, row_grid

SCAN, ADD = "scatter/screen_shadows/scan.wgsl", "scatter/screen_shadows/add.wgsl"
RECORD, ROW = struct_dtype(SCAN, "Scan"), struct_dtype(SCAN, "Row")
BINS, LAYERS = RECORD["edge"].shape[0] - 1, 12  # as in coordinate.wgsl
MOST_BODIES = RECORD["body"].shape[0]
OCTAVES = 8.0  # of a sun's coordinate
FINENESS = Fineness(4.0, 9.0, 8)
SUB = 3  # samples of the picture from ray to ray
GROUP, SQUARE = 64, 8


@dataclass(frozen=True)
class SeenLight:
    """Describes a light of the medium that is seen. share: of it, 0..1, that the picture's sum stands for. bodies: (N, 4) spheres, world
    coordinates and radius, that hide nothing."""

    light: PunctualLight
    share: float
    bodies: np.ndarray


class LightOnPicture:
    """Holds one light's rows, and what the picture hides of it, for pictures of `pixels` (width, height)."""

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self._light = device.buffer(size=LIGHT.itemsize, uniform=True)
        self._scan = device.buffer(size=RECORD.itemsize, uniform=True)
        self._rows: Any = None
        self.atlas: Any = None
        self._binds: dict[str, tuple[tuple[Any, ...], Any]] = {}
        self._count = 0
        self._constants: dict[str, Any] = {}
        self._scanned: dict[str, Any] = {}
        self._word = ""

    def update(self, view: Any, projection: Any, seen: SeenLight, medium: ResolvedMedium) -> None:
        """Sets what the next `record` sees, as March.update."""
        light, device = seen.light, self.device
        data = light_record(light, None, view, medium)
        data["intensity"] *= seen.share
        towards = data["position"] / np.linalg.norm(data["position"].astype(float))
        rows = row_grid(towards, eye_rays(projection)[0], self.pixels, _fineness(self.pixels, device.max_side))
        count = len(rows.begin)
        atlas = int(rows.rays.max()) * LAYERS, count
        if self._rows is None or self._rows.size < count * ROW.itemsize:
            self._rows = device.buffer(size=2 * count * ROW.itemsize)
        if self.atlas is None or any(have < need for have, need in zip(self.atlas.size, atlas, strict=False)):
            self.atlas = device.texture(atlas[0], min(math.ceil(1.25 * count), device.max_side), "rgba16float")
        own = np.zeros(count, ROW)
        own["begin"], own["end"], own["rays"] = rows.begin, rows.end, rows.rays[rows.edge]
        out = np.zeros((), RECORD)
        out["offset"], out["slope"], out["rate"], out["first"], out["rays"] = rows.offset, rows.slope, rows.rate, rows.first, rows.rays
        out["texel"], out["count"] = 1 / np.array(self.atlas.size[:2], float), count
        out["octaves"], out["nearest"] = OCTAVES, medium.max_distance / (2**OCTAVES - 1)
        out["edge"] = edges(float(out["nearest"]))
        bodies = seen.bodies[:MOST_BODIES]
        out["bodies"] = len(bodies)
        if len(bodies):
            out["body"][: len(bodies), :3] = bodies[:, :3] @ np.asarray(view, float)[:3, :3].T + np.asarray(view, float)[:3, 3]
            out["body"][: len(bodies), 3] = bodies[:, 3]
        for buffer, record in ((self._light, data), (self._scan, out), (self._rows, own)):
            device.queue.write_buffer(buffer, 0, record.tobytes())
        self._count, self._word = count, light.word
        self._constants = {**light.flags, "PHASE": medium.lobes(light.anisotropy)[0], "FOG": FOGS.index(medium.settings.fog)}
        self._constants["FADES"] = light.directional and medium.fades_suns
        self._scanned = {"SUB": SUB, "BODIES": len(bodies) > 0}

    def record(
        self, encoder: Any, common: tuple[Any, ...], before: Any, target: Any, transmittance: Any, begins: bool, last: bool,
        stand_ins: Sequence[Any], timer: Timer | None,
    ) -> None:  # fmt: skip
        """Records the walks along the rows, and adds the light to what was before, or to the ambient light if it begins.

        common: (frame, depth, shadow). last: whether it writes transmittance too. stand_ins: what is bound where nothing is read.
        """
        frame, depth, shadow = common
        scan = self.device.pipeline(SCAN, "walk", **self._constants, **self._scanned)
        held = frame, self._light, depth, shadow, before, target
        bind = self._bound(SCAN, *held, self._scan, self._rows, self.atlas)
        compute(encoder, scan, bind, (-(-self._count // GROUP),), "picture shadows", timer)
        add = self.device.pipeline(ADD, "add", FIRST=begins, LAST=last, **self._constants)
        field, voxels, table, grids, sampler, texture, cookie, turning = stand_ins
        bound = self._scan, self._light, field, voxels, table, self.atlas, transmittance, grids, sampler, texture, cookie, turning
        bind = self._bound(ADD, *held, *bound)
        compute(encoder, add, bind, tuple(-(-side // SQUARE) for side in self.pixels), f"picture {self._word}", timer)

    def _bound(self, path: str, *parts: Any) -> Any:
        """Makes a bind group, or keeps it while `parts` are the same."""
        had = self._binds.get(path)
        if had is None or any(a is not b for a, b in zip(had[0], parts, strict=True)):
            shadow = parts[3].create_view(dimension="2d-array")
            had = self._binds[path] = parts, self.device.bind(path, *parts[:3], shadow, *parts[4:])
        return had[1]


class LightsOnPicture:
    """Adds lights that are seen in the picture to a march's layer, for pictures of a size.

    layer, transmittance: textures of the last `record`, as March's; the latter is written where nothing was marched before.
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self._frame = device.buffer(size=FRAME.itemsize, uniform=True)
        self._layers = [device.texture(*pixels, "rgba32float") for _ in range(2)]
        self.transmittance: Any = device.texture(*pixels, "rgba32float")
        self.lights: list[LightOnPicture] = []
        self.count = 0
        varying, cookies = Varying(device), Cookies(device)
        more = varying.atlas.texture, device.sampler(), varying.no_table, cookies.none, device.sampler()
        self._stand_ins = varying.record, varying.voxels, varying.voxels, *more

    @property
    def layer(self) -> Any:
        return self._layers[(self.count - 1) % 2]

    def update(self, view: Any, projection: Any, lights: Sequence[SeenLight], medium: ResolvedMedium) -> None:
        """Sets what the next `record` sees, as March.update."""
        self.count = len(lights)
        while len(self.lights) < self.count:
            self.lights.append(LightOnPicture(self.device, self.pixels))
        del self.lights[self.count :]
        for one, seen in zip(self.lights, lights, strict=True):
            one.update(view, projection, seen, medium)
        self.device.queue.write_buffer(self._frame, 0, frame_record(view, projection, medium, self.pixels, self.pixels).tobytes())

    def record(self, encoder: Any, depth: Any, before: Any, timer: Timer | None = None) -> None:
        """Records the lights, onto what was marched before; None: onto the ambient light, with the transmittance."""
        common = self._frame, depth, no_shadow(self.device)
        for i, light in enumerate(self.lights):
            begins, last = before is None and i == 0, before is None and i == self.count - 1
            below = (self._layers[1 - i % 2] if begins else before) if i == 0 else self._layers[1 - i % 2]
            light.record(encoder, common, below, self._layers[i % 2], self.transmittance, begins, last, self._stand_ins, timer)


def edges(nearest: float) -> np.ndarray:
    """Lists (BINS + 1, 4) where bins of a sun's coordinate begin, m, and the cosine and sine of the middle of a lamp's."""
    out, bin_of = np.zeros((BINS + 1, 4)), np.arange(BINS + 1)
    out[:, 0] = nearest * (2 ** (OCTAVES * bin_of / BINS) - 1)
    middle = np.pi * (bin_of + 0.5) / BINS
    out[:, 1], out[:, 2] = np.cos(middle), np.sin(middle)
    return out


def _fineness(pixels: tuple[int, int], most: int) -> Fineness:
    """Lays rows so wide that all of a picture's fit into a texture."""
    found = FINENESS.of_picture(pixels)
    least = 2.5 * sum(pixels) / most
    return Fineness(max(found.row_px, least), found.ray_px, found.per)
