"""Plans and records the in-scattering of the shadow-map article (unpublished, 2014; docs/references.md).

What its composite adds to a picture, (2 light - 1) / 10, is the layer.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
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
STEPS, STEP, STOP = 600, 0.8, 2.0  # the code's: samples; m; m from the surface
PROSE_STEP = 0.5  # m, the prose's
CASCADES = 3
SETTINGS = struct_dtype(ARTICLE, "Settings")


class Article:
    """Sums shadows as the article's code does, with a layout as march.March has: made for a picture's size, aimed, recorded; always at
    the picture's resolution, and at one sun or none.

    layer: rgba32float: what is added to the picture, and 0: no way through a medium, so that it dims nothing. Raises AirlightError for
    other lights.
    """

    name, entry = "article", "article"
    transmittance: Any = None  # 1 everywhere

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self.layer = device.texture(*pixels, "rgba32float")
        self._buffers = [device.buffer(size=dtype.itemsize, uniform=True) for dtype in (FRAME, LIGHT, SETTINGS)]
        self._shadow = no_shadow(device)
        self._binds: dict[Any, Any] = {}

    @staticmethod
    def resolve(medium: ResolvedMedium) -> ResolvedMedium:
        """Replaces what the code fixes: three cascades, as far as its samples reach, and a surface still ends them."""
        march = msgspec.structs.replace(medium.march, cascades=CASCADES)
        return dataclasses.replace(ArticleProse.resolve(medium), max_distance=STEPS * STEP + STOP, march=march)

    def settings(self, medium: ResolvedMedium) -> np.ndarray:
        """Fills the shader's Settings."""
        out = np.zeros((), SETTINGS)
        out["bias"] = BIAS
        return out

    def update(
        self,
        view: Any,
        projection: Any,
        lights: Sequence[tuple[PunctualLight, Shadow | None]],
        medium: ResolvedMedium,
        *,
        jitter: str = "fixed",
    ) -> None:
        """Set what is seen: view, projection (4, 4), as pygfx's cameras have them; medium: as `resolve` gives it.

        jitter: of Parameters.offset; the code has none. Raises AirlightError for other lights than one sun.
        """
        if any(not light.directional for light, _ in lights[:1]) or len(lights) > 1:
            one = f"method {self.name} takes one light, a sun (here: {', '.join(light.word for light, _ in lights)})"
            raise AirlightError(f"{one}: give it one, as --sun does, or use method march")
        light, shadow = lights[0] if lights else (DARK, None)
        frame = frame_record(view, projection, medium, self.pixels, self.pixels)
        records = frame, light_record(light, shadow, view, medium), self.settings(medium)
        for buffer, record in zip(self._buffers, records, strict=True):
            self.device.queue.write_buffer(buffer, 0, record.tobytes())
        views = len(shadow.views) if shadow else 0
        self._pipeline = self.device.pipeline(ARTICLE, self.entry, VIEWS=views, JITTER=JITTERS[jitter], STRICT=self.entry == "article")
        self._shadow = shadow.texture if shadow else no_shadow(self.device)

    def record(self, encoder: Any, depth: Any, timer: Any = None) -> None:
        """Record the march. depth: texture, depth32float, of the picture's size."""
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


class ArticleProse(Article):
    """Sums lit steps as the article's prose says, with the options of `March` that begin with article."""

    name, entry = "article-prose", "prose"

    @staticmethod
    def resolve(medium: ResolvedMedium) -> ResolvedMedium:
        """Keeps everything but the distance of suns, and densities that vary, which it does not know."""
        if medium.settings.sun_distance is None and not medium.varies:
            return medium
        settings = msgspec.structs.replace(medium.settings, sun_distance=None, noise_amount=0.0)
        return dataclasses.replace(medium, settings=settings, fields=())

    def settings(self, medium: ResolvedMedium) -> np.ndarray:
        """Fills the shader's Settings."""
        out, m = np.zeros((), SETTINGS), medium.march
        out["bias"] = 0.0 if m.shadow_bias else BIAS
        out["absorption"], out["cap"], out["prose"] = m.article_absorption, m.article_cap, m.article_share == "prose"
        out["steps"], out["step"] = (STEPS, STEP) if m.article_steps is None else (m.article_steps, PROSE_STEP)
        return out
