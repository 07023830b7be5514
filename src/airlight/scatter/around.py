"""Multiplies the layer of a light by its cookie, a factor over the angle around it, whatever the method."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.lights import ImageLight
from airlight.lights.around import Array
from airlight.options import Parameters
from airlight.scatter.methods import METHODS
from airlight.scatter.screen import Target

AROUND = "scatter/around.wgsl"
PLACE = struct_dtype(AROUND, "Place")


class AroundPlan:
    """Plans the passes of one light with a cookie: those of its method onto a texture of its own, and one onto the target."""

    def __init__(self, device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target, table: Array) -> None:
        """table: as `around_table`."""
        own = device.texture(*size, "rgba16float")
        self.plan = METHODS[p.method].plan(device, size, light, p, Target(target.source, own, target.apron))
        place = np.zeros((), PLACE)
        place["light"] = light.position[0] * size[0], light.position[1] * size[1]
        self.pipeline = device.pipeline(AROUND, "shape_layer", ADD=target.before is not None)
        before = own if target.before is None else target.before
        values = device.buffer(place.tobytes(), uniform=True), device.buffer(table.tobytes())
        self.bind = device.bind(AROUND, *values, own, before, target.layer)
        self.counts = -(-size[0] // 64), size[1]

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the method's passes, and the product."""
        self.plan.record(encoder, timer)
        compute(encoder, self.pipeline, self.bind, self.counts, "cookie", timer)
