"""The composite in linear light on the GPU, for what is shown at once: nothing but some luminances visits the CPU."""

from typing import Any

import numpy as np

from airlight.composite import adapt
from airlight.composite.blend import AUTO_MIX_LUMINANCE, CompositeSettings, auto_levels
from airlight.composite.luminances import Luminances
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute

MIX = "composite/mix.wgsl"
RECORD = struct_dtype(MIX, "Settings")


class LinearComposite:
    """Puts a layer (rgba16float) on a picture (rgba32float, linear, or rgba8unorm, sRGB codes) into `result`, rgba16float,
    linear, not yet adapted. picture_scale: `adapt.measure_ramp` of the picture alone, for the mix where it is unset and they adapt."""

    def __init__(self, device: Device, picture: Any, layer: Any, settings: CompositeSettings, picture_scale: float) -> None:
        width, height, _ = picture.size
        self.device, self.size, self.picture_scale = device, (width, height), picture_scale
        self.result = device.texture(width, height, "rgba16float")
        self.uniform = device.buffer(size=RECORD.itemsize, uniform=True)
        constants = {"SCREEN": settings.blend == "screen", "SUBTRACT_HAZE": settings.haze_floor > 0}
        constants["CODES"] = picture.format == "rgba8unorm"
        self.pipeline = device.pipeline(MIX, "put", **constants)
        self.bind = device.bind(MIX, self.uniform, picture, layer, self.result)
        self.of_layer, self.of_result = Luminances(device, layer), Luminances(device, self.result)

    def measure(self, settings: CompositeSettings, scale: float = 1.0) -> CompositeSettings:
        """Resolve what the settings leave open by the layer as it is now: `blend.auto_levels_of`. scale: the factor in the layer."""
        if settings.mix is None or (settings.haze_floor and settings.peak is None):
            cover = AUTO_MIX_LUMINANCE * (adapt.MIDDLE_GREY / self.picture_scale if settings.adapt else 1.0)
            settings = auto_levels(settings, (self.of_layer.read() / scale).astype(np.float32), cover)
        values = np.zeros((), RECORD)
        values["peak"], values["mix"] = settings.peak or 1.0, settings.mix
        values["haze_floor"] = settings.haze_floor**4 if settings.peak else 0.0
        values["scale"] = scale
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        return settings

    def ramp(self) -> adapt.Ramp:
        """Find the ramp that adapts the result as it is now."""
        return adapt.measure_ramp(self.of_result.read())

    def record(self, encoder: Any, timer: Any = None) -> None:
        compute(encoder, self.pipeline, self.bind, (-(-self.size[0] // 64), self.size[1]), "composite", timer)
