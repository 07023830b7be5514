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
from airlight.medium.resolve import FOGS, ResolvedMedium
from airlight.reference.daylight import SUN_ANGULAR_RADIUS
from airlight.scatter.daylight.table import DAYLIGHT, ViewTable
from airlight.scatter.march.hierarchies import GROUP, Hierarchies
from airlight.scatter.march.march import FILTERS, no_shadow
from airlight.scatter.march.records import FRAME, LIGHT, frame_record, light_record
from airlight.scatter.march.variance import Moments
from airlight.scatter.march.varying import Dimming, Varying
from airlight.scatter.radial.radial import JITTERS, noise_texture
from airlight.shadows import Shadow

ADD, STEPS, WALK = (f"scatter/march/{name}.wgsl" for name in ("add_air", "air_steps", "air_walk"))
HEAVEN = struct_dtype(ADD, "Heaven")
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
        sizes = FRAME.itemsize, FRAME.itemsize, LIGHT.itemsize, HEAVEN.itemsize, DAYLIGHT.itemsize
        buffers = [device.buffer(size=size, uniform=True) for size in sizes]
        self._frame, self._foggy, self._light, self._heaven, self._daylight = buffers  # the second has the medium, the first does not
        self._moments, self._hierarchies = Moments(device), Hierarchies(device)
        self._nothing = Varying(device).dimming()
        self._dimming = self._nothing
        self._no_glass = device.buffer(size=32)
        self._cookie = device.texture(1, 1, "rgba16float")  # which is bound, and not read
        self._hidden: Any = None  # D L1, of `_size`
        self._spare = device.texture(1, 1, "rgba32float")
        self._size = pixels
        self._shadow: Shadow | None = None
        self._radius: int | None = None
        self._exact = False
        self._flags: dict[str, Any] = {}
        self._keeps = False

    def update(
        self, view: Any, projection: Any, sun: Sun, medium: ResolvedMedium, *, light: PunctualLight | None = None,
        shadow: Shadow | None = None, dimming: Dimming | None = None, share: float = 1.0, jitter: str = "blue", keeps: bool = False,
    ) -> None:  # fmt: skip
        """Set what the next `record` sees: matrices (4, 4), world to view space and view to clip space.

        medium: it dims the sun as its march has it, and says how shadows are looked up. light, shadow: of the sun; None: nothing is hidden
        from it. dimming: what dims that more than closed forms, filled before `record`. share: of the picture's width and height, that
        shadows are looked up at. keeps: the picture shows the sky already. Raises AirlightError.
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
        self._exact, self._dimming = medium.exact, dimming or self._nothing
        shade = self._dimming.shade
        device.queue.write_buffer(self._foggy, 0, frame_record(view, projection, medium, self._size, self.pixels).tobytes())
        device.queue.write_buffer(self._light, 0, light_record(light, shadow, view, medium, shade).tobytes())
        march = medium.march
        averaged = not medium.exact and march.shadow_filter == "variance"
        self._radius = march.variance_radius if averaged else None
        self._moments.fit([shadow.texture if averaged else no_shadow(device)])
        self._flags = {"DIRECTIONAL": True, "BIASED": bool(march.shadow_bias), "FOG": FOGS.index(medium.settings.fog)}
        self._flags |= {
            "FADES": medium.fades_suns and bool(medium.sigma_t.any()),
            "TABLE": shade is not None,
            "TEXTURE": self._dimming.is_texture,
        }
        self._flags |= {"GLASS": shadow.glass is not None, "COLOURED": shadow.coloured}
        if medium.exact:
            self._hierarchies.fit([shadow.texture])
        else:
            self._flags |= {"JITTER": JITTERS[jitter], "FILTER": FILTERS.index(march.shadow_filter), "SNAP": march.snap}
        if self._hidden is None or self._hidden.size[:2] != self._size:
            self._hidden = device.texture(*self._size, "rgba32float")

    def record(self, encoder: Any, depth: Any, fog: Sequence[Any] | None = None, timer: Timer | None = None) -> None:
        """Record the passes, from the picture's depth. fog: radiance and transmittance of a medium before the air, textures of its size."""
        device = self.device
        if self._shadow is not None:
            self._look_up(encoder, depth, timer)
        is_whole = self._shadow is None or self._size == self.pixels
        pipeline = device.pipeline(ADD, "add_air" if is_whole else "add_air_between", FOGGED=fog is not None, KEEPS=self._keeps)
        hidden = self._spare if self._shadow is None else self._hidden
        behind = hidden, self.layer, self._heaven, *(fog or (self._spare, self._spare)), self.transmittance
        shadow = self._map_view(no_shadow(device))
        bind = device.bind(ADD, self._frame, self._light, depth, shadow, *behind, self._daylight, *self.table.resources)
        size = self.pixels if is_whole else (self._size[0] + 1, self._size[1] + 1)
        compute(encoder, pipeline, bind, tuple(-(-side // GROUP) for side in size), "daylight", timer)

    def _look_up(self, encoder: Any, depth: Any, timer: Timer | None) -> None:
        """Record the look-ups of shadows."""
        assert self._shadow is not None
        device, shadow = self.device, self._shadow
        if self._radius is not None:
            self._moments.record(encoder, self._radius, [shadow.drawn], timer)
        if self._exact:
            self._hierarchies.record(encoder, [shadow.texture], no_shadow(device), timer)
        path = WALK if self._exact else STEPS
        bound = {
            0: self._foggy,
            1: self._light,
            2: depth,
            3: self._map_view(shadow.texture),
            4: self._spare,
            5: self._hidden,
            7: self._light,
        }
        bound |= {6: self._hierarchies.buffers[0]} if self._exact else {6: noise_texture(device), 14: self._moments.views[0]}
        bound |= self._dimming.resources | {13: shadow.glass or self._no_glass, 18: self._cookie, 19: device.sampler()}
        pipeline = device.pipeline(path, "look_up", **self._flags)
        bind = device.bind(path, *(bound[i] for i in sorted(bound)), self._daylight, *self.table.resources)
        compute(encoder, pipeline, bind, tuple(-(-side // GROUP) for side in self._size), "daylight shadows", timer)

    @staticmethod
    def _map_view(texture: Any) -> Any:
        """Make a view of all layers of a shadow map."""
        return texture.create_view(dimension="2d-array")
