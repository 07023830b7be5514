"""The log-n multipass in its exact, geometric form, planned and recorded: three passes of eight taps a power of the weight."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device, Recording
from airlight.gpu.slices import tell
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.lights import ImageLight
from airlight.options.shafts import Parameters
from airlight.scatter import methods
from airlight.scatter.epipolar.moments import Array, Mixture, mixture
from airlight.scatter.screen import Target, gains

MULTIPASS = "scatter/multipass/multipass.wgsl"
TAPS, PASSES = 8, 3
NEAREST_TAP_SHARE = 1 / 128  # part of the distance from the light at which geometric steps end; what is nearer is one sample
FIT_TOLERANCE = 2e-3  # of the weight's fit
PAUSED_PIXELS = 4_000_000  # pixels from which on each pass is waited for, so that an interrupt is answered
FRAME = struct_dtype(MULTIPASS, "Taps")


def stages(mix: Mixture, density: float) -> tuple[list[list[Array]], Array, Array, float]:
    """Find for each power and pass the taps (8, 2): part of the distance to the light, weight, of sum 1; the factors of each power's sum
    and of the nearest sample; and where that lies. The sum's derivation is in docs/methods.md."""
    q = mix.p + 1
    ends = 1 - density >= NEAREST_TAP_SHARE
    log_low = float(np.log1p(-density) if ends else np.log(NEAREST_TAP_SHARE))
    all_taps = []
    for each in q:
        passes = []
        for stage in range(PASSES):
            k = np.arange(TAPS) * float(TAPS**stage)
            weights = np.exp(k * each * log_low / TAPS**PASSES)
            shifts = -np.expm1((k + (0.5 if stage == 0 else 0.0)) * log_low / TAPS**PASSES)
            passes.append(np.stack([shifts, weights / weights.sum()], axis=1))
        all_taps.append(passes)
    nearest = np.zeros_like(q) if ends else mix.c * (NEAREST_TAP_SHARE**q - max(1 - density, 0) ** q) / q
    return all_taps, mix.c * -np.expm1(q * log_low) / q, nearest, 1 - (NEAREST_TAP_SHARE + 1 - density) / 2


class MultipassPlan:
    """Plans the passes of one light. light: in pixels; density <= 1."""

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        light: tuple[float, float],
        target: Target,
        *,
        density: float,
        lam: float,
        gain: tuple[float, ...] = (1, 1, 1),
    ) -> None:
        source, layer, apron, before = target.source, target.layer, target.apron, target.before
        taps, factors, nearest, shift = stages(mixture(density, lam, FIT_TOLERANCE), density)
        between = [device.texture(source.size[0], source.size[1], "rgba16float") for _ in range(PASSES - 1)]
        self.steps = []
        for i, passes in enumerate(taps):
            result_of = layer if i == len(taps) - 1 else device.texture(*size, "rgba16float")
            links = zip(passes, [source, *between], [*between, result_of], strict=True)
            for stage, (own, given, result) in enumerate(links):
                last = stage == PASSES - 1
                frame = np.zeros((), FRAME)
                frame["light"], frame["size"], frame["apron"], frame["inset"] = light, result.size[:2], apron, apron if last else 0
                frame["taps"][:, :2] = own
                frame["gain"][:3], frame["nearest"] = factors[i] * np.array(gain), [*(nearest[i] * np.array(gain)), shift]
                flags = {"LAST": last, "ADD": last and before is not None, "NEAREST": last and bool(nearest[i])}
                pipeline = device.pipeline(MULTIPASS, "eight", **flags)
                uniform, spare = device.buffer(frame.tobytes(), uniform=True), before if before is not None else source
                bind = device.bind(MULTIPASS, uniform, given, device.sampler(), result, spare, source)
                self.steps.append((pipeline, bind, result.size))
            before = result_of

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record all passes; those of a large image are carried out on the way if the encoder is ours."""
        for i, (pipeline, bind, size) in enumerate(self.steps):
            compute(encoder, pipeline, bind, (-(-size[0] // 64), size[1]), "multipass", timer)
            if size[0] * size[1] > PAUSED_PIXELS and isinstance(encoder, Recording):
                encoder.pause()
                tell((i + 1) / len(self.steps))


def plan(device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target) -> MultipassPlan:
    """Plan the sum of one light. Raises AirlightError for a ray that passes the light."""
    (x, y), density = light.placed(*size, p.density)
    methods.check_ray(p.method, density)
    gain, _ = gains(p, light)
    return MultipassPlan(device, size, (x * size[0], y * size[1]), target, density=density, lam=p.lam, gain=gain)
