"""Puts the air of daylight before a renderer's picture, with the shadows of the scene in it where a method has their maps."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.composite.scene import SceneLayer
from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute
from airlight.lights.directional import DirectionalLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March, Medium
from airlight.pygfx.origin import current_origin
from airlight.scatter.daylight.table import ViewTable
from airlight.scatter.march.daylight import AirLayer, Sun
from airlight.scatter.march.hierarchies import GROUP
from airlight.scatter.march.march import March as MarchPlan
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

BEHIND = "pygfx/air_behind.wgsl"
SAME = 1e-4  # of a unit vector, within which a light is the sun


class AirOfScene:
    """Keeps the layer of the air of pictures of a size; layer: with what a medium adds, of the last `record`; None without daylight."""

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device, self.size = device, size
        self._air: AirLayer | None = None
        self._seen: Any = None  # the picture behind the air
        self.layer: SceneLayer | None = None

    def behind(self, shafts: "LightShafts", encoder: Any, color: Any, depth: Any, timer: Timer | None) -> Any:
        """Record the picture as it is seen through the air, without shadows in that, for methods of the screen; give its texture."""
        self.record(shafts, encoder, depth, (), None, None, timer)
        if self.layer is None:
            return color
        if self._seen is None:
            self._seen = self.device.texture(*self.size, "rgba16float")
        pipeline = self.device.pipeline(BEHIND, "compose")
        bind = self.device.bind(BEHIND, color, self.layer.radiance, self.layer.transmittance, self._seen)
        compute(encoder, pipeline, bind, tuple(-(-side // GROUP) for side in self.size), "daylight picture", timer)
        return self._seen

    def record(
        self, shafts: "LightShafts", encoder: Any, depth: Any, lights: Sequence[Any], medium: ResolvedMedium | None,
        fog: Any, timer: Timer | None,
    ) -> None:  # fmt: skip
        """Record the air before the picture's depth. lights: with their shadow maps. medium: resolved; None where there is none, and the
        picture shows the sky already. fog: what has recorded the medium's layer and transmittance; None: it adds and takes nothing."""
        daylight = shafts.daylight
        if daylight is None:
            self.layer = self._air = None
            return
        if self._air is None:
            shafts.view_table = shafts.view_table or ViewTable(self.device)
            self._air = AirLayer(self.device, self.size, shafts.view_table)
        view, projection = (np.asarray(m, np.float64) for m in (shafts.camera.view_matrix, shafts.camera.projection_matrix))
        suns = [one for one in lights if isinstance(one[0], DirectionalLight)]
        found = [one for one in suns if np.allclose(one[0].direction, daylight.direction, atol=SAME)]
        light, shadow = found[0] if found and METHODS[shafts.parameters.method].has_units else (None, None)
        scale = daylight.lux * shafts.pre_exposure
        altitude = daylight.altitude + float(np.linalg.inv(view)[1, 3] + current_origin()[1])
        sun = Sun(daylight.air, daylight.direction, daylight.elevation, scale, daylight.sky.ground * scale, altitude)
        dimming = fog.dimming(light) if light is not None and isinstance(fog, MarchPlan) else None
        share = shafts.in_scene.share(shafts.parameters)
        more: Any = {"light": light, "shadow": shadow, "dimming": dimming, "share": share}
        more |= {"jitter": shafts.parameters.offset, "keeps": medium is None}
        self._air.update(view, projection, sun, medium or resolve(Medium(), March(), "draft", 1.0), **more)
        self._air.record(encoder, depth, None if fog is None else (fog.layer, fog.transmittance), timer)
        self.layer = SceneLayer(radiance=self._air.layer, transmittance=self._air.transmittance)
