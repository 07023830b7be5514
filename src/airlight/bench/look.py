"""The smart look on a picture of 8 bits: each of its passes as ratios to a one-tap copy, in one run."""

from typing import Any

import numpy as np

from airlight.arrays import to_linear
from airlight.bench.measure import LIGHTS, Passes, record_of
from airlight.colour import encode_codes
from airlight.gpu.device import Device
from airlight.gpu.timing import run_ms
from airlight.lights import ImageLight
from airlight.look.apply import apply
from airlight.options import Look
from airlight.reference.scenes import foliage
from airlight.scatter.render import PictureRenderer

SIZE = (1920, 1080)
SUM = "sum"  # the pass that any method of the kind needs; the rest is the look's own


def look(device: Device, say: Any, runs: int = 15) -> list[dict[str, Any]]:
    """Time the passes, one picture after the other, and a copy between them."""
    codes = encode_codes(np.minimum(foliage(*SIZE), 1.0).astype(np.float32), np.uint8, dither=False)
    linear = to_linear(codes)[0]
    passes = Passes(device, device.texture(*SIZE, "rgba16float"), device.texture(*SIZE, "rgba16float"))
    copy, renderer = passes.copy(), PictureRenderer(device, keep=1)
    times: dict[str, list[float]] = {"copy": []}
    for turn in range(runs + 1):
        found: list[tuple[str, float]] = []
        apply(renderer, codes, linear, [ImageLight(LIGHTS["inside"], kind="disc")], Look(), float_output=False, profile=found)
        one = run_ms(device, copy)
        if turn:  # the first compiles
            times["copy"].append(one)
            for label in dict(found):
                times.setdefault(label, []).append(sum(ms for name, ms in found if name == label))
    base = float(np.median(times["copy"]))
    records = [record_of("look", "copy", SIZE, times.pop("copy"))]
    own = 0.0
    for label, values in times.items():
        records.append(record_of("look", label, SIZE, values))
        own += 0.0 if label == SUM else records[-1]["ms"] / base
        say(f"smart look: {label:12} {SIZE[0]} x {SIZE[1]} {records[-1]['ms']:8.2f} ms {records[-1]['ms'] / base:6.2f} copies")
    say(f"smart look: all beside the sum {own:6.2f} copies")
    return records
