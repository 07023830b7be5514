"""The composite of 8-bit sRGB pictures on the GPU, so that neither picture nor layer visits the CPU as floats."""

from typing import Any

import numpy as np

from airlight.composite.blend import CompositeSettings, auto_levels
from airlight.composite.luminances import Luminances
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.noise import dither

COMPOSITE = "composite/composite.wgsl"
RECORD = struct_dtype(COMPOSITE, "Settings")


class CodesComposite:
    """Puts a layer (rgba16float) on a picture's codes (rgba8unorm): `measure`, then `record`, then read `result`."""

    def __init__(self, device: Device, codes: Any, layer: Any, settings: CompositeSettings) -> None:
        width, height, _ = codes.size
        self.device, self.size = device, (width, height)
        self.of_layer = Luminances(device, layer)
        tile = np.ones((256, 256, 4), np.float32)
        tile[..., :3] = dither()
        noise = device.texture(256, 256, "rgba32float", target=False)
        device.write(noise, tile, 256 * 16)
        self.result = device.texture(width, height, "rgba8unorm")
        self.uniform = device.buffer(size=RECORD.itemsize, uniform=True)
        self.pipeline = device.pipeline(COMPOSITE, "composite", SCREEN=settings.blend == "screen", SUBTRACT_HAZE=settings.haze_floor > 0)
        self.bind = device.bind(COMPOSITE, self.uniform, codes, layer, noise, self.result)

    def measure(self, settings: CompositeSettings) -> CompositeSettings:
        """Measure the layer as it is now, and resolve what the settings leave open: `blend.auto_levels`."""
        settings = auto_levels(settings, self.of_layer.read())
        values = np.zeros((), RECORD)
        values["peak"], values["mix"] = settings.peak or 1.0, settings.mix
        values["haze_floor"] = settings.haze_floor**4 if settings.peak else 0.0
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        return settings

    def record(self, encoder: Any, timer: Any = None) -> None:
        compute(encoder, self.pipeline, self.bind, (-(-self.size[0] // 64), self.size[1]), "composite", timer)
