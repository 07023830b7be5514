"""The composite in linear light on the GPU, for what is shown at once: nothing but some luminances visits the CPU."""

from typing import Any

import numpy as np

from airlight.composite import adapt
from airlight.composite.blend import COVER, Rule, measured
from airlight.composite.luminances import Luminances
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute

MIX = "composite/mix.wgsl"
SETTINGS = struct_dtype(MIX, "Settings")


class LinearComposite:
    """Puts a layer (rgba16float) on a picture (rgba32float, linear, or rgba8unorm, sRGB codes) into `result`, rgba16float,
    linear, not yet adapted. picture_scale: `adapt.measured` of the picture alone, for the mix where it is unset and the rule adapts."""

    def __init__(self, device: Device, picture: Any, layer: Any, rule: Rule, picture_scale: float) -> None:
        width, height, _ = picture.size
        self.device, self.size, self.picture_scale = device, (width, height), picture_scale
        self.result = device.texture(width, height, "rgba16float")
        self.uniform = device.buffer(size=SETTINGS.itemsize, uniform=True)
        constants = {"SCREEN": rule.blend == "screen", "SUBTRACT_HAZE": rule.veil > 0, "CODES": picture.format == "rgba8unorm"}
        self.pipeline = device.pipeline(MIX, "put", **constants)
        self.bind = device.bind(MIX, self.uniform, picture, layer, self.result)
        self.of_layer, self.of_result = Luminances(device, layer), Luminances(device, self.result)

    def measure(self, rule: Rule, scale: float = 1.0) -> Rule:
        """Resolve what the rule leaves open by the layer as it is now: `blend.measured_on`. scale: the factor in the layer."""
        if rule.mix is None or (rule.veil and rule.peak is None):
            cover = COVER * (adapt.MIDDLE / self.picture_scale if rule.adapt else 1.0)
            rule = measured(rule, (self.of_layer.read() / scale).astype(np.float32), cover)
        values = np.zeros((), SETTINGS)
        values["peak"], values["haze_floor"], values["mix"] = rule.peak or 1.0, rule.veil**4 if rule.peak else 0.0, rule.mix
        values["scale"] = scale
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        return rule

    def ramp(self) -> adapt.Ramp:
        """Find the ramp that adapts the result as it is now."""
        return adapt.measured(self.of_result.read())

    def record(self, encoder: Any, timer: Any = None) -> None:
        compute(encoder, self.pipeline, self.bind, (-(-self.size[0] // 64), self.size[1]), "composite", timer)
