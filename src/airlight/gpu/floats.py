"""Reads images from a device as arrays of floats: laid out there, so that memory holds them once."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute

SHADER = "gpu/floats.wgsl"
ROWS = struct_dtype(SHADER, "Rows")
MOST_BYTES = 1 << 24  # that are laid out at a time


class FloatReader:
    """Reads an image's RGB into arrays, some rows at a time. image: a texture of any float format."""

    def __init__(self, device: Device, image: Any) -> None:
        self.device = device
        self.width, self.height, _ = image.size
        self.rows = min(self.height, max(1, MOST_BYTES // (12 * self.width)))
        usage, size = device.wgpu.BufferUsage, 48 * -(-self.width * self.rows // 4)
        self._floats, self._span = device.buffer(size=size), device.buffer(size=ROWS.itemsize, uniform=True)
        self._mapped = device.device.create_buffer(size=size, usage=usage.COPY_DST | usage.MAP_READ)
        self._pipeline = device.pipeline(SHADER, "lay_out")
        self._bind = device.bind(SHADER, image, self._floats, self._span)

    def read(self, factor: float = 1.0) -> np.ndarray:
        """Read the image times a factor, (H, W, 3) float32. Waits for what writes it."""
        out = np.empty((self.height, self.width, 3), np.float32)
        for first in range(0, self.height, self.rows):
            end = min(first + self.rows, self.height)
            size = 12 * self.width * (end - first)
            self.device.queue.write_buffer(self._span, 0, np.array((first, end - 1, factor), ROWS).tobytes())
            encoder = self.device.encoder()
            compute(encoder, self._pipeline, self._bind, (-(-self.width * (end - first) // 256),))
            encoder.copy_buffer_to_buffer(self._floats, 0, self._mapped, 0, size)
            self.device.submit(encoder)
            self._mapped.map_sync("READ", 0, size)
            out[first:end] = np.frombuffer(self._mapped.read_mapped(0, size, copy=False), np.float32).reshape(end - first, self.width, 3)
            self._mapped.unmap()
        return out
