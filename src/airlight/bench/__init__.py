"""`airlight bench`: time and error of each method on this adapter, the strongest rival, and whole processes."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from airlight.bench import measure, process
from airlight.bench.look import look
from airlight.bench.scenes import scenes
from airlight.bench.world import world
from airlight.files import replacing
from airlight.gpu.device import open_device


def _commit() -> str:
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10
        )
        return done.stdout.strip() or "unknown"
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _processes(device_name: str | None, say: Any) -> list[dict[str, Any]]:
    times = process.measure(device_name)
    alone = float(np.median(times["read and write alone"]))
    records = []
    for name, own in times.items():
        one = measure.record_of("whole process", name, process.SIZE, own)
        records.append(one)
        say(f"whole process, 12-megapixel JPEG: {name:20} {one['ms']:8.0f} ms {one['ms'] / alone:6.1f} times reading and writing alone")
    many = process.frames(device_name)
    alone = many["read and write alone, frames"]
    for name, ms in many.items():
        records.append(measure.record_of("whole process", name, process.FRAME, [ms]))
        each = ms / process.FRAMES
        say(f"{process.FRAMES} frames of EXR, 1080p: {name:30} {each:8.0f} ms a frame {ms / alone:6.1f} times reading and writing alone")
    return records


def run(json_path: str | None = None, overwrite: bool = False, device_name: str | None = None, say: Any = print) -> dict[str, Any]:
    """Measure, print, and write the records as JSON if asked to."""
    device = open_device(device_name)
    say(f"adapter: {device.described}; 1 copy = the fastest of {measure.KERNELS} one-tap rgba16f kernels")
    parts = (measure.methods, measure.rivals, measure.extras, look, scenes, world)
    result = {
        "adapter": device.name,
        "backend": device.info.get("backend_type"),
        "driver": device.driver,
        "commit": _commit(),
        "records": [record for part in parts for record in part(device, say)] + _processes(device_name, say),
    }
    if json_path is not None:
        with replacing(json_path, overwrite) as file:
            file.write((json.dumps(result, indent=1) + "\n").encode())
    return result
