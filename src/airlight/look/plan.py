"""The look's passes on the GPU: planned once for pictures of a size and kind, recorded for each picture and light."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute, timing
from airlight.look.grid import LINES, RADII, Array, RayGrid
from airlight.look.measure import SIDE
from airlight.noise import dither
from airlight.planes import shrunk_size
from airlight.reference.look import BREADTHS, COARSE, DRAWN, RaySettings, Tones, coarse_sigma

FIELDS = {"draft": 640, "normal": 1024, "final": 2048}  # px of the longer side of the copy on which rays are found, by quality
RAYS = np.dtype(
    [("box", "f4", 2), ("light", "f4", 2)]
    + [(n, "f4") for n in ("start", "span", "nearest", "step", "surroundings", "tone_span")]
    + [("inside", "u4")]
    + [(n, "f4") for n in ("fine", "narrow", "wide", "own", "drawn", "deviation", "rest", "length", "mist")]
    + [("color", "f4", 3), ("", "f4")]
)
LOOK = np.dtype([("strength", "f4"), ("shade", "f4"), ("", "f4", 2)])
SHRINK, MATTE, BANDS, GLANCE, FIELD_SUM = (f"look/{name}.wgsl" for name in ("shrink", "matte", "bands", "glance", "field"))
CODES, LAYER = "look/codes.wgsl", "look/layer.wgsl"


class _LightRays:
    """One light's matte, lines and bands."""

    def __init__(self, plan: "LookPlan", number: int) -> None:
        device = plan.device
        self.values = np.zeros((), RAYS)
        self.uniform = device.buffer(size=RAYS.itemsize, uniform=True)
        self.lets = device.texture(*plan.small_size, "rgba16float", target=False)
        self.matte = device.texture(*plan.field_size, "rgba16float")
        self.bands = device.texture(LINES + 2, RADII, "rgba16float")
        self.pattern = device.buffer(size=4 * LINES)
        self.field = device.texture(*plan.field_size, "rgba16float")
        sampler, groups = device.sampler(), LINES // COARSE
        self.emit = device.pipeline(MATTE, "emit")
        entries = ("scan", "smooth_lines", "group_lines", "mean_lines", "stand_out")
        self.steps = [device.pipeline(BANDS, entry) for entry in entries]
        self.counts = [(LINES // 32, 1), *((-(-count // 64), RADII) for count in (LINES, groups, groups, LINES + 2))]
        self.glance = device.pipeline(GLANCE, "glance", COLUMNS=plan.small_size[0], ROWS=plan.small_size[1])
        self.gathers = [device.pipeline(FIELD_SUM, "gather", ADD=number > 0, LAST=last) for last in (False, True)]
        before = plan.lights[number - 1].field if number else self.bands
        self.matte_bind = device.bind(MATTE, self.uniform, plan.small, self.lets, sampler, self.matte)
        self.bands_bind = device.bind(BANDS, self.uniform, self.matte, sampler, self.pattern, *plan.lines, self.bands)
        self.glance_bind = device.bind(GLANCE, self.uniform, self.bands, sampler, plan.seen)
        rest = plan.small, plan.guide, sampler, before, self.field
        self.field_bind = device.bind(FIELD_SUM, self.uniform, plan.uniform, self.bands, self.matte, *rest)


class LookPlan:
    """All passes for pictures of one size and kind, with their textures: a further picture, light or setting allocates nothing.

    picture: rgba8unorm (sRGB codes, `is_codes`) or rgba32float (linear). Call `upload`, for each light `see`, then `settle` and `read`.
    """

    def __init__(self, device: Device, size: tuple[int, int], is_codes: bool, near: bool = False, quality: str = "normal") -> None:
        self.device, self.size, self.is_codes = device, size, is_codes
        self.small_size = shrunk_size(*size, SIDE)
        self.field_size = shrunk_size(*size, FIELDS[quality])
        self.picture = device.texture(*size, "rgba8unorm" if is_codes else "rgba32float", target=False)
        self.small = device.texture(*self.field_size, "rgba16float")
        self.guide = device.texture(*self.small_size, "rgba16float", target=False)
        self.near = device.texture(*size, "r16float", target=False) if near else self.guide
        self.seen = device.buffer(size=16 * self.small_size[0] * self.small_size[1])
        groups = LINES // COARSE
        self.lines = [device.buffer(size=8 * RADII * count) for count in (LINES, LINES, groups, groups)]
        self.scale = device.buffer(size=16, uniform=True)
        taps = 1 if self.field_size == size else math.ceil(max(n / m for n, m in zip(size, self.field_size, strict=True))) + 1
        self.shrink = device.pipeline(SHRINK, "shrink", TAPS=taps, CODES=is_codes)
        self.shrink_bind = device.bind(SHRINK, self.scale, self.picture, self.small)
        self.lights: list[_LightRays] = []
        self.uniform = device.buffer(size=LOOK.itemsize, uniform=True)
        path = CODES if is_codes else LAYER
        if is_codes:
            self.put = device.raster(path, "cover", "put", "rgba8unorm", NEAR_GIVEN=near)
        else:
            self.put = device.pipeline(path, "put", NEAR_GIVEN=near)
        self.result = device.texture(*size, "rgba8unorm" if is_codes else "rgba16float")
        self.puts: dict[int, Any] = {}
        if is_codes:
            tile = np.ones((256, 256, 4), np.float32)
            tile[..., :3] = dither()
            self.noise = device.texture(256, 256, "rgba32float", target=False)
            device.write(self.noise, tile, 256 * 16)
        self.timer: Timer | None = None
        self.white = 1.0

    def _run(self, label: str, encoder: Any, pipeline: Any, bind: Any, size: tuple[int, int], timer: Timer | None) -> None:
        compute(encoder, pipeline, bind, (-(-size[0] // 64), size[1]), label, timer)

    def submit(self, profile: list[tuple[str, float]] | None, *records: Any) -> None:
        """Record and submit some passes; their times (label, ms) are added to `profile`."""
        if profile is not None and self.timer is None:
            self.timer = Timer(self.device)
        timer = self.timer if profile is not None else None
        encoder = self.device.encoder()
        for record in records:
            record(encoder, timer)
        if timer:
            timer.resolve(encoder)
        self.device.submit(encoder)
        if timer and profile is not None:
            profile += timer.milliseconds()

    def upload(self, picture: Array, guide: Array, near: Array | None, white: float = 1.0, profile: Any = None) -> None:
        """picture: (H, W, 4), as the texture holds it; guide: (h, w, 2) of the small copy; near: (H, W) where it was planned for, else
        (h, w) or None."""
        self.device.write(self.picture, np.ascontiguousarray(picture), picture.shape[1] * picture[0, 0].nbytes)
        self.white = white
        self.device.queue.write_buffer(self.scale, 0, np.array([1 / white, 0, 0, 0], np.float32).tobytes())
        self.hide(guide, near)
        self.submit(profile, self.record_shrink)

    def hide(self, guide: Array, near: Array | None) -> None:
        """What smooths the picture's lightness, and how near things are; arguments as `upload`."""
        values = np.zeros((*guide.shape[:2], 4), np.float16)
        values[..., :2] = guide
        if near is not None and self.near is self.guide:
            values[..., 2] = near
        elif near is not None:
            self.device.write(self.near, near.astype(np.float16), 2 * self.size[0])
        self.device.write(self.guide, values, 8 * self.small_size[0])

    def record_shrink(self, encoder: Any, timer: Timer | None = None) -> None:
        self._run("small copy", encoder, self.shrink, self.shrink_bind, self.field_size, timer)

    def see(
        self, number: int, grid: RayGrid, tones: Tones, parts: Array, fineness: float, pattern: Array | None = None, profile: Any = None
    ) -> tuple[Array, Array]:
        """The bands of light `number` at the small copy's pixels, (h, w, 3), and their distances from it, (h, w)."""
        while len(self.lights) <= number:
            self.lights.append(_LightRays(self, len(self.lights)))
        rays = self.lights[number]
        v = rays.values
        v["box"], v["light"], v["start"], v["span"] = grid.box, grid.light, grid.start, grid.span
        v["nearest"], v["step"], v["inside"] = grid.nearest, grid.step, grid.inside
        v["surroundings"], v["tone_span"] = tones.surroundings, tones.span
        v["fine"] = grid.lines(fineness)
        v["narrow"], v["wide"] = (coarse_sigma(grid, degrees) for degrees in BREADTHS)
        v["own"], v["drawn"] = DRAWN if pattern is not None else (0.0, 0.0)
        v["deviation"] = v["rest"] = v["length"] = 1.0
        queue = self.device.queue
        queue.write_buffer(rays.uniform, 0, v.tobytes())
        if pattern is not None:
            queue.write_buffer(rays.pattern, 0, np.ascontiguousarray(pattern, np.float32).tobytes())
        lets = np.zeros((*parts.shape, 4), np.float16)
        lets[..., 0] = parts
        self.device.write(rays.lets, lets, 8 * self.small_size[0])

        def record(encoder: Any, timer: Timer | None) -> None:
            self._run("matte", encoder, rays.emit, rays.matte_bind, self.field_size, timer)
            for pipeline, count in zip(rays.steps, rays.counts, strict=True):
                compute(encoder, pipeline, rays.bands_bind, count, "rays", timer)
            self._run("glance", encoder, rays.glance, rays.glance_bind, self.small_size, timer)

        self.submit(profile, record)
        width, height = self.small_size
        seen = np.frombuffer(queue.read_buffer(self.seen), np.float32).reshape(height, width, 4).astype(np.float64)
        return seen[..., :3], seen[..., 3]

    def settle(self, lights: Sequence[RaySettings], strength: float, shade: float) -> None:
        """Set what was measured of the lights seen, in their order."""
        for rays, s in zip(self.lights, lights, strict=False):
            v = rays.values
            v["deviation"], v["rest"], v["length"], v["mist"] = s.deviation, s.rest, s.length, s.mist
            v["color"] = np.array(s.color) * s.weight
            self.device.queue.write_buffer(rays.uniform, 0, v.tobytes())
        values = np.zeros((), LOOK)
        values["strength"], values["shade"] = strength, shade
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        self.count = len(lights)

    def record(self, encoder: Any, timer: Timer | None = None) -> None:
        """Record the passes from bands to `result`."""
        for number, rays in enumerate(self.lights[: self.count], 1):
            self._run("field", encoder, rays.gathers[number == self.count], rays.field_bind, self.field_size, timer)
        if self.count not in self.puts:
            common = [self.lights[self.count - 1].field, self.near, self.device.sampler(), self.picture]
            rest = [self.noise] if self.is_codes else [self.scale, self.result]
            self.puts[self.count] = self.device.bind(CODES if self.is_codes else LAYER, *common, *rest)
        if not self.is_codes:
            self._run("composite", encoder, self.put, self.puts[self.count], self.size, timer)
            return
        onto = {"view": self.result.create_view(), "load_op": "clear", "store_op": "store"}
        run = encoder.begin_render_pass(color_attachments=[onto], **timing(timer, "composite", encoder))
        run.set_pipeline(self.put)
        run.set_bind_group(0, self.puts[self.count])
        run.draw(3)
        run.end()

    def read(self, profile: Any = None) -> Array:
        """Run the last passes: (H, W, 4) uint8 codes, or float16: what is added, white at 1, and the share that is taken."""
        self.submit(profile, self.record)
        width, height = self.size
        if self.is_codes:
            return np.frombuffer(self.device.read(self.result, 4), np.uint8).reshape(height, width, 4)
        return np.frombuffer(self.device.read(self.result, 8), np.float16).reshape(height, width, 4)
