"""The direct sum of chapter 13, planned and recorded. Its cost grows with samples; `epipolar` is its limit."""

import time
from typing import Any

import numpy as np

from airlight.gpu.device import Device, Recording
from airlight.gpu.slices import tell
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.lights import ImageLight
from airlight.noise import blue_noise
from airlight.options.shafts import Parameters
from airlight.scatter.screen import Target, gains

RADIAL, RESAMPLE = "scatter/radial/radial.wgsl", "scatter/radial/resample.wgsl"
JITTERS = {"fixed": 0, "midpoint": 1, "gradient": 2, "blue": 3}
RAYS = struct_dtype(RADIAL, "Rays")
TAPS_A_DISPATCH = 60_000_000  # about 0.1 s on software Vulkan, so that an interrupt is answered
PAUSED_DISPATCHES = 8  # dispatches from which on each is waited for


def noise_texture(device: Device) -> Any:
    if "blue noise" not in device.kept:
        texture = device.kept["blue noise"] = device.texture(256, 256, "rgba32float", target=False)
        rgba = np.zeros((256, 256, 4), np.float32)
        rgba[..., 0] = blue_noise()
        device.write(texture, rgba, 256 * 16)
    return device.kept["blue noise"]


class RadialPlan:
    """Plans the passes of one light. size: (width, height) of the layer; light: normalised; scale: 1, 0.5 or 0.25."""

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        light: tuple[float, float],
        target: Target,
        *,
        samples: int,
        density: float,
        decay: float,
        jitter: str,
        scale: float = 1.0,
        is_listing: bool = False,
        gain: tuple[float, float, float] = (1, 1, 1),
        base: tuple[float, float, float] = (0, 0, 0),
    ) -> None:
        source, layer, apron, before = target.source, target.layer, target.apron, target.before
        self.device = device
        self.factor = round(1 / scale)
        self.full = size
        self.low = (-(-size[0] // self.factor), -(-size[1] // self.factor))
        self.layer = layer
        rays = np.zeros((), RAYS)
        rays["size"], rays["light"], rays["apron"] = self.low, light, apron if scale == 1 else 0
        rays["samples"], rays["step"], rays["decay"] = samples, density / samples, decay
        rays["gain"][:3], rays["base"][:3] = gain, base
        summed = layer
        small = source
        if scale != 1:
            spare = before if before is not None else source
            small = device.texture(self.low[0] + 2 * apron, self.low[1] + 2 * apron, "rgba16float")
            rays["apron"] = apron
            self.down = device.pipeline(RESAMPLE, "down", FACTOR=self.factor, APRON=apron)
            self.down_bind = device.bind(RESAMPLE, source, device.sampler(), small, spare)
            self.small = small
            summed = device.texture(*self.low, "rgba16float")
            self.up = device.pipeline(RESAMPLE, "up", ADD=before is not None)
            self.up_bind = device.bind(RESAMPLE, summed, device.sampler(), layer, spare)
            before = None  # lights are added where the sums are large again
        self.pipeline = device.pipeline(
            RADIAL, "direct", JITTER=JITTERS[jitter], LISTING=is_listing, BASE=any(base), ADD=before is not None
        )
        noise = noise_texture(device) if jitter == "blue" else source
        per = max(1, TAPS_A_DISPATCH // (samples * self.low[0]))
        self.parts = []
        for row in range(0, self.low[1], per):
            rays["row"] = row
            values = device.buffer(rays.tobytes())
            bind = device.bind(RADIAL, values, small, device.sampler(), summed, before if before is not None else source, noise)
            self.parts.append((bind, min(per, self.low[1] - row)))

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the sum, and at lower resolutions the filters around it; a long sum is carried out on the way if the encoder is ours."""
        if self.factor > 1:
            compute(encoder, self.down, self.down_bind, (-(-self.small.size[0] // 64), self.small.size[1]), "radial down", timer)
        together, recorded, start = 1, 0, time.perf_counter()
        for i, (bind, rows) in enumerate(self.parts):
            compute(encoder, self.pipeline, bind, (-(-self.low[0] // 64), rows), "radial sum", timer)
            tell((i + 1) / len(self.parts))
            recorded += 1
            if recorded == together and len(self.parts) > PAUSED_DISPATCHES and isinstance(encoder, Recording):
                encoder.pause()
                together, recorded = together * (2 if time.perf_counter() - start < 0.05 else 1), 0  # a fast adapter stops seldom
                start = time.perf_counter()
        if self.factor > 1:
            compute(encoder, self.up, self.up_bind, (-(-self.full[0] // 64), self.full[1]), "radial up", timer)


def plan(device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target) -> RadialPlan:
    """Plan the direct sum of one light."""
    position, density = light.placed(*size, p.density)
    gain, base = gains(p, light, per_sample=True)
    rest: dict[str, Any] = {"samples": p.samples, "density": density, "decay": p.decay, "jitter": p.offset, "scale": p.scale}
    return RadialPlan(
        device, size, position, target, **rest, is_listing=p.normalization == "listing", gain=gain, base=base or (0, 0, 0)
    )
