"""Timing of passes: timestamps where the adapter has them, the wall clock elsewhere."""

import time
from collections.abc import Callable
from typing import Any

from airlight.gpu.device import Device, Recording

MOST_PASSES = 2000  # of a frame, whose passes may be divided: a query set holds 4096 timestamps


class Timer:
    """Times passes by their labels, see `timing`; read `milliseconds()` after the submit."""

    def __init__(self, device: Device, capacity: int = MOST_PASSES) -> None:
        self.device = device
        self.labels: list[str] = []
        self.capacity = capacity
        self.queries = device.device.create_query_set(type="timestamp", count=2 * capacity + 2) if device.timestamps else None
        usage = device.wgpu.BufferUsage
        flags = usage.QUERY_RESOLVE | usage.COPY_SRC
        # software Vulkan carries a pass's first timestamp out with its second, after the work of a compute pass: there, empty passes that
        # draw are put between the others and tell the times
        self._mark = device.texture(1, 1, "rgba8unorm").create_view() if device.is_cpu and self.queries else None
        self._result = device.device.create_buffer(size=16 * capacity + 16, usage=flags) if self.queries else None

    def writes(self, label: str, encoder: Any) -> Any:
        """Reserve the timestamps of the pass that is begun next. encoder: on which."""
        if self.queries is None or len(self.labels) >= self.capacity:
            return None
        if self._mark:
            self._put_mark(encoder)
            self.labels.append(label)
            return None
        self.labels.append(label)
        return self._indices(len(self.labels) - 1)

    def _indices(self, i: int) -> dict[str, Any]:
        return {"query_set": self.queries, "beginning_of_pass_write_index": 2 * i, "end_of_pass_write_index": 2 * i + 1}

    def _put_mark(self, encoder: Any) -> None:
        target = {"view": self._mark, "load_op": "clear", "store_op": "store"}
        encoder.begin_render_pass(color_attachments=[target], timestamp_writes=self._indices(len(self.labels))).end()

    def resolve(self, encoder: Any) -> None:
        if self.queries is None or not self.labels:
            return
        if self._mark:
            self._put_mark(encoder)
        encoder.resolve_query_set(self.queries, 0, 2 * (len(self.labels) + bool(self._mark)), self._result, 0)

    def milliseconds(self) -> list[tuple[str, float]]:
        """Read (label, ms) of each pass since the last call, in order."""
        if self.queries is None or not self.labels:
            return []
        labels, self.labels = self.labels, []
        raw = self.device.queue.read_buffer(self._result, 0, 16 * (len(labels) + bool(self._mark))).cast("Q")
        step = 2 if self._mark else 1  # to the next mark, or the pass's end
        return [(label, (raw[2 * i + step] - raw[2 * i]) * 1e-6) for i, label in enumerate(labels)]


def timing(timer: Timer | None, label: str, encoder: Any) -> dict[str, Any]:
    """Make the arguments of the encoder's begin_compute_pass or begin_render_pass that time the pass, if there is a timer."""
    return {"timestamp_writes": timer.writes(label, encoder)} if timer else {}


class TimedSubmits:
    """Submits passes on `device`, and times them if asked to."""

    device: Device
    timer: Timer | None = None

    def submit(self, *recorded: Callable[[Any, Timer | None], None], profile: list[tuple[str, float]] | None = None) -> None:
        """Record and submit some passes; their times (label, ms) are added to `profile`."""
        if profile is not None and self.timer is None:
            self.timer = Timer(self.device)
        timer = self.timer if profile is not None else None
        encoder = self.device.encoder()
        for record in recorded:
            record(encoder, timer)
        if timer:
            timer.resolve(encoder)
        self.device.submit(encoder)
        if timer and profile is not None:
            profile += timer.milliseconds()


def compute(encoder: Any, pipeline: Any, bind: Any, counts: tuple[int, ...], label: str = "", timer: Timer | None = None) -> None:
    """Record a compute pass of one dispatch. counts: workgroups; label: of its time, if there is a timer."""
    run = encoder.begin_compute_pass(**timing(timer, label, encoder))
    run.set_pipeline(pipeline)
    run.set_bind_group(0, bind)
    run.dispatch_workgroups(*counts)
    run.end()
    divide(encoder)


def divide(encoder: Any) -> None:
    """Divide what an encoder records after a pass, where it is one of ours: `Recording.divide`."""
    if isinstance(encoder, Recording):
        encoder.divide()


def run_ms(device: Device, record: Callable[[Any], None]) -> float:
    """Measure the wall time in ms of recording, submitting and finishing one command buffer."""
    fence = device.buffer(size=16)
    start = time.perf_counter()
    encoder = device.encoder()
    record(encoder)
    device.submit(encoder)
    device.queue.read_buffer(fence)  # waits for all submitted work
    return (time.perf_counter() - start) * 1e3
