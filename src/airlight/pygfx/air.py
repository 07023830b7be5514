"""Puts the air of daylight before a renderer's picture, with the shadows of the scene in it where a method has their maps."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.composite.scene import SceneLayer
from airlight.gpu.device import Device
from airlight.gpu.timing import Timer
from airlight.lights.directional import DirectionalLight
from airlight.medium.resolve import ResolvedMedium
from airlight.scatter.march.daylight import AirLayer, Sun
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

SAME = 1e-4  # of a unit vector, within which a light is the sun


class AirOfScene:
    """Keeps the layer of the air of pictures of a size; layer: with what a medium adds, of the last `record`; None without daylight."""

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device, self.size = device, size
        self._air: AirLayer | None = None
        self.layer: SceneLayer | None = None

    def record(
        self, shafts: "LightShafts", encoder: Any, depth: Any, lights: Sequence[Any], medium: ResolvedMedium,
        fog: Sequence[Any] | None, timer: Timer | None,
    ) -> None:  # fmt: skip
        """Record the air before the picture's depth. lights: with their shadow maps; fog: radiance and transmittance of a medium."""
        daylight = shafts.daylight
        if daylight is None:
            self.layer = self._air = None
            return
        if self._air is None:
            self._air = AirLayer(self.device, self.size)
        view, projection = (np.asarray(m, np.float64) for m in (shafts.camera.view_matrix, shafts.camera.projection_matrix))
        found = [one for one in lights if isinstance(one[0], DirectionalLight) and np.allclose(one[0].direction, daylight.direction, atol=SAME)]
        light, shadow = found[0] if found and METHODS[shafts.parameters.method].has_units else (None, None)
        scale = daylight.lux * shafts.pre_exposure
        altitude = daylight.altitude + float(np.linalg.inv(view)[1, 3]) + medium.origin[1]
        sun = Sun(daylight.air, daylight.direction, daylight.elevation, scale, daylight.sky.ground * scale, altitude)
        share = shafts.in_scene.share(shafts.parameters)
        self._air.update(view, projection, sun, medium, light=light, shadow=shadow, share=share, jitter=shafts.parameters.offset)
        self._air.record(encoder, depth, fog, timer)
        self.layer = SceneLayer(radiance=self._air.layer, transmittance=self._air.transmittance)
