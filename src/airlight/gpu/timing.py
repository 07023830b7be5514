"""Timing of passes: timestamps where the adapter has them, the wall clock elsewhere."""

import time
from collections.abc import Callable
from typing import Any

from airlight.gpu.device import Device


class Timer:
    """Times passes by their labels, see `timing`; read `milliseconds()` after the submit."""

    def __init__(self, device: Device, capacity: int = 64) -> None:
        self.device = device
        self.labels: list[str] = []
        self.capacity = capacity
        self.queries = device.device.create_query_set(type="timestamp", count=2 * capacity) if device.timestamps else None
        usage = device.wgpu.BufferUsage
        flags = usage.QUERY_RESOLVE | usage.COPY_SRC
        self._result = device.device.create_buffer(size=16 * capacity, usage=flags) if self.queries else None

    def writes(self, label: str) -> Any:
        if self.queries is None or len(self.labels) >= self.capacity:
            return None
        i = len(self.labels)
        self.labels.append(label)
        return {"query_set": self.queries, "beginning_of_pass_write_index": 2 * i, "end_of_pass_write_index": 2 * i + 1}

    def resolve(self, encoder: Any) -> None:
        if self.queries is not None and self.labels:
            encoder.resolve_query_set(self.queries, 0, 2 * len(self.labels), self._result, 0)

    def milliseconds(self) -> list[tuple[str, float]]:
        """(label, ms) of each pass since the last call, in order."""
        if self.queries is None or not self.labels:
            return []
        raw = self.device.queue.read_buffer(self._result, 0, 16 * len(self.labels)).cast("Q")
        labels, self.labels = self.labels, []
        return [(label, (raw[2 * i + 1] - raw[2 * i]) * 1e-6) for i, label in enumerate(labels)]


def timing(timer: Timer | None, label: str) -> dict[str, Any]:
    """Arguments of begin_compute_pass or begin_render_pass that time the pass, if there is a timer."""
    return {"timestamp_writes": timer.writes(label)} if timer else {}


def run_ms(device: Device, record: Callable[[Any], None]) -> float:
    """Wall time in ms of recording, submitting and finishing one command buffer."""
    fence = device.buffer(size=16)
    start = time.perf_counter()
    encoder = device.encoder()
    record(encoder)
    device.submit(encoder)
    device.queue.read_buffer(fence)  # waits for all submitted work
    return (time.perf_counter() - start) * 1e3
