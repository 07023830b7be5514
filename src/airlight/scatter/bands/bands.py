"""The concentric rectangular bands of 13.8, planned and recorded: a dispatch for each ring around the light, one new sample a pixel."""

import math
from typing import Any

import numpy as np

from airlight.gpu.device import Device, Recording
from airlight.gpu.slices import tell
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import timing
from airlight.lights import ImageLight
from airlight.options.shafts import Parameters
from airlight.scatter import methods
from airlight.scatter.epipolar.moments import Array, Mixture, mixture
from airlight.scatter.screen import Target, gains

BANDS = "scatter/bands/bands.wgsl"
FIT_TOLERANCE = 2e-3  # of the weight's fit
RINGS_A_SUBMIT = 256  # rings of a submit, some 0.1 s on software Vulkan, so that an interrupt is answered
FRAME = struct_dtype(BANDS, "Frame")


def entering_taps(size: tuple[int, int], light: tuple[float, float], density: float) -> int:
    """Count the taps of the direct sum with which a ray enters the image: one a pixel of the longest ray, 16 to 4,096. light: in pixels."""
    longest = math.hypot(*(max(abs(light[a]), abs(size[a] - light[a])) for a in (0, 1)))
    return max(16, min(4096, math.ceil(density * longest)))


def factors(mix: Mixture, rings: Array, into: Array, density: float) -> Array:
    """Compute g and k to the band's far border, g and k to its middle: (rings, 4 sides, powers, 4). into: (x, y) of the light in its
    pixel."""
    sides = np.array([0.5 - into[0], into[0] - 0.5, 0.5 - into[1], into[1] - 0.5])
    u = np.maximum(rings[:, None] + sides, 0.5 + 1e-9)[..., None]  # less only on the light's own pixel, which has none
    q = mix.p + 1
    logs = np.stack([np.log1p(-1 / (u + 0.5)), np.log1p(-0.5 / u)], axis=-1) * q[:, None]
    return np.stack([np.exp(logs), -np.expm1(logs) / q[:, None] / density], axis=-1).reshape(len(rings), 4, len(q), 4)


class BandsPlan:
    """Plans the passes of one light. light: in pixels; density <= 1. `record` allocates nothing."""

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
        mix = mixture(density, lam, FIT_TOLERANCE)
        home = [math.floor(v) for v in light]
        into = np.array(light) - home
        nearest = [max(0, -home[a], home[a] - size[a] + 1) for a in (0, 1)]
        farthest = [max(abs(home[a]), abs(size[a] - 1 - home[a])) for a in (0, 1)]
        first, last = max(nearest), max(farthest)
        taps = entering_taps(size, light, density)
        s = (np.arange(taps) + 0.5) / taps
        enters = np.zeros((taps, 4))
        enters[:, 0] = density * s
        enters[:, 1 : 1 + len(mix.p)] = np.exp(np.log1p(-density * s)[:, None] * mix.p) / taps
        frame = np.zeros((), FRAME)
        frame["light"], frame["density"], frame["apron"], frame["home"] = into, density, apron, home
        frame["size"], frame["first"], frame["taps"], frame["lanes"] = size, first, taps, max(size)
        frame["c"][: len(mix.c)] = mix.c * density
        frame["start"][: len(mix.p)] = (1 - mix.before) / (mix.p + 1) / density
        frame["gain"][:3] = gain
        table = factors(mix, np.arange(first, last + 1, dtype=float), into, density)
        state = device.buffer(size=4 * 3 * 8 * max(size) * len(mix.p))
        tables = [device.buffer(t.astype(np.float32).tobytes()) for t in (table, enters, np.pad(mix.before, (0, 4 - len(mix.p))))]
        constants = {"POWERS": len(mix.p), "ADD": before is not None, "FAR_END": mix.ratio > 0}
        self.reset = device.pipeline(BANDS, "reset")
        self.rings = [device.pipeline(BANDS, "ring", ODD=odd, **constants) for odd in (False, True)]
        self.count, self.groups = last - first + 1, -(-2 * sum(size) // 64)
        spare = before if before is not None else source
        images = (source, device.sampler(), layer, spare)
        self.bind = device.bind(BANDS, device.buffer(frame.tobytes()), *images, *tables, state, device.buffer(size=8))

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the rings, each of which waits for the one before; some at a time are carried out if the encoder is ours."""
        for first in range(0, self.count, RINGS_A_SUBMIT):
            run = encoder.begin_compute_pass(**timing(timer, "bands", encoder))
            run.set_bind_group(0, self.bind)
            if first == 0:
                run.set_pipeline(self.reset)
                run.dispatch_workgroups(1)
            for i in range(first, min(first + RINGS_A_SUBMIT, self.count)):
                run.set_pipeline(self.rings[i % 2])
                run.dispatch_workgroups(self.groups)
            run.end()
            if isinstance(encoder, Recording):
                encoder.pause()
                tell(min((first + RINGS_A_SUBMIT) / self.count, 1.0))


def plan(device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target) -> BandsPlan:
    """Plan the sum of one light. Raises AirlightError for a ray that passes the light."""
    (x, y), density = light.placed(*size, p.density)
    methods.check_ray(p.method, density)
    gain, _ = gains(p, light)
    return BandsPlan(device, size, (x * size[0], y * size[1]), target, density=density, lam=p.lam, gain=gain)
