"""`airlight bench`: time and error of each method on this adapter, the strongest rival, and whole processes."""

import json
import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from airlight.bench import measure, process
from airlight.bench.daylight import daylight, shadowed
from airlight.bench.look import look
from airlight.bench.media import EVEN, media
from airlight.bench.scenes import scenes
from airlight.bench.shaped import shaped
from airlight.bench.world import EXACT, SHORT, world
from airlight.files import replacing
from airlight.gpu.device import open_device
from airlight.progress import Work, showing


def _commit() -> str:
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10
        )
        return done.stdout.strip() or "unknown"
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def processes(device_name: str | None, say: Any, is_quick: bool = False) -> list[dict[str, Any]]:
    """Time whole processes, see `process`; say a line of each. is_quick: fewer, and no frames."""
    times = process.measure(device_name, 1 if is_quick else 5)
    alone = float(np.median(times["read and write alone"]))
    records = []
    for name, own in times.items():
        one = measure.record_of("whole process", name, process.SIZE, own)
        records.append(one)
        say(f"whole process, 12-megapixel JPEG: {name:20} {one['ms']:8.0f} ms {one['ms'] / alone:6.1f} times reading and writing alone")
    if is_quick:
        return records
    many = process.frames(device_name)
    alone = many["read and write alone, frames"]
    for name, ms in many.items():
        records.append(measure.record_of("whole process", name, process.FRAME, [ms]))
        each = ms / process.FRAMES
        say(f"{process.FRAMES} frames of EXR, 1080p: {name:30} {each:8.0f} ms a frame {ms / alone:6.1f} times reading and writing alone")
    return records


def _telling(say: Any, work: Work, lines: int) -> Callable[[str], None]:
    """Make what says a line, and tells that one of so many of a part of the work is done."""
    said = 0

    def tell(line: str) -> None:
        nonlocal said
        say(line)
        said += 1
        work.share(min(said / lines, 1.0))

    return tell


# What is timed: about how many of all seconds, and how many lines it says; with --quick
Part = tuple[Callable[..., list[dict[str, Any]]], float, int]
WHOLE: tuple[Part, ...] = (
    (measure.methods, 160, 60), (measure.rivals, 40, 6), (measure.extras, 60, 12), (look, 30, 12), (scenes, 60, 12), (world, 150, 18),
    (media, 50, 10), (shaped, 25, 3), (daylight, 10, 5), (shadowed, 20, 2),
)  # fmt: skip
QUICK: tuple[Part, ...] = (
    (partial(measure.methods, runs=3, lights=["inside"], lengths=[(0.926, 3.24)]), 12, 5),
    (partial(look, runs=2), 6, 12),
    (partial(scenes, runs=2, names=["table"]), 8, 6),
    (partial(daylight, runs=3), 4, 5),
    (partial(media, runs=2, suns=["beside"], cases=[EVEN, "exponential fog"]), 5, 2),
    (partial(world, runs=1, chosen=["slats, a spot"], variants=[EXACT, SHORT]), 8, 2),
)
PROCESSES = (150.0, 7), (12.0, 3)  # the same, of whole processes
LEFT_OUT = (
    "--quick: fewer runs, so that times scatter more; left out are lights at the edge and outside, other lengths of shafts, OpenCV, 4K and "
    "four lights, calls through the API, flying, other media and 2,000 steps in them, light with a shape, daylight in scenes, and a "
    "hundred EXR frames"
)


def run(
    json_path: str | None = None, overwrite: bool = False, device_name: str | None = None, say: Any = print, is_quick: bool = False
) -> dict[str, Any]:
    """Measure, print, and write the records as JSON if asked to. is_quick: a part of it, in less than a minute on two cores."""
    device = open_device(device_name)
    say(f"adapter: {device.described}; 1 copy = the fastest of {measure.KERNELS} one-tap rgba16f kernels")
    if is_quick:
        say(LEFT_OUT)
    parts = (*(QUICK if is_quick else WHOLE), (lambda _, tell: processes(device_name, tell, is_quick), *PROCESSES[is_quick]))
    records: list[dict[str, Any]] = []
    with showing("timing", sum(seconds for _, seconds, _ in parts)) as work:
        for part, seconds, lines in parts:
            work.part("timing", seconds)
            records += part(device, _telling(say, work, lines))
    result = {
        "adapter": device.name,
        "backend": device.info.get("backend_type"),
        "driver": device.driver,
        "commit": _commit(),
        "quick": is_quick,
        "records": records,
    }
    if json_path is not None:
        with replacing(json_path, overwrite) as file:
            file.write((json.dumps(result, indent=1) + "\n").encode())
    return result
