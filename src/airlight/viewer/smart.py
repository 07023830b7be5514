"""The smart look on a picture as the viewer shows it: on all of its pixels while it rests, on a copy as large as it is seen in a drag."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.timing import compute
from airlight.lights import ImageLight
from airlight.look import measure
from airlight.look.grid import Array, RayGrid
from airlight.look.measure import Small
from airlight.look.plan import LookPlan
from airlight.look.resolve import FINENESS, ResolvedLook, resolve
from airlight.options import Look
from airlight.options.words import in_panel
from airlight.reference.look import Tones

LAY = "viewer/lay.wgsl"
DRAFT_SIDE = 240  # px of the longer side of what is measured while something is dragged


class LookView:
    """The look on one copy of a picture; a further light or setting allocates nothing.

    pixels: (H, W, 4) uint8 sRGB codes, or float32 linear Rec. 709; small: the copy that is measured, white at 1; white: of the picture;
    quality: as `plan.FIELDS`; grey: it has no colours. `before` and `result` are the textures to show.
    """

    def __init__(self, device: Device, pixels: Array, small: Small, white: float, quality: str, grey: bool, picture: Any = None) -> None:
        height, width = pixels.shape[:2]
        self.device, self.small, self.white, self.is_codes = device, small, white, pixels.dtype == np.uint8
        self.plan = LookPlan(device, (width, height), self.is_codes, quality=quality, picture=picture, small_size=small.size)
        self.plan.upload(pixels, small.guide, None, white)
        self.quality, self.grey = quality, grey
        self.before, self.lit = self.plan.picture, self.plan.result
        self.done: Any = None  # what it shows
        self.resolved: ResolvedLook | None = None
        self._haze: Array | None = None
        self._seen: dict[int, dict[Any, tuple[Array, Array]]] = {}  # by light, by what was requested
        self._held: dict[int, Any] = {}  # by light, of which bands the plan holds
        if not self.is_codes:
            self.lit = device.texture(width, height, "rgba16float")
            uniform = device.buffer(np.array([white, 0, 0, 0], np.float32).tobytes(), uniform=True)
            self._lay = device.pipeline(LAY, "put")
            self._lay_bind = device.bind(LAY, uniform, self.before, self.plan.result, self.lit)

    def drop(self) -> None:
        """Let go of textures at once, instead of when cycles are collected."""
        self.plan.lights.clear()
        self._seen.clear()

    def forget(self) -> None:
        """Compute all anew, where it was left unfinished."""
        self.done = None
        self._seen.clear()
        self._held.clear()

    @property
    def size(self) -> tuple[int, int]:
        return self.plan.size

    @property
    def result(self) -> Any:
        """Give the texture of the picture with its shafts."""
        return self.lit if self.resolved is not None and self.resolved.changes else self.before

    def update(self, lights: Sequence[ImageLight], look: Look, passes: list[tuple[str, float]] | None = None) -> None:
        """Settle the look for these lights, and put it on the picture. passes: takes the time of each."""
        hazy = measure.wants_haze(lights)
        if hazy and self._haze is None:
            self._haze = measure.haze_nearness(self.small)
        if hazy != (self.small.near is not None):
            self.small.near = self._haze if hazy else None
            self.plan.hide(self.small.guide, self.small.near)
        wanted: dict[int, BandRequest] = {}
        if passes is not None:
            self._seen.clear()

        def bands(number: int, grid: RayGrid, tones: Tones, parts: Array, fineness: float, pattern: Array | None) -> tuple[Array, Array]:
            wanted[number] = BandRequest(number, grid, tones, parts, fineness, pattern)
            return self._see(wanted[number], passes)

        resolved = resolve(self.small, self.size, lights, look, bands, additive=not self.is_codes, grey=self.grey)
        if resolved.changes:
            for number, last in wanted.items():
                if self._held.get(number) != last.key:  # others were requested since, and these were known
                    self._see(last, passes, again=True)
            self.plan.set_lights([one.settings for one in resolved.lights], resolved.strength, resolved.shade, resolved.dark)
            self.plan.submit(self.plan.record, *(() if self.is_codes else (self._record_lay,)), profile=passes)
        self.resolved = resolved

    def _see(self, request: "BandRequest", passes: Any, again: bool = False) -> tuple[Array, Array]:
        """Find the bands of a light; the last two that were needed are known. again: the plan has to hold them."""
        key, known = request.key, self._seen.setdefault(request.number, {})
        if key not in known or again:
            while len(known) > 1:
                del known[next(iter(known))]
            rest = request.grid, request.tones, request.parts, request.fineness, request.pattern
            known[key] = self.plan.see(request.number, *rest, passes)
            self._held[request.number] = key
        return known[key]

    def _record_lay(self, encoder: Any, timer: Any = None) -> None:
        compute(encoder, self._lay, self._lay_bind, (-(-self.size[0] // 64), self.size[1]), "lay", timer)

    @property
    def message(self) -> str:
        """Find what there is to say about the picture, as the panel says it."""
        return "" if self.resolved is None else in_panel(self.resolved.message)

    def unset(self) -> dict[str, Any]:
        """Tell what unset parameters are for the first light."""
        if self.resolved is None or not self.resolved.lights:
            return {}
        one = self.resolved.lights[0]
        ring = measure.ring_color(self.small, one.settings.tones, one.settings.grid)
        return {
            "warmth": 0.0 if self.grey else measure.own_warmth(ring, one.kind),
            "length": float(f"{one.settings.length:.3g}"),
            "fineness": FINENESS,
            "shade": self.resolved.shade,
            "rays": one.rays,
        }

    def matte(self, number: int) -> Any:
        """Give the texture of what emits towards a light, in its green channel."""
        return self.plan.lights[min(number, len(self.plan.lights) - 1)].matte


@dataclass
class BandRequest:
    """Says which bands of a light are needed; the arguments of `plan.see`."""

    number: int
    grid: RayGrid
    tones: Tones
    parts: Array
    fineness: float
    pattern: Array | None

    @property
    def key(self) -> Any:
        """Collect what they depend on; the parts follow from the grid and the tones."""
        return self.grid, self.tones, self.fineness, None if self.pattern is None else self.pattern.tobytes()
