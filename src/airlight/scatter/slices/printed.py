"""Plans and records slices as the chapter "Light Shaft Rendering" prints them (Mitchell 2004)."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.luminance import REC709_F32
from airlight.medium.resolve import ResolvedMedium
from airlight.scatter.march.cookies import SHAPES, even_colour, shape_of
from airlight.scatter.methods import WINDOWS
from airlight.scatter.slices.noise_maps import SIDE, noise_maps
from airlight.scatter.slices.records import has_window, slicing_record, view_box
from airlight.scatter.slices.slices import GROUP, Lit, Slices
from airlight.shadows import Shadow

PRINTED, BLUR, EARLIER = (f"scatter/slices/{name}.wgsl" for name in ("printed", "blur", "earlier"))
BLURRING = struct_dtype(BLUR, "Blur")
MOST = 100  # planes
SCALE, NEAR_TERM, FAR_TERM = 9.0, 20000.0, 0.35  # of samples, and of their falloff NEAR_TERM / d^2 + FAR_TERM
FALLOFFS = {  # factors of 1 / d^2, 1 / d and 1; all are 1, or FAR_TERM more, at one distance
    "ambient": (NEAR_TERM, 0.0, FAR_TERM),
    "inverse-square": (NEAR_TERM, 0.0, 0.0),
    "inverse": (0.0, NEAR_TERM**0.5, 0.0),
    "none": (0.0, 0.0, 1.0),
}
SCROLLS = np.array([[1.0, 0.35], [-0.6, 0.8]])  # ways of the two noise maps


class Printed(Slices):
    """Adds up slices in buffers of 8 bits, one a light, of whose hue it is; what they add knows no units and no medium."""

    path = PRINTED
    writes_layer = False

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        super().__init__(device, pixels)
        self.transmittance = None  # 1 everywhere
        self._blur = device.buffer(size=BLURRING.itemsize)
        self._maps: tuple[int, Any] | None = None

    def _ordered(self, lights: Sequence[Lit], medium: ResolvedMedium, view: np.ndarray) -> Sequence[Any]:
        record = np.zeros((), BLURRING)
        record["count"], record["radius"] = medium.march.plane_blur, medium.march.plane_blur_radius
        self.device.queue.write_buffer(self._blur, 0, record.tobytes())
        if self._maps is None or self._maps[0] != medium.march.plane_noise_seed:
            both = noise_maps(medium.march.plane_noise_seed)
            texture = self.device.texture(SIDE, SIDE, "rgba32float", target=False)
            self.device.write(texture, np.ascontiguousarray(np.pad(both, ((0, 0), (0, 0), (0, 2)))), 16 * SIDE)
            self._maps = medium.march.plane_noise_seed, texture
        return list(lights) or [(None, None)]

    def _averaged(self, medium: ResolvedMedium) -> int:
        return 1

    def _slicing(self, light: PunctualLight, shadow: Shadow | None, view: np.ndarray, medium: ResolvedMedium) -> np.ndarray:
        march, time = medium.march, medium.time
        box = view_box(light, view, medium)
        count = planes_at((box[0] + box[1]) / 2, march.planes or MOST, march.plane_distance)
        out = slicing_record(light, shadow, view, box, count)
        even = even_colour(light)
        out["gain"] = SCALE * MOST / count * (1.0 if even is None or not march.plane_cookie else float(even @ REC709_F32))
        out["printed"] = FALLOFFS["none" if light.directional else march.plane_falloff]
        out["unit"] = march.plane_unit
        speeds = march.plane_scroll, march.plane_scroll_second
        ways = (way / np.linalg.norm(way) * speed * time for way, speed in zip(SCROLLS, speeds, strict=True))
        out["scroll"] = np.mod(np.concatenate(list(ways)), 1.0)
        brightest = max(light.intensity)
        out["tint"] = np.array(light.intensity) / brightest * light.strength if brightest > 0 else 0.0
        return out

    def _constants(self, light: PunctualLight | None, shadow: Shadow | None, medium: ResolvedMedium) -> dict[str, Any]:
        march = medium.march
        found: dict[str, Any] = {"CLIP": march.plane_clip, "MASK": march.plane_mask, "NOISE": march.plane_noise}
        found |= {"SHADOW": march.plane_shadow, "BIASED": bool(march.shadow_bias)}
        if light is not None:
            found |= {**light.flags, "SHAPE": SHAPES.index(shape_of(light)) * march.plane_cookie}
        return found

    def _extra(self, i: int, extent: Any) -> tuple[Any, ...]:
        assert self._maps is not None
        return (self._maps[1],)

    def _measure(self, *_: Any) -> None:
        """Records nothing: boxes hold the whole volume."""

    def _finish(self, encoder: Any, depth: Any, shadow: Any, counts: tuple[int, int], timer: Timer | None) -> None:
        pipeline = self.device.pipeline(BLUR, "composite")
        bind = self.device.bind(BLUR, self._blur, self.targets[0], self.layer)
        width, height = self.pixels
        compute(encoder, pipeline, bind, (-(-width // GROUP), -(-height // GROUP)), "slices blur", timer)


class Extruded(Printed):
    """Draws the polygons that a light's window is extruded to, textured with moving noise: earlier practice, hollow and without shadows."""

    name, path, entry, dices = "slices-extruded", EARLIER, "polygons", 1

    def _ordered(self, lights: Sequence[Lit], medium: ResolvedMedium, view: np.ndarray) -> Sequence[Any]:
        if not all(has_window(light) for light, _ in lights):
            there = ", ".join(light.word for light, _ in lights)
            raise AirlightError(f"method {self.name} takes {WINDOWS} (here: {there}): give it one, or use method slices")
        return super()._ordered(lights, medium, view)

    def _slicing(self, light: PunctualLight, shadow: Shadow | None, view: np.ndarray, medium: ResolvedMedium) -> np.ndarray:
        out = super()._slicing(light, shadow, view, medium)
        far = float(getattr(light, "far", 0.0)) or light.attenuation_range() or medium.max_distance
        out["span"] = float(getattr(light, "near", 0.0)), far
        return out

    def _constants(self, light: PunctualLight | None, shadow: Shadow | None, medium: ResolvedMedium) -> dict[str, Any]:
        return {"DICES": self.dices, **({"LIT": False} if light is None else light.flags)}


class Diced(Extruded):
    """Draws more such polygons, through the inside of the volume."""

    name, dices = "slices-diced", 12


class Thickness(Extruded):
    """Adds the thickness of the volume before a surface, from its front and back faces."""

    name, entry = "slices-thickness", "thickness"


def planes_at(middle: Any, most: int, distance: float | None) -> int:
    """Count the planes of a light whose box has its middle at (3,), view space: from a distance on, m, fewer in proportion to it. At least
    four, one a channel."""
    away = float(np.linalg.norm(middle))
    if distance is None or not math.isfinite(away) or away <= distance:
        return most
    return max(round(most * distance / away), min(4, most))
