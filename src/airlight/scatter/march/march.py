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

WALK, STEPS, UPSAMPLE, TILES = (f"scatter/march/{name}.wgsl" for name in ("walk", "steps", "upsample", "tiles"))
KINDS = {"sun": 0, "spot": 1, "point": 2}
DARKNESS = 3  # the kind of no light at all
FILTERS = ("nearest", "pcf", "soft")
GROUP = 8  # a workgroup is GROUP x GROUP
TILE = 8  # texels along a tile of a shadow map, and tiles along a tile of tiles


def tiles(size: int) -> int:
    """How many tiles of both kinds a view of a shadow map of size x size has."""
    fine, coarse = -(-size // TILE), -(-size // TILE**2)
    return fine * fine + coarse * coarse


def no_shadow(device: Device) -> Any:
    """The shadow map of lights that have none."""
    if "no shadow" not in device.kept:
        usage = device.wgpu.TextureUsage
        flags = usage.TEXTURE_BINDING | usage.RENDER_ATTACHMENT
        device.kept["no shadow"] = device.device.create_texture(size=(1, 1, 1), format="depth32float", usage=flags)
    return device.kept["no shadow"]


class March:
    """Lights in a medium, for pictures of a size (width, height).

    layer, transmittance: textures of that size, rgba32float, of the last `record`. layer: in-scattered radiance, and in alpha the length
    of the ray in the medium, metres. transmittance: RGB, 0..1, of that length.
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self.layer = device.texture(*pixels, "rgba32float")
        self.transmittance = device.texture(*pixels, "rgba32float")
        self.size = pixels
        self._frame = device.buffer(size=FRAME.itemsize, uniform=True)
        self._lights: list[Any] = []
        self._shadows: list[Any] = []
        self._pipelines: list[Any] = []
        self._tiles: list[Any] = []  # a buffer each light
        self._path = WALK
        self._names: list[str] = []
        self._layers = [self.layer, self.layer]
        self._binds: dict[Any, tuple[tuple[Any, ...], Any]] = {}

    @staticmethod
    def resolve(air: Settled) -> Settled:
        """Keep every setting: the march follows all of them."""
        return air

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
            self._lights.append(self.device.buffer(size=LIGHT.itemsize, uniform=True))
        nothing = no_shadow(self.device)
        path = WALK if air.exact else STEPS
        if path != self._path or len(lamps) < len(self._shadows):  # none holds on to the maps of lights that are gone
            self._path = path
            self._binds.clear()
        self._shadows = [nothing if shadow is None else shadow.texture for _, shadow in lamps] or [nothing]
        if air.exact:
            self._fit_tiles()
        self._names = [lamp.kind for lamp, _ in lamps] or ["ambient"]
        self._pipelines = []
        small = self.size != self.pixels
        for i, (lamp, shadow) in enumerate(lamps):
            self.device.queue.write_buffer(self._lights[i], 0, light_record(lamp, shadow, view, air).tobytes())
            biased = bool(air.march.shadow_bias)
            chosen = {"KIND": KINDS[lamp.kind], "PHASE": air.lobes(lamp)[0], "FIRST": i == 0, "BIASED": biased, "UPSAMPLED": small}
            if not air.exact:
                chosen |= {"JITTER": JITTERS[jitter], "FILTER": FILTERS.index(air.march.shadow_filter)}
                chosen["SNAP"] = air.march.snap
                chosen["CASCADES"] = lamp.is_sun and shadow is not None and len(shadow.views) > 1
            self._pipelines.append(self.device.pipeline(path, "march", **chosen))
        if not lamps:
            self._pipelines.append(self.device.pipeline(path, "march", KIND=DARKNESS, UPSAMPLED=small))

    def _fit_tiles(self) -> None:
        """Have a buffer for the tiles of each light's shadow map."""
        del self._tiles[len(self._shadows) :]
        for i, texture in enumerate(self._shadows):
            size = 4 * tiles(texture.size[0]) * texture.size[2]
            if i == len(self._tiles) or self._tiles[i].size != size:
                self._tiles[i : i + 1] = [self.device.buffer(size=size)]

    def _resize(self, size: tuple[int, int], lights: int) -> None:
        """Layers for what is computed, of a size: what is last written is the first of them."""
        if size != self.size or (lights > 1 and self._layers[0] is self._layers[1]):
            self.size = size
            first = self.layer if size == self.pixels else self.device.texture(*size, "rgba32float")
            self._layers = [first, self.device.texture(*size, "rgba32float") if lights > 1 else first]
            self._binds.clear()

    def _bound(self, key: Any, path: str, *parts: Any) -> Any:
        """A bind group, made anew where one of `parts` is another than before; of a shadow map it holds all layers."""
        had = self._binds.get(key)
        if had is None or any(a is not b for a, b in zip(had[0], parts, strict=True)):
            seen = [part.create_view(dimension="2d-array") if any(part is one for one in self._shadows) else part for part in parts]
            had = self._binds[key] = parts, self.device.bind(path, *seen)
        return had[1]

    def _of_light(self, i: int, depth: Any) -> Any:
        """The bind group of the i-th light."""
        last = len(self._shadows) - 1
        target, before = self._layers[(last - i) % 2], self._layers[(last - i + 1) % 2]
        if before is target:  # one light alone reads nothing
            before = _spare(self.device)
        more = self._tiles[i] if self._path == WALK else noise_texture(self.device)
        light = self._lights[i]
        return self._bound(i, self._path, self._frame, light, depth, self._shadows[i], before, target, more, light, self.transmittance)

    def record(self, encoder: Any, depth: Any, timer: Timer | None = None) -> None:
        """Record the march, from the picture's depth, depth32float, a texture or its view, to `layer`."""
        if self._path == WALK:
            self._tile(encoder, timer)
        counts = (-(-self.size[0] // GROUP), -(-self.size[1] // GROUP))
        for i, (pipeline, name) in enumerate(zip(self._pipelines, self._names, strict=True)):
            compute(encoder, pipeline, self._of_light(i, depth), counts, f"march {name}", timer)
        if self.size != self.pixels:
            counts = (-(-(self.size[0] + 1) // GROUP), -(-(self.size[1] + 1) // GROUP))
            pipeline = self.device.pipeline(UPSAMPLE, "upsample")
            parts = (self._frame, self._lights[0], depth, self._shadows[0], self._layers[0], self.layer, self.transmittance)
            compute(encoder, pipeline, self._bound("upsample", UPSAMPLE, *parts), counts, "upsample", timer)

    def _tile(self, encoder: Any, timer: Timer | None) -> None:
        """Record what the walk passes over whole, of each shadow map."""
        for i, (texture, buffer) in enumerate(zip(self._shadows, self._tiles, strict=True)):
            if texture is no_shadow(self.device):
                continue
            size, _, layers = texture.size
            for entry, along in (("fine", TILE), ("coarse", TILE**2)):
                pipeline = self.device.pipeline(TILES, entry)
                count = -(-size // (along * GROUP))
                compute(encoder, pipeline, self._bound(("tiles", i), TILES, texture, buffer), (count, count, layers), "march tiles", timer)


def _spare(device: Device) -> Any:
    """What is bound where nothing is read."""
    if "spare" not in device.kept:
        device.kept["spare"] = device.texture(1, 1, "rgba32float", target=False)
        device.write(device.kept["spare"], np.zeros(4, np.float32).tobytes(), 16)
    return device.kept["spare"]
