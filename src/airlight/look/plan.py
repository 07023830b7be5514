"""The look's passes on the GPU: planned once for pictures of a size and kind, recorded for each picture and light."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import TimedSubmits, Timer, compute, timing
from airlight.lights.around import ENTRIES
from airlight.look.grid import LINES, RADII, Array, RayGrid
from airlight.look.measure import COPY_SIDE_PX, GLANCED
from airlight.noise import dither
from airlight.planes import shrunk_size
from airlight.reference.look import COARSE, DARK, DRAWN, THINNEST, RaySettings, Tones, breadths, coarse_sigma

FIELDS = {"draft": 640, "normal": 1024, "final": 2048}  # px of the longer side of the copy on which rays are found, by quality
GROUPS = LINES // COARSE
RAYS = struct_dtype("look/rays.wgsl", "Rays")
LOOK = struct_dtype("look/field.wgsl", "Look")
MATTE_CODES, MATTE_LINEAR, BANDS, GLANCE, AMOUNTS, SUMS, CODES, LAYER = (
    f"look/{name}.wgsl" for name in ("matte_codes", "matte_linear", "bands", "glance", "amounts", "field", "codes", "layer")
)


class _LightRays:
    """Holds one light's matte, lines and bands."""

    def __init__(self, plan: "LookPlan", number: int) -> None:
        device, sampler = plan.device, plan.device.sampler()
        self.plan, self.number = plan, number
        self.table: Array | None = None  # of its cookie
        self.values = np.zeros((), RAYS)
        self.uniform = device.buffer(size=RAYS.itemsize, uniform=True)
        self.may_emit = device.texture(*plan.small_size, "rgba16float", target=False)
        self.matte = device.texture(*plan.field_size, "rgba16float")
        self.bands = device.texture(LINES + 2, RADII, "rgba16float")
        self.amounts = device.texture(LINES + 2, RADII, "rgba16float")
        self.pattern = device.buffer(size=4 * LINES)
        self.field = device.texture(*plan.field_size, "rgba16float")
        self.update(True)
        path, *picture = (MATTE_CODES, plan.picture) if plan.is_codes else (MATTE_LINEAR, plan.picture, plan.scale)
        self.around = device.buffer(size=16 * ENTRIES)
        before = plan.lights[number - 1].field if number else self.bands
        self.matte_bind = device.bind(path, self.uniform, self.may_emit, sampler, self.matte, *picture)
        self.bands_bind = device.bind(BANDS, self.uniform, self.matte, sampler, self.pattern, *plan.lines, self.bands)
        self.glance_bind = device.bind(GLANCE, self.uniform, self.bands, sampler, plan.seen)
        self.amounts_bind = device.bind(AMOUNTS, self.uniform, self.bands, self.amounts)
        rest = plan.guide, sampler, before, self.field, self.around
        self.field_bind = device.bind(SUMS, self.uniform, plan.uniform, self.amounts, self.matte, *rest)

    def update(self, inside: bool) -> None:
        """Choose the pipelines for a light in the picture, or beyond it."""
        plan, device = self.plan, self.plan.device
        full, small = plan.size, plan.field_size
        shrinks = max(n / m for n, m in zip(full, small, strict=True))
        taps = math.ceil(shrinks / 2) if plan.is_codes else 1 if full == small else math.ceil(shrinks) + 1
        path = MATTE_CODES if plan.is_codes else MATTE_LINEAR
        self.emit = device.pipeline(path, "emit", TAPS=max(taps, 1), INSIDE=inside)
        entries = {"scan": (LINES // 32, 1)}
        for entry, count in (("smooth_lines", LINES), ("group_lines", GROUPS), ("mean_lines", GROUPS), ("stand_out", LINES + 2)):
            entries[entry] = -(-count // 64), RADII
        self.steps = [(device.pipeline(BANDS, entry, INSIDE=inside), counts) for entry, counts in entries.items()]
        self.glance = device.pipeline(GLANCE, "glance", COLUMNS=plan.small_size[0], ROWS=plan.small_size[1], INSIDE=inside)
        self.amount = device.pipeline(AMOUNTS, "ray_amount", INSIDE=inside)
        self.inside = inside
        self.gather(last=True)

    def gather(self, last: bool) -> Any:
        """Choose the pipeline that adds the light to the field. last: it is the last one."""
        known = {"ADD": self.number > 0, "LAST": last, "INSIDE": self.inside, "COOKIE": self.table is not None}
        return self.plan.device.pipeline(SUMS, "gather", **known)

    def shape(self, table: Array | None) -> None:
        """Let the light have a cookie, by its table, or None."""
        if table is not None and table is not self.table:
            self.plan.device.queue.write_buffer(self.around, 0, table.tobytes())
        self.table = table


class LookPlan(TimedSubmits):
    """Plans all passes for pictures of one size and kind, with their textures: a further picture, light or setting allocates nothing.

    picture: rgba8unorm (sRGB codes, `is_codes`) or rgba32float (linear), the caller's own if given; small_size: of the copy that is
    measured. Call `upload`, for each light `see`, then `set_lights` and `read`.
    """

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        is_codes: bool,
        near: bool = False,
        quality: str = "normal",
        *,
        picture: Any = None,
        small_size: tuple[int, int] | None = None,
    ) -> None:
        self.device, self.size, self.is_codes = device, size, is_codes
        self.small_size: tuple[int, int] = small_size or shrunk_size(*size, COPY_SIDE_PX)
        self.glance_size = -(-self.small_size[0] // GLANCED), -(-self.small_size[1] // GLANCED)
        self.field_size: tuple[int, int] = shrunk_size(*size, FIELDS[quality])
        self.picture = picture or device.texture(*size, "rgba8unorm" if is_codes else "rgba32float", target=False)
        self.guide = device.texture(*self.small_size, "rgba16float", target=False)
        self.near = device.texture(*size, "r16float", target=False) if near else self.guide
        self.seen = device.buffer(size=16 * self.glance_size[0] * self.glance_size[1])
        self.lines = [device.buffer(size=8 * RADII * count) for count in (LINES, LINES, GROUPS, GROUPS)]
        self.scale = device.buffer(size=16, uniform=True)
        self.uniform = device.buffer(size=LOOK.itemsize, uniform=True)
        self.lights: list[_LightRays] = []
        self.count = 0
        if is_codes:
            self.put = device.raster(CODES, "cover", "put", "rgba8unorm", NEAR_GIVEN=near)
            tile = np.full((256, 256, 4), 255, np.uint8)
            tile[..., :3] = np.minimum(np.floor(256 * dither()), 255)
            self.noise = device.texture(256, 256, "rgba8unorm", target=False)
            device.write(self.noise, tile, 256 * 4)
        else:
            self.put = device.pipeline(LAYER, "put", NEAR_GIVEN=near)
        self.result = device.texture(*size, "rgba8unorm" if is_codes else "rgba16float")
        self.puts: dict[int, Any] = {}

    def _run(self, label: str, encoder: Any, pipeline: Any, bind: Any, size: tuple[int, int], timer: Timer | None) -> None:
        compute(encoder, pipeline, bind, (-(-size[0] // 64), size[1]), label, timer)

    def upload(self, picture: Array, guide: Array, near: Array | None, white: float = 1.0) -> None:
        """Upload a picture. picture: (H, W, 4), as the texture holds it; guide: (h, w, 2) of the small copy; near: (H, W) where it was
        planned for, else (h, w) or None."""
        self.device.write(self.picture, np.ascontiguousarray(picture), picture.shape[1] * picture[0, 0].nbytes)
        self.device.queue.write_buffer(self.scale, 0, np.array([1 / white, 0, 0, 0], np.float32).tobytes())
        self.hide(guide, near)

    def hide(self, guide: Array, near: Array | None) -> None:
        """Set what smooths the picture's lightness, and how near things are; arguments as `upload`."""
        values = np.zeros((*guide.shape[:2], 4), np.float16)
        values[..., :2] = np.clip(guide, -65504, 65504)  # of pictures with pixels beyond 1e13
        if near is not None and self.near is self.guide:
            values[..., 2] = near
        elif near is not None:
            self.device.write(self.near, near.astype(np.float16), 2 * self.size[0])
        self.device.write(self.guide, values, 8 * self.small_size[0])

    def see(
        self, number: int, grid: RayGrid, tones: Tones, parts: Array, fineness: float, pattern: Array | None = None, profile: Any = None
    ) -> tuple[Array, Array]:
        """Find the bands of light `number` at every GLANCED-th pixel of the small copy, (h, w, 3), and their distances from it, (h, w)."""
        while len(self.lights) <= number:
            self.lights.append(_LightRays(self, len(self.lights)))
        rays = self.lights[number]
        rays.update(grid.inside)
        v = rays.values
        v["box"], v["light"], v["start"], v["span"] = grid.box, grid.light, grid.start, grid.span
        v["nearest"], v["step"] = grid.nearest, grid.step
        v["surroundings"], v["tone_span"] = tones.surroundings, tones.span
        v["fine"], v["thinnest"], v["broadest"] = grid.lines(fineness), THINNEST[0] * LINES / grid.span, grid.lines(THINNEST[1])
        v["narrow"], v["wide"] = (coarse_sigma(grid, degrees) for degrees in breadths(fineness))
        v["own"], v["drawn"] = DRAWN if pattern is not None else (0.0, 0.0)
        v["deviation"] = v["rest"] = v["length"] = v["soft"] = 1.0
        queue = self.device.queue
        queue.write_buffer(rays.uniform, 0, v.tobytes())
        if pattern is not None:
            queue.write_buffer(rays.pattern, 0, np.ascontiguousarray(pattern, np.float32).tobytes())
        may_emit = np.zeros((*parts.shape, 4), np.float16)
        may_emit[..., 0] = parts
        self.device.write(rays.may_emit, may_emit, 8 * self.small_size[0])

        def record(encoder: Any, timer: Timer | None) -> None:
            self._run("matte", encoder, rays.emit, rays.matte_bind, self.field_size, timer)
            for number, (pipeline, counts) in enumerate(rays.steps):
                compute(encoder, pipeline, rays.bands_bind, counts, "rays" if number else "sum", timer)
            self._run("glance", encoder, rays.glance, rays.glance_bind, self.glance_size, timer)

        self.submit(record, profile=profile)
        width, height = self.glance_size
        seen = np.frombuffer(queue.read_buffer(self.seen), np.float32).reshape(height, width, 4).astype(np.float64)
        return seen[..., :3], seen[..., 3]

    def set_lights(self, lights: Sequence[RaySettings], strength: float, shade: float, dark: tuple[float, float] = DARK) -> None:
        """Set what was measured of the lights seen, in their order. dark: `reference.look.darkness`."""
        for rays, s in zip(self.lights, lights, strict=False):
            v = rays.values
            v["deviation"], v["rest"], v["length"], v["mist"], v["soft"] = s.deviation, s.rest, s.length, s.mist, s.soft
            v["color"] = np.array(s.color) * s.weight
            self.device.queue.write_buffer(rays.uniform, 0, v.tobytes())
            rays.shape(s.around)
        values = np.zeros((), LOOK)
        values["strength"], values["shade"], values["dark"] = strength, shade, dark
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        self.count = len(lights)

    def record(self, encoder: Any, timer: Timer | None = None) -> None:
        """Record the passes from bands to `result`."""
        for number, rays in enumerate(self.lights[: self.count], 1):
            self._run("amounts", encoder, rays.amount, rays.amounts_bind, (LINES + 2, RADII), timer)
            self._run("field", encoder, rays.gather(number == self.count), rays.field_bind, self.field_size, timer)
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
        self.submit(self.record, profile=profile)
        width, height = self.size
        if self.is_codes:
            return np.frombuffer(self.device.read(self.result, 4), np.uint8).reshape(height, width, 4)
        return np.frombuffer(self.device.read(self.result, 8), np.float16).reshape(height, width, 4)
