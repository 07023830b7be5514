"""Marches by themselves the pixels of which the upsampling of a smaller march is unsure: near lamps, and along sharp edges of shadows."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute, divide, timing
from airlight.scatter.march.records import FRAME, LIGHT

CHOOSE, PUT, UPSAMPLE_MARKED = (f"scatter/march/{name}.wgsl" for name in ("refine", "put_refined", "upsample_marked"))
MOST = 32  # a part of the picture's pixels, one of so many, is marched by itself at most
LEAST_CAPACITY, MOST_CAPACITY = 1024, 1 << 20  # pixels
COLUMNS, ROWS = 128, 8  # as chosen.wgsl's LIST_COLUMNS; rows of a workgroup
BINS, HEAD = 16, 1 + 16  # as marks.wgsl's; words of Marks before its lists
STEPS = 4  # times as many as elsewhere: what is alone has no neighbours over which its noise is averaged
GATHERED = 64  # invocations of a workgroup


class Refinement:
    """Holds what the passes over a list of pixels need, for pictures of a size (width, height).

    chosen: the list, as a march's shader binds it; marks: what `upsample_marked` writes. frames, lights: uniform buffers, by the light.
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device = device
        count = min(max(pixels[0] * pixels[1] // MOST, LEAST_CAPACITY), MOST_CAPACITY)
        self.capacity = -(-count // (COLUMNS * ROWS)) * COLUMNS * ROWS
        self.size = COLUMNS, self.capacity // COLUMNS
        self.marks = device.buffer(size=4 * (HEAD + BINS * self.capacity))
        self.chosen = device.buffer(size=4 * (1 + self.capacity))
        usage = device.wgpu.BufferUsage
        self._counts = device.device.create_buffer(size=16, usage=usage.STORAGE | usage.INDIRECT)
        self.layers = [device.texture(*self.size, "rgba32float") for _ in range(2)]
        self.frames: list[Any] = []
        self.lights: list[Any] = []

    def write(self, i: int, light: np.ndarray, frame: np.ndarray) -> None:
        """Writes what the pass of the i-th light has otherwise than that over the whole picture, of its LIGHT and its FRAME."""
        while len(self.lights) <= i:
            self.frames.append(self.device.buffer(size=FRAME.itemsize, uniform=True))
            self.lights.append(self.device.buffer(size=LIGHT.itemsize, uniform=True))
        light, frame = light.copy(), frame.copy()
        light["steps"], frame["size"] = STEPS * light["steps"], frame["pixels"]
        self.device.queue.write_buffer(self.lights[i], 0, light.tobytes())
        self.device.queue.write_buffer(self.frames[i], 0, frame.tobytes())

    def measure(self, encoder: Any, marched: Any, timer: Timer | None) -> None:
        """Records the pass before the upsampling."""
        compute(encoder, self.device.pipeline(CHOOSE, "measure"), self._bound(marched), (1,), "upsample", timer)

    def gather(self, encoder: Any, marched: Any, timer: Timer | None) -> None:
        """Records the pass after it."""
        compute(encoder, self.device.pipeline(CHOOSE, "gather"), self._bound(marched), (self.capacity // GATHERED,), "upsample", timer)

    def _bound(self, marched: Any) -> Any:
        self.device.pipeline(CHOOSE, "measure")
        return self.device.bind(CHOOSE, marched, self.marks, self.chosen, self._counts)

    def compute(self, encoder: Any, pipeline: Any, bind: Any, label: str, timer: Timer | None) -> None:
        """Records a pass over the list, however long it is."""
        run = encoder.begin_compute_pass(**timing(timer, label, encoder))
        run.set_pipeline(pipeline)
        run.set_bind_group(0, bind)
        run.dispatch_workgroups_indirect(self._counts, 0)
        run.end()
        divide(encoder)


def no_list(device: Device) -> Any:
    """Returns the buffer that is bound where a march is for all of what is computed."""
    if "no list" not in device.kept:
        device.kept["no list"] = device.buffer(size=4)
    return device.kept["no list"]
