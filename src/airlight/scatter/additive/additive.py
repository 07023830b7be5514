"""The fixed-function additive multipass of Fig. 13-5, planned and recorded: historical, with the precision of its 8-bit buffer."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device, Recording
from airlight.gpu.slices import tell
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.lights import ImageLight
from airlight.options.shafts import Parameters
from airlight.scatter.screen import Target, times

ADDITIVE = "scatter/additive/additive.wgsl"
BLENDS = struct_dtype(ADDITIVE, "Blends")
TAPS_A_DISPATCH = 60_000_000  # about 0.1 s on software Vulkan
PAUSED_DISPATCHES = 8  # dispatches from which on each is waited for


class AdditivePlan:
    """Plans the passes of one light. light: normalised; gain: exposure times the light's colour; weight: of a blend before its decay."""

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
        weight: float,
        gain: tuple[float, ...] = (1, 1, 1),
    ) -> None:
        source, layer, apron, before = target.source, target.layer, target.apron, target.before
        drawn = device.texture(source.size[0], source.size[1], "rgba16float")
        self.size, self.whole = size, drawn.size[:2]
        self.quantise = device.pipeline(ADDITIVE, "quantise")
        self.blend = device.pipeline(ADDITIVE, "blend", ADD=before is not None)
        blends = np.zeros((), BLENDS)
        blends["size"], blends["light"], blends["apron"] = size, light, apron
        blends["samples"], blends["step"], blends["decay"] = samples, density / samples, decay
        blends["gain"] = *(g / 255 for g in gain), weight / samples
        spare, bilinear = before if before is not None else source, device.sampler()
        self.first = device.bind(ADDITIVE, device.buffer(blends.tobytes()), source, bilinear, drawn, spare)
        rows = max(1, TAPS_A_DISPATCH // (samples * size[0]))
        self.parts = []
        for row in range(0, size[1], rows):
            blends["row"] = row
            bind = device.bind(ADDITIVE, device.buffer(blends.tobytes()), drawn, bilinear, layer, spare)
            self.parts.append((bind, min(rows, size[1] - row)))

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the quantisation of the source and the blends; long ones are carried out on the way if the encoder is ours."""
        steps = [(self.quantise, self.first, self.whole), *((self.blend, bind, (self.size[0], rows)) for bind, rows in self.parts)]
        for i, (pipeline, bind, (width, height)) in enumerate(steps):
            compute(encoder, pipeline, bind, (-(-width // 64), height), "additive", timer)
            if len(self.parts) > PAUSED_DISPATCHES and isinstance(encoder, Recording):
                encoder.pause()
                tell((i + 1) / len(steps))


def plan(device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target) -> AdditivePlan:
    """Plan the blends of one light."""
    position, density = light.placed(*size, p.density)
    rest: dict[str, Any] = {"samples": p.samples, "density": density, "decay": p.decay, "weight": p.weight}
    return AdditivePlan(device, size, position, target, **rest, gain=times(p.exposure, light))
