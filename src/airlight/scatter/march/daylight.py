"""Puts daylight's air before the picture of a scene: what it adds, less where shadow maps hide the sun, and its transmittance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airlight.daylight import Atmosphere
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.reference.daylight import SUN_ANGULAR_RADIUS
from airlight.scatter.daylight.table import DAYLIGHT, ViewTable
from airlight.scatter.march.march import FILTERS, GROUP, UPSAMPLE, no_shadow
from airlight.scatter.march.records import FRAME, LIGHT, frame_record, light_record
from airlight.scatter.march.variance import Moments
from airlight.scatter.radial.radial import JITTERS, noise_texture
from airlight.shadows import Shadow

AIR = "scatter/march/daylight.wgsl"
HEAVEN = struct_dtype(AIR, "Heaven")
EXACT_STEPS = 256  # where as many are asked for as there can be
LEAST_ALTITUDE = 1.0  # m, of the eye
ALTITUDE_STEP = 0.01  # of the altitude, within which the eye moves in one table


@dataclass(frozen=True)
class Sun:
    """Says what lights the air.

    direction: (3,) to the sun, unit, in the world, whose up is y; elevation: degrees; irradiance: above the air, on the picture's scale;
    ground: (3,) radiance of level ground far away, on that scale; altitude: m, of the eye.
    """

    air: Atmosphere
    direction: Any
    elevation: float
    irradiance: float
    ground: Any
    altitude: float


def settled_altitude(altitude: float) -> float:
    """Round an altitude, m, so that an eye that moves little needs no other table."""
    height = max(altitude, LEAST_ALTITUDE)
    step = math.log1p(ALTITUDE_STEP)
    return math.exp(round(math.log(height) / step) * step)


class AirLayer:
    """Evaluates the air before a picture of a size (width, height).

    layer, transmittance: textures of that size, rgba32float: radiance that is added, in alpha the ray's length, m; RGB, 0..1.
    """

    def __init__(self, device: Device, pixels: tuple[int, int], table: ViewTable | None = None) -> None:
        """table: of view rays, that pictures of other sizes have too; None: its own."""
        self.device, self.pixels = device, pixels
        self.table = table or ViewTable(device)
        self.layer, self.transmittance = device.texture(*pixels, "rgba32float"), device.texture(*pixels, "rgba32float")
        sizes = FRAME.itemsize, LIGHT.itemsize, HEAVEN.itemsize, DAYLIGHT.itemsize
        self._frame, self._light, self._heaven, self._daylight = (device.buffer(size=size, uniform=True) for size in sizes)
        self._moments = Moments(device)
        self._hidden: Any = None  # D L1, of the picture's size
        self._marched: Any = None  # of a part of it
        self._spare = device.texture(1, 1, "rgba32float")
        self._unused = device.texture(1, 1, "rgba32float")  # which is written where nothing is kept
        self._size = pixels
        self._shadow: Shadow | None = None
        self._radius: int | None = None
        self._flags: dict[str, Any] = {}
        self._keeps = False

    def update(
        self, view: Any, projection: Any, sun: Sun, medium: ResolvedMedium, *, light: PunctualLight | None = None,
        shadow: Shadow | None = None, share: float = 1.0, jitter: str = "blue", keeps: bool = False,
    ) -> None:  # fmt: skip
        """Set what the next `record` sees: matrices (4, 4), world to view space and view to clip space.

        medium: its march says how shadows are looked up. light, shadow: of the sun; None: nothing is hidden from it. share: of the
        picture's width and height, that shadows are looked up at. keeps: the picture shows the sky already. Raises AirlightError.
        """
        view = np.asarray(view, np.float64)
        device, (width, height) = self.device, self.pixels
        self._size = max(1, round(width * share)), max(1, round(height * share))
        clear = replace(medium, sigma_t=np.zeros(3), sigma_s=np.zeros(3), ambient=np.zeros(3))
        device.queue.write_buffer(self._frame, 0, frame_record(view, projection, clear, self._size, self.pixels).tobytes())
        self.table.update(sun.air, sun.elevation, settled_altitude(sun.altitude))
        shared = self.table.record(view[:3, :3] @ sun.direction, view[:3, 1], sun.irradiance)
        device.queue.write_buffer(self._daylight, 0, shared.tobytes())
        heaven, radius = np.zeros((), HEAVEN), math.radians(SUN_ANGULAR_RADIUS)
        heaven["ground"], heaven["disc_radius"] = sun.ground, radius
        heaven["disc"] = sun.irradiance / (2 * math.pi * (1 - math.cos(radius)))
        heaven["pixel"] = 2 / (abs(float(projection[1][1])) * height)
        device.queue.write_buffer(self._heaven, 0, heaven.tobytes())
        self._shadow, self._keeps = (None if light is None else shadow), keeps
        if light is None or shadow is None:
            return
        record = light_record(light, shadow, view, clear)
        record["steps"] = clear.sun_steps or EXACT_STEPS
        device.queue.write_buffer(self._light, 0, record.tobytes())
        march = medium.march
        averaged = not medium.exact and march.shadow_filter == "variance"
        self._radius = march.variance_radius if averaged else None
        self._moments.fit([shadow.texture if averaged else no_shadow(device)])
        self._flags = {"DIRECTIONAL": True, "BIASED": bool(march.shadow_bias), "JITTER": JITTERS[jitter]}
        if not medium.exact:
            self._flags |= {"FILTER": FILTERS.index(march.shadow_filter), "SNAP": march.snap}
        if self._hidden is None:
            self._hidden = device.texture(*self.pixels, "rgba32float")
        if self._size != self.pixels and (self._marched is None or self._marched.size[:2] != self._size):
            self._marched = device.texture(*self._size, "rgba32float")

    def record(self, encoder: Any, depth: Any, fog: Sequence[Any] | None = None, timer: Timer | None = None) -> None:
        """Record the passes, from the picture's depth. fog: radiance and transmittance of a medium before the air, textures of its size."""
        device = self.device
        if self._shadow is not None:
            self._look_up(encoder, depth, timer)
        hidden = self._spare if self._shadow is None else self._hidden
        pipeline = device.pipeline(AIR, "add_air", FOGGED=fog is not None, KEEPS=self._keeps)
        bind = self._bound(depth, hidden, self.layer, self.transmittance, fog or (self._spare, self._spare))
        compute(encoder, pipeline, bind, tuple(-(-side // GROUP) for side in self.pixels), "daylight", timer)

    def _look_up(self, encoder: Any, depth: Any, timer: Timer | None) -> None:
        """Record the look-ups of shadows, and their upsampling."""
        assert self._shadow is not None
        device, whole = self.device, self._size == self.pixels
        if self._radius is not None:
            self._moments.record(encoder, self._radius, [self._shadow.drawn], timer)
        target = self._hidden if whole else self._marched
        pipeline = device.pipeline(AIR, "look_up", **self._flags)
        bind = self._bound(depth, self._spare, target, self._unused, (self._spare, self._spare))
        compute(encoder, pipeline, bind, tuple(-(-side // GROUP) for side in self._size), "daylight shadows", timer)
        if not whole:
            pipeline = device.pipeline(UPSAMPLE, "upsample")
            map_view = self._shadow.texture.create_view(dimension="2d-array")
            bind = device.bind(UPSAMPLE, self._frame, self._light, depth, map_view, self._marched, self._hidden, self.transmittance)
            compute(encoder, pipeline, bind, tuple(-(-(side + 1) // GROUP) for side in self._size), "upsample", timer)

    def _bound(self, depth: Any, hidden: Any, target: Any, through: Any, fog: Sequence[Any]) -> Any:
        device = self.device
        shadow = no_shadow(device) if self._shadow is None else self._shadow.texture
        if not self._moments.views:
            self._moments.fit([no_shadow(device)])
        map_view = shadow.create_view(dimension="2d-array")
        sun = self._frame, self._light, depth, map_view, self._spare, target, noise_texture(device), self._light, self._heaven
        return device.bind(AIR, *sun, hidden, *fog, through, self._moments.views[0], self._daylight, *self.table.resources)
