"""From a picture in memory to the layer of its lights: upload, source, method, download."""

import contextlib
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from airlight.composite.blend import Rule
from airlight.composite.codes import composite
from airlight.errors import AirlightError, MachineError
from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, timing
from airlight.lights import Light
from airlight.parameters import Parameters, check_ray
from airlight.scatter.additive.additive import AdditivePlan
from airlight.scatter.bands.bands import BandsPlan
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.multipass.multipass import MultipassPlan
from airlight.scatter.radial.radial import RadialPlan

SOURCE, OCCLUDERS = "occlusion/source.wgsl", "occlusion/occluders.wgsl"
KNEE = np.dtype([("low", "f4"), ("high", "f4"), ("scale", "f4"), ("apron", "i4"), ("masked", "u4"), ("", "u4", 3)])
MODES = {"none": 0, "luminance": 1, "alpha": 2, "depth": 3, "contrast": 4}
Array = np.ndarray


def check_size(device: Device, width: int, height: int) -> None:
    """Raise AirlightError if the adapter cannot hold a texture of this size with its border."""
    if max(width, height) + 2 > device.max_side:
        limit = device.max_side - 2
        raise AirlightError(
            f"the image is {width} x {height} pixels; {device.name} takes at most {limit} on a side: scale it down or cut it"
        )


def _upload(device: Device, picture: Array) -> Any:
    """(H, W, 4) uint8 sRGB codes, or (H, W, 4) float32 linear, as a texture."""
    height, width = picture.shape[:2]
    eight = picture.dtype == np.uint8
    texture = device.texture(width, height, "rgba8unorm" if eight else "rgba32float", target=False)
    device.write(texture, np.ascontiguousarray(picture), width * (4 if eight else 16))
    return texture


def _occluders(device: Device, encoder: Any, knee: Any, picture: Any, aside: Any, codes: bool, timer: Any) -> Any:
    """Record the mean colour of what does not emit, into a buffer of one vec4f."""
    width, height, _ = picture.size
    blocks = -(-height // 64)
    sums, mean = device.buffer(size=16 * width * blocks), device.buffer(size=16)
    constants = {"MODE": MODES["contrast"], "CODES": codes}
    pipelines = [device.pipeline(OCCLUDERS, entry, **constants) for entry in ("blocks", "whole")]
    run = encoder.begin_compute_pass(**timing(timer, "occluders"))
    run.set_bind_group(0, device.bind(OCCLUDERS, knee, picture, aside, sums, mean))
    for pipeline, count in zip(pipelines, ((-(-width // 64), blocks), (1, 1)), strict=True):
        run.set_pipeline(pipeline)
        run.dispatch_workgroups(*count)
    run.end()
    return mean


def _source(
    device: Device,
    encoder: Any,
    picture: Any,
    p: Parameters,
    mask: Array | None,
    depth: Array | None,
    fraction: bool,
    scale: float,
    timer: Any,
) -> Any:
    """Record S = I m (or m itself) into a half-float texture, with an apron of one texel for border black."""
    width, height, _ = picture.size
    apron = 1 if p.border == "black" else 0
    knee = np.zeros((), KNEE)
    knee["low"], knee["high"] = p.knee
    knee["scale"], knee["apron"], knee["masked"] = scale, apron, mask is not None
    aside = picture
    if mask is not None or depth is not None:
        both = np.zeros((height, width, 4), np.float32)
        if mask is not None:
            both[..., 0] = mask
        if depth is not None:
            both[..., 1] = depth
        aside = device.texture(width, height, "rgba32float", target=False)
        device.write(aside, both, width * 16)
    source = device.texture(width + 2 * apron, height + 2 * apron, "rgba16float")
    codes = picture.format == "rgba8unorm"
    pipeline = device.pipeline(SOURCE, "emit", MODE=MODES[p.occlusion], FRACTION=fraction, CODES=codes, STENCIL=p.method == "additive")
    uniform = device.buffer(knee.tobytes(), uniform=True)
    if p.occlusion == "contrast":
        mean = _occluders(device, encoder, uniform, picture, aside, codes, timer)
    else:
        mean = device.buffer(size=16)
    bind = device.bind(SOURCE, uniform, picture, aside, source, mean)
    run = encoder.begin_compute_pass(**timing(timer, "source"))
    run.set_pipeline(pipeline)
    run.set_bind_group(0, bind)
    run.dispatch_workgroups(-(-source.size[0] // 64), -(-source.size[1] // 8))
    run.end()
    return source


def gains(p: Parameters, light: Light, method: str) -> tuple[tuple[float, ...], tuple[float, ...] | None]:
    """Factors (of the sum, of the pixel itself), RGB, that make a method's raw sum the layer of Eq. 4 or Listing 13-1."""
    if p.normalization == "mean":
        factor = p.exposure * p.weight / (p.samples if method == "radial" else 1)
        return tuple(factor * c for c in light.rgb), None
    lam = p.lam
    # the limit of sum decay^i is lam / (1 - decay) times int e^(-lam s): n for no decay
    count = 1 if method == "radial" else (p.samples if lam == 0 else lam / (1 - p.decay))
    return tuple(p.exposure * p.weight * count * c for c in light.rgb), tuple(p.exposure * c for c in light.rgb)


def direct_taps(size: tuple[int, int], at: tuple[float, float], density: float) -> int:
    """Midpoint taps, four a pixel, by which the direct sum gives the converged one; 0 where lines do better."""
    width, height = size
    x, y = at
    longest = math.hypot(max(abs(x), abs(1 - x)) * width, max(abs(y), abs(1 - y)) * height)
    taps = max(64, math.ceil(4 * density * longest))
    return taps if taps <= 64 or (taps <= 8192 and taps * width * height <= 12_000_000) else 0


def plan(
    device: Device, size: tuple[int, int], lights: list[Light], p: Parameters, source: Any, layer: Any = None
) -> tuple[list[Any], Any]:
    """A plan for each light, and the layer's texture that the last of them writes."""
    apron = 1 if p.border == "black" else 0
    plans: list[Any] = []
    before = None
    for light in lights:
        target = layer if layer is not None and light is lights[-1] else device.texture(*size, "rgba16float")
        gain, base = gains(p, light, p.method)
        position, density = light.placed(*size, p.density)
        common: dict[str, Any] = {"source": source, "layer": target, "apron": apron, "before": before, "gain": gain, "base": base}
        taps = direct_taps(size, position, density)
        if p.method == "epipolar" and taps:
            # a short or cheap ray: the converged sum by midpoint taps, their weights exact where I is constant
            step = 0.5 * p.lam / taps
            share = (math.sinh(step) / step if 0 < step < 300 else 1.0) / taps
            plans.append(
                RadialPlan(
                    device,
                    size,
                    position,
                    samples=taps,
                    density=density,
                    decay=math.exp(-p.lam / taps),
                    normalization="mean",
                    jitter="midpoint",
                    scale=1.0,
                    **{**common, "base": base or (0, 0, 0), "gain": tuple(g * share for g in gain)},
                )
            )
        elif p.method == "epipolar":
            at = (position[0] * size[0], position[1] * size[1])
            plans.append(EpipolarPlan(device, size, at, density=density, lam=p.lam, border=p.border, quality=p.quality, **common))
        elif p.method in ("bands", "multipass"):
            check_ray(p.method, density)
            del common["base"]
            at = (position[0] * size[0], position[1] * size[1])
            kind: Any = BandsPlan if p.method == "bands" else MultipassPlan
            plans.append(kind(device, size, at, density=density, lam=p.lam, **common))
        elif p.method == "additive":
            del common["base"]
            common["gain"] = tuple(p.exposure * c for c in light.rgb)
            rest: dict[str, Any] = {"samples": p.samples, "density": density, "decay": p.decay, "weight": p.weight}
            plans.append(AdditivePlan(device, size, position, **rest, **common))
        else:
            if p.scale != 1 and before is not None:
                common["before"] = before
            common["base"] = base or (0, 0, 0)
            plans.append(
                RadialPlan(
                    device,
                    size,
                    position,
                    samples=p.samples,
                    density=density,
                    decay=p.decay,
                    normalization=p.normalization,
                    jitter=p.jitter,
                    scale=p.scale,
                    **common,
                )
            )
        before = target
    return plans, before


class _Job:
    """One picture on the device: its texture, and the layer of its lights, submitted on construction."""

    def __init__(
        self,
        device: Device,
        picture: Array,
        lights: list[Light],
        p: Parameters,
        *,
        mask: Array | None = None,
        depth: Array | None = None,
        fraction: bool = False,
        profile: list[tuple[str, float]] | None = None,
    ) -> None:
        height, width = picture.shape[:2]
        check_size(device, width, height)
        self.device, self.profile = device, profile
        self.timer = Timer(device) if profile is not None else None
        self.scale = 1.0
        if picture.dtype != np.uint8 and not fraction and p.method != "additive":  # whose buffer holds 0 to 1
            peak = float(picture[..., :3].max())
            if peak > 0 and not 1e-2 <= peak <= 1e3:
                self.scale = 2.0 ** -math.floor(math.log2(peak)) if peak < 1e-2 else 2.0 ** -max(0, math.ceil(math.log2(peak / 32768)))
        encoder = device.encoder()
        self.picture = _upload(device, picture)
        source = _source(device, encoder, self.picture, p, mask, depth, fraction, self.scale, self.timer)
        plans, self.layer = plan(device, (width, height), lights, p, source)
        for step in plans:
            step.record(encoder, self.timer)
        self._submit(encoder)

    def _submit(self, encoder: Any) -> None:
        if self.timer:
            self.timer.resolve(encoder)
        self.device.submit(encoder)
        self.note()

    def note(self) -> None:
        """Take down the times of the passes since the last call."""
        if self.timer and self.profile is not None:
            self.profile += self.timer.milliseconds()


@contextlib.contextmanager
def _within_memory(device: Device, picture: Array) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        if "memory" not in str(error).lower():
            raise
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise MachineError(f"{device.name} has not enough memory for an image of {size} pixels: scale it down") from None


def render_layer(device: Device, picture: Array, lights: list[Light], p: Parameters, **options: Any) -> Array:
    """The layer (H, W, 3) float32 of a picture: (H, W, 4) uint8 sRGB codes or float32 linear, finite.

    options: mask and depth (H, W); fraction: of what emits, not its light; profile: a list to which (label, ms) of each pass is added.
    """
    with _within_memory(device, picture):
        job = _Job(device, picture, lights, p, **options)
        half = np.frombuffer(device.read(job.layer, 8), np.float16).reshape(*picture.shape[:2], 4)
    out = half[..., :3].astype(np.float32)
    return out if job.scale == 1.0 else out / np.float32(job.scale)


def render_codes(device: Device, picture: Array, lights: list[Light], p: Parameters, rule: Rule, **options: Any) -> Array:
    """The picture with its layer, (H, W, 4) uint8 sRGB codes as the picture. Options as render_layer."""
    with _within_memory(device, picture):
        job = _Job(device, picture, lights, p, **options)
        result = composite(device, job.picture, job.layer, rule, job.timer)
        job.note()
        return np.frombuffer(device.read(result, 4), np.uint8).reshape(picture.shape)
