"""The shadow-map article's march, planned and recorded. What its composite adds to a picture, (2 light - 1) / 10, is its layer."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.timing import compute
from airlight.lights.directional import DirectionalLight
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.scatter.march.march import no_shadow
from airlight.scatter.march.records import FRAME, LIGHT, frame_record, light_record
from airlight.scatter.radial.radial import JITTERS, noise_texture
from airlight.shadows import Shadow

ARTICLE = "scatter/article/article.wgsl"
DARK = DirectionalLight((0.0, 0.0, 0.0))
BIAS = 0.0005  # of the map's range of depth
SETTINGS = np.dtype([("bias", "f4"), ("absorption", "f4"), ("cap", "f4"), ("prose", "f4")])


class Article:
    """As march.March: made for a picture's size, aimed, recorded; always at the picture's resolution, and at one sun or none.

    layer: rgba32float: what is added to the picture, and 0: no way through a medium, so that it dims nothing. Raises AirlightError for
    other lights.
    """

    transmittance: Any = None  # 1 everywhere

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self.layer = device.texture(*pixels, "rgba32float")
        self._buffers = [device.buffer(size=dtype.itemsize, uniform=True) for dtype in (FRAME, LIGHT, SETTINGS)]
        self._shadow = no_shadow(device)
        self._binds: dict[Any, Any] = {}

    def aim(
        self,
        view: Any,
        projection: Any,
        lamps: Sequence[tuple[PunctualLight, Shadow | None]],
        air: ResolvedMedium,
        *,
        jitter: str = "fixed",
    ) -> None:
        """view, projection: (4, 4), as pygfx's cameras have them. jitter: of Parameters.offset."""
        if any(not lamp.directional for lamp, _ in lamps[:1]) or len(lamps) > 1:
            kinds = ", ".join(lamp.word for lamp, _ in lamps)
            raise AirlightError(f"method article takes one light, a sun (here: {kinds}): give it one, as --sun does, or use method march")
        lamp, shadow = lamps[0] if lamps else (DARK, None)
        m = air.march
        settings = np.zeros((), SETTINGS)
        settings["bias"] = 0.0 if m.shadow_bias else BIAS
        settings["absorption"], settings["cap"], settings["prose"] = m.article_absorption, m.article_cap, m.article_share == "prose"
        records = frame_record(projection, air, self.pixels, self.pixels), light_record(lamp, shadow, view, air), settings
        for buffer, record in zip(self._buffers, records, strict=True):
            self.device.queue.write_buffer(buffer, 0, record.tobytes())
        views = len(shadow.views) if shadow else 0
        self._pipeline = self.device.pipeline(ARTICLE, "article", VIEWS=views, JITTER=JITTERS[jitter])
        self._shadow = shadow.texture if shadow else no_shadow(self.device)

    def record(self, encoder: Any, depth: Any, timer: Any = None) -> None:
        """depth: texture, depth32float, of the picture's size."""
        key = id(depth), id(self._shadow)
        if key not in self._binds:
            if len(self._binds) > 3:
                self._binds.clear()
            frame, light, settings = self._buffers
            maps, noise = self._shadow.create_view(dimension="2d-array"), noise_texture(self.device)
            bind = self.device.bind(ARTICLE, frame, light, depth, maps, noise, self.layer, noise, settings)  # nothing was before
            self._binds[key] = bind, depth, self._shadow  # held, so that no id is used again
        width, height = self.pixels
        compute(encoder, self._pipeline, self._binds[key][0], (-(-width // 8), -(-height // 8)), "article", timer)
