"""Plans and records slices: planes at right angles to the view through the volumes that lights fill, in a medium."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import among, parts, strips, tell
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import FOGS, ResolvedMedium
from airlight.scatter.march.cookies import SHAPES, Cookies, shape_of
from airlight.scatter.march.march import BEGIN, FILTERS, TRANSMIT, UPSAMPLE, no_shadow, passes_of
from airlight.scatter.march.records import FRAME, LIGHT, dark_record, frame_record, light_record
from airlight.scatter.march.variance import Moments
from airlight.scatter.slices.records import SLICING, slicing_record
from airlight.shadows import Shadow

SLICES, AVERAGE = "scatter/slices/slices.wgsl", "scatter/slices/average.wgsl"
GROUP = 8  # invocations along a workgroup
PLANES = 64  # where none are given
UPSAMPLED = 2  # pixels, of a cell whose mean the filter has that enlarges smaller pictures
Lit = tuple[PunctualLight, Shadow | None]


class Slices:
    """Adds up the slices of lights in a medium, with a layout as march.March has; see there for layer, transmittance and `update`.

    What varies in the medium's density, and what lies behind surfaces that are seen through, it does not know.
    """

    path, entry = SLICES, "slice"
    writes_layer = True  # at the picture's size, without a pass at the end

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels, self.size = device, pixels, (0, 0)
        self.layer = device.texture(*pixels, "rgba32float")
        self.transmittance: Any = device.texture(*pixels, "rgba32float")
        self.targets: list[Any] = []  # of `size`, written in turn; the last result is in the first
        self._buffers: list[tuple[Any, ...]] = []  # a light: frame, light, slicing, extent
        self._cookies = Cookies(device)
        self._nothing = device.texture(1, 1, "rgba32float", target=False)  # is bound where nothing is read
        self._passes: list[Any] = []
        self._begins: dict[int, tuple[int, int]] = {}  # pixels at which the next pass of a light begins, where not at the first
        self._moments = Moments(device)
        self._glass: list[Any] = []  # a light
        self._no_glass = device.buffer(size=16)
        self._radius: int | None = None  # of the moments, where they are needed
        self._drawn: list[Any] = []
        self._cell, self._cells = 1, device.buffer(size=16)

    @property
    def extents(self) -> list[Any]:
        """List the buffers of where each light was seen last: the least and the most ahead of the eye, m, two float32."""
        return [extent for *_, extent in self._buffers[: len(self._passes)]]

    @staticmethod
    def resolve(medium: ResolvedMedium) -> ResolvedMedium:
        """Takes the density to be that of the air and its fog by height alone."""
        if not medium.varies:
            return medium
        settings = msgspec.structs.replace(medium.settings, noise_amount=0.0)
        sigma_t, sigma_s = medium.sigma_t * medium.air, medium.sigma_s * medium.air
        return dataclasses.replace(medium, settings=settings, fields=(), air=1.0, sigma_t=sigma_t, sigma_s=sigma_s)

    def update(
        self,
        view: Any,
        projection: Any,
        lights: Sequence[Lit],
        medium: ResolvedMedium,
        *,
        jitter: str = "fixed",
        share: float = 1.0,
    ) -> None:
        """Set what the next `record` sees. medium: as `resolve` gives it. Raises AirlightError."""
        view = np.asarray(view, np.float64)
        passes = self._ordered(lights, medium, view)
        size = (max(1, round(self.pixels[0] * share)), max(1, round(self.pixels[1] * share)))
        self._cell = self._averaged(medium)
        if self._cell == UPSAMPLED and size != self.pixels:
            self._cell = 1  # what it is enlarged by has the same mean
        if size != self.size:
            first = self.layer if size == self.pixels and self.writes_layer else self.device.texture(*size, "rgba32float")
            self.size, self.targets = size, [first, self.device.texture(*size, "rgba32float")]
        self.device.queue.write_buffer(self._cells, 0, np.array([self._cell] * 4, np.uint32).tobytes())
        while len(self._buffers) < len(passes):
            made = [self.device.buffer(size=dtype.itemsize, uniform=True) for dtype in (FRAME, LIGHT)]
            self._buffers.append((*made, self.device.buffer(size=SLICING.itemsize), self.device.buffer(size=16)))
        self._passes, self._begins = [], {}
        for i, (light, shadow) in enumerate(passes):
            frame = frame_record(view, projection, medium if light is None else light.own_medium(medium), self.size, self.pixels)
            own = dark_record(medium) if light is None else light_record(light, shadow, view, medium)
            slicing = np.zeros((), SLICING) if light is None else self._slicing(light, shadow, view, medium)
            for buffer, record in zip(self._buffers[i], (frame, own, slicing), strict=False):
                self.device.queue.write_buffer(buffer, 0, record.tobytes())
            constants = {"FOG": FOGS.index(medium.settings.fog), "FIRST": i == 0, **self._constants(light, shadow, medium)}
            texture = no_shadow(self.device) if shadow is None else shadow.texture
            picture = (self._cookies.none, self.device.sampler()) if light is None else self._cookies.of(light)
            word = "ambient" if light is None else light.word
            self._passes.append((constants, texture.create_view(dimension="2d-array"), picture, word, light))
        self._fog = {"FOG": FOGS.index(medium.settings.fog)}
        averaged = medium.march.shadow_filter == "variance"
        self._radius = medium.march.variance_radius if averaged else None
        nothing = no_shadow(self.device)
        maps = [nothing if shadow is None else shadow.texture for _, shadow in passes]
        self._moments.fit(maps if averaged else [nothing] * len(passes))
        self._drawn = [None if shadow is None else shadow.drawn for _, shadow in passes]
        self._glass = [None if shadow is None else shadow.glass for _, shadow in passes]

    def _ordered(self, lights: Sequence[Lit], medium: ResolvedMedium, view: np.ndarray) -> Sequence[Any]:
        return passes_of(lights, medium, np.linalg.inv(view)[:3, 3])

    def _averaged(self, medium: ResolvedMedium) -> int:
        return medium.march.plane_cell

    def _slicing(self, light: PunctualLight, shadow: Shadow | None, view: np.ndarray, medium: ResolvedMedium) -> np.ndarray:
        """Fill a light's record, whose box is measured on the device."""
        box = np.zeros(3), np.zeros(3)
        return slicing_record(light, shadow, view, box, medium.march.planes or PLANES, medium.march.plane_cell)

    def _constants(self, light: PunctualLight | None, shadow: Shadow | None, medium: ResolvedMedium) -> dict[str, Any]:
        if light is None:
            return {"LIT": False}
        march = medium.march
        found = {**light.flags, "PHASE": medium.lobes(light.anisotropy)[0], "BIASED": bool(march.shadow_bias)}
        found |= {"FADES": light.directional and medium.fades_suns, "FILTER": FILTERS.index(march.shadow_filter), "SNAP": march.snap}
        found |= {"CASCADES": light.directional and shadow is not None and len(shadow.views) > 1, "SHADOW": march.plane_shadow}
        found |= {"SHAPE": SHAPES.index(shape_of(light)) * march.plane_cookie, "FALLS": light.falloff_terms() != (1.0, 0.0, 0.0)}
        if shadow is not None:
            found |= {"GLASS": march.plane_shadow and shadow.glass is not None, "COLOURED": shadow.coloured}
        return found

    def record(self, encoder: Any, depth: Any, timer: Timer | None = None) -> None:
        """Records the slices, from the picture's depth, depth32float, a texture or its view, to `layer`."""
        counts = (-(-self.size[0] // GROUP), -(-self.size[1] // GROUP))
        stages = len(self._passes) + (self._cell > 1)
        if self._radius is not None:
            self._moments.record(encoder, self._radius, self._drawn, timer)
        for i, (constants, shadow, picture, word, light) in enumerate(self._passes):
            among(i, len(self._passes))
            target, before = self.targets[(stages - 1 - i) % 2], self.targets[(stages - i) % 2]
            bind = self._of_light(i, depth, shadow, picture, before, target)
            self._measure(encoder, i, light, constants, bind, counts, timer)
            self._divided(encoder, i, self.device.pipeline(self.path, self.entry, **constants), bind, counts, word, timer)
        frame, own = self._buffers[0][:2]
        shadow = self._passes[0][1]
        if self._cell > 1:
            pipeline = self.device.pipeline(AVERAGE, "average")
            bind = self.device.bind(AVERAGE, frame, own, depth, shadow, self.targets[1], self.targets[0], self._cells)
            compute(encoder, pipeline, bind, counts, "slices average", timer)
        self._finish(encoder, depth, shadow, counts, timer)

    def _divided(self, encoder: Any, i: int, pipeline: Any, bind: Any, counts: tuple[int, int], word: str, timer: Timer | None) -> None:
        """Records a light's pass, in parts where work is carried out in slices."""
        done, kind = 0, (self.path, self.entry, word, counts)
        for column, across in strips(counts[0], kind):
            for row, down in parts(counts[1], spread=True, kind=kind):
                begin = column * GROUP, row * GROUP
                if begin != self._begins.get(i, (0, 0)):
                    self._begins[i] = begin
                    self.device.queue.write_buffer(self._buffers[i][1], BEGIN, np.array(begin, np.uint32).tobytes())
                compute(encoder, pipeline, bind, (across, down), f"slices {word}", timer)
                done += across * down
                tell(done / (counts[0] * counts[1]))

    def _of_light(self, i: int, depth: Any, shadow: Any, picture: Any, before: Any, target: Any) -> Any:
        frame, light, slicing, extent = self._buffers[i]
        self.device.pipeline(self.path, self.entry, **self._passes[i][0])
        own = *self._extra(i, extent), self._moments.views[i], *picture
        before = self._nothing if i == 0 else before  # the first reads nothing
        return self.device.bind(self.path, frame, light, depth, shadow, before, target, slicing, *own)

    def _extra(self, i: int, extent: Any) -> tuple[Any, ...]:
        """List what the shader binds after a light's record: with where the light is seen, what glass leaves of it."""
        return extent, self._glass[i] or self._no_glass

    def _measure(self, encoder: Any, i: int, light: Any, constants: Any, bind: Any, counts: Any, timer: Timer | None) -> None:
        """Records how far ahead a light's volume is seen."""
        if light is None:
            return
        extent = self._buffers[i][3]
        self.device.queue.write_buffer(extent, 0, np.array([0x7F7FFFFF, 0], np.uint32).tobytes())
        compute(encoder, self.device.pipeline(self.path, "measure", **constants), bind, counts, "slices box", timer)

    def _finish(self, encoder: Any, depth: Any, shadow: Any, counts: tuple[int, int], timer: Timer | None) -> None:
        """Records what brings the result to the picture's size, and the transmittance."""
        frame, light = self._buffers[0][:2]
        bound = frame, light, depth, shadow
        if self.size == self.pixels:
            pipeline = self.device.pipeline(TRANSMIT, "transmit", **self._fog)
            bind = self.device.bind(TRANSMIT, *bound, self._nothing, self.transmittance)
            compute(encoder, pipeline, bind, counts, "slices transmittance", timer)
            return
        counts = (-(-(self.size[0] + 1) // GROUP), -(-(self.size[1] + 1) // GROUP))
        pipeline = self.device.pipeline(UPSAMPLE, "upsample", **self._fog)
        bind = self.device.bind(UPSAMPLE, *bound, self.targets[0], self.layer, self.transmittance)
        compute(encoder, pipeline, bind, counts, "upsample", timer)
