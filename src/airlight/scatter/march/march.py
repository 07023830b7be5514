"""The march through depth and shadow maps, planned and recorded: all that its ways of summing share."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute
from airlight.lamps import Lamp
from airlight.medium import Settled
from airlight.scatter.march.records import FRAME, LIGHT, frame_record, light_record
from airlight.scatter.radial.radial import JITTERS, noise_texture
from airlight.shadows import Shadow

WALK, STEPS, UPSAMPLE = (f"scatter/march/{name}.wgsl" for name in ("walk", "steps", "upsample"))
KINDS = {"sun": 0, "spot": 1, "point": 2}
DARKNESS = 3  # the kind of no light at all
FILTERS = ("nearest", "pcf", "soft")
GROUP = 8  # a workgroup is GROUP x GROUP


def no_shadow(device: Device) -> Any:
    """The shadow map of lights that have none."""
    if "no shadow" not in device.kept:
        usage = device.wgpu.TextureUsage
        flags = usage.TEXTURE_BINDING | usage.RENDER_ATTACHMENT
        device.kept["no shadow"] = device.device.create_texture(size=(1, 1, 1), format="depth32float", usage=flags)
    return device.kept["no shadow"]


class March:
    """Lights in a medium, for pictures of a size (width, height).

    layer: texture of that size, rgba32float: in-scattered radiance, and T, how far the ray goes, metres. It holds what `record` made.
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self.layer = device.texture(*pixels, "rgba32float")
        self.size = pixels
        self._frame = device.buffer(size=FRAME.itemsize)
        self._lights: list[Any] = []
        self._shadows: list[Any] = []
        self._pipelines: list[Any] = []
        self._path, self._more = WALK, tuple[Any, ...]()  # the shader, and what it binds beside what all do
        self._names: list[str] = []
        self._layers = [self.layer, self.layer]
        self._binds: dict[Any, tuple[tuple[Any, ...], Any]] = {}

    def aim(
        self,
        view: Any,
        projection: Any,
        lamps: Sequence[tuple[Lamp, Shadow | None]],
        air: Settled,
        *,
        jitter: str = "blue",
        share: float = 1.0,
    ) -> None:
        """What the next `record` sees: matrices (4, 4), world to view space and view to clip space; lamps with their shadow maps.

        jitter: of steps, as Parameters.jitter. share: of the picture's width and height, that the march is computed at.
        """
        width, height = self.pixels
        self._resize((max(1, round(width * share)), max(1, round(height * share))), len(lamps))
        self.device.queue.write_buffer(self._frame, 0, frame_record(projection, air, self.size, self.pixels).tobytes())
        while len(self._lights) < max(len(lamps), 1):
            self._lights.append(self.device.buffer(size=LIGHT.itemsize))
        nothing = no_shadow(self.device)
        path, more = (WALK, tuple[Any, ...]()) if air.exact else (STEPS, (noise_texture(self.device),))
        if path != self._path:
            self._path, self._more = path, more
            self._binds.clear()
        self._shadows = [nothing if shadow is None else shadow.texture for _, shadow in lamps] or [nothing]
        self._names = [lamp.kind for lamp, _ in lamps] or ["ambient"]
        self._pipelines = []
        for i, (lamp, shadow) in enumerate(lamps):
            self.device.queue.write_buffer(self._lights[i], 0, light_record(lamp, shadow, view, air).tobytes())
            biased = bool(air.march.shadow_bias)
            chosen = {"KIND": KINDS[lamp.kind], "PHASE": air.lobes(lamp)[0], "FIRST": i == 0, "BIASED": biased}
            if not air.exact:
                chosen |= {"JITTER": JITTERS[jitter], "FILTER": FILTERS.index(air.march.shadow_filter)}
                chosen["SNAP"] = air.march.snap
                chosen["CASCADES"] = lamp.is_sun and shadow is not None and len(shadow.views) > 1
            self._pipelines.append(self.device.pipeline(path, "march", **chosen))
        if not lamps:
            self._pipelines.append(self.device.pipeline(path, "march", KIND=DARKNESS))

    def _resize(self, size: tuple[int, int], lights: int) -> None:
        """Layers for what is computed, of a size: what is last written is the first of them."""
        if size != self.size or (lights > 1 and self._layers[0] is self._layers[1]):
            self.size = size
            first = self.layer if size == self.pixels else self.device.texture(*size, "rgba32float")
            self._layers = [first, self.device.texture(*size, "rgba32float") if lights > 1 else first]
            self._binds.clear()

    def _bound(self, key: Any, path: str, parts: tuple[Any, ...], more: tuple[Any, ...] = ()) -> Any:
        """A bind group of what all shaders of a march read, made anew where one of `parts` is another than before."""
        had = self._binds.get(key)
        if had is None or any(a is not b for a, b in zip(had[0], parts, strict=True)):
            maps = parts[3].create_view(dimension="2d-array")
            had = self._binds[key] = parts, self.device.bind(path, *parts[:3], maps, *parts[4:], *more)
        return had[1]

    def _of_light(self, i: int, depth: Any) -> Any:
        """The bind group of the i-th light."""
        last = len(self._shadows) - 1
        target, before = self._layers[(last - i) % 2], self._layers[(last - i + 1) % 2]
        if before is target:  # one light alone reads nothing
            before = _spare(self.device)
        parts = (self._frame, self._lights[i], depth, self._shadows[i], before, target)
        return self._bound(i, self._path, parts, self._more)

    def record(self, encoder: Any, depth: Any, timer: Timer | None = None) -> None:
        """Record the march, from the picture's depth, depth32float, a texture or its view, to `layer`."""
        counts = (-(-self.size[0] // GROUP), -(-self.size[1] // GROUP))
        for i, (pipeline, name) in enumerate(zip(self._pipelines, self._names, strict=True)):
            compute(encoder, pipeline, self._of_light(i, depth), counts, f"march {name}", timer)
        if self.size != self.pixels:
            counts = (-(-self.pixels[0] // GROUP), -(-self.pixels[1] // GROUP))
            parts = (self._frame, self._lights[0], depth, no_shadow(self.device), self._layers[0], self.layer)
            pipeline = self.device.pipeline(UPSAMPLE, "upsample")
            compute(encoder, pipeline, self._bound("upsample", UPSAMPLE, parts), counts, "upsample", timer)


def _spare(device: Device) -> Any:
    """What is bound where nothing is read."""
    if "spare" not in device.kept:
        device.kept["spare"] = device.texture(1, 1, "rgba32float", target=False)
        device.write(device.kept["spare"], np.zeros(4, np.float32).tobytes(), 16)
    return device.kept["spare"]
