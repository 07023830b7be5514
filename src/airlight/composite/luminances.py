"""Luminances of some pixels of a texture, which a composite is measured by."""

from typing import Any

import numpy as np

from airlight.composite.blend import FloatArray, sample_step
from airlight.gpu.device import Device
from airlight.gpu.timing import compute

LUMINANCES = "composite/luminances.wgsl"


class Luminances:
    """Reads the luminances of every n-th pixel of a texture."""

    def __init__(self, device: Device, texture: Any) -> None:
        width, height, _ = texture.size
        step = sample_step(width, height)
        self.device, self.count = device, (-(-width // step), -(-height // step))
        self.found = device.buffer(size=4 * self.count[0] * self.count[1])
        self.pick = device.pipeline(LUMINANCES, "pick", STEP=step)
        self.bind = device.bind(LUMINANCES, texture, self.found)

    def read(self) -> FloatArray:
        encoder = self.device.encoder()
        compute(encoder, self.pick, self.bind, (-(-self.count[0] // 64), self.count[1]))
        self.device.submit(encoder)
        return np.frombuffer(self.device.queue.read_buffer(self.found), np.float32)
