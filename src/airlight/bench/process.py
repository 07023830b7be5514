"""Whole processes: `airlight image` on a 12-megapixel JPEG and on a hundred EXR frames, beside reading and writing them alone."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from airlight.files import write_image
from airlight.reference.scenes import foliage

SIZE = (4240, 2832)
ALONE = """
import sys, OpenImageIO as oiio
source = oiio.ImageInput.open(sys.argv[1])
spec, pixels = source.spec(), source.read_image("uint8")
like = oiio.ImageSpec(spec.width, spec.height, 3, "uint8")
like.attribute("compression", "jpeg:95")
like.attribute("jpeg:subsampling", "4:4:4")
out = oiio.ImageOutput.create(sys.argv[2])
assert out.open(sys.argv[2], like) and out.write_image(pixels) and out.close()
"""


CLASSIC = ["--look", "classic"]
FRAMES, FRAME = 100, (1920, 1080)
ALONE_EXR = """
import sys, OpenImageIO as oiio
folder, count = sys.argv[1], int(sys.argv[2])
for i in range(1, count + 1):
    source = oiio.ImageInput.open(f"{folder}/in.{i:04d}.exr")
    spec, pixels = oiio.ImageSpec(source.spec()), source.read_image("half")
    if i == 1 and len(sys.argv) > 3:  # what is written instead
        source = oiio.ImageInput.open(sys.argv[3])
        like = oiio.ImageSpec(source.spec()), source.read_image(0, 0, 0, source.spec().nchannels, "half")
    if len(sys.argv) > 3:
        spec, pixels = like
    out = oiio.ImageOutput.create("a.exr")
    assert out.open(f"{folder}/alone.{i:04d}.exr", spec) and out.write_image(pixels) and out.close()
"""


def frames(device_name: str | None) -> dict[str, float]:
    """Time in wall ms a hundred 1080p half EXRs (zips): through the command line, layer and all; read and written alone; and read alone
    with such frames written as the command line wrote, which hold twice the channels."""
    with tempfile.TemporaryDirectory() as folder:
        picture = foliage(*FRAME)
        for i in range(1, FRAMES + 1):  # each its own file; the content hardly matters
            if i <= 4:
                write_image(Path(folder, f"in.{i:04d}.exr"), np.roll(picture, 40 * i, axis=1))
            else:
                Path(folder, f"in.{i:04d}.exr").write_bytes(Path(folder, f"in.{(i - 1) % 4 + 1:04d}.exr").read_bytes())
        named = [] if device_name is None else ["--device", device_name]
        source, out = Path(folder, "in.####.exr"), Path(folder, "out.####.exr")
        commands = {
            "airlight image, frames": ["-m", "airlight", "image", source, "-o", out, "--light", "0.6,0.35", *named],
            "read and write alone, frames": ["-c", ALONE_EXR, folder, FRAMES],
            "read and write alone, layer too": ["-c", ALONE_EXR, folder, FRAMES, Path(folder, "out.0001.exr")],
        }
        times = {}
        for name, command in commands.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, *map(str, command)], check=True, capture_output=True, timeout=1200)
            times[name] = (time.perf_counter() - start) * 1e3
        return times


def measure(device_name: str | None, runs: int = 5) -> dict[str, list[float]]:
    """Time in wall ms each run of `airlight image` and of reading and writing alone, in turn."""
    with tempfile.TemporaryDirectory() as folder:
        photo, out = Path(folder, "photo.jpg"), Path(folder, "out.jpg")
        write_image(photo, np.minimum(foliage(*SIZE), 1.0))
        named = [] if device_name is None else ["--device", device_name]
        commands: dict[str, list[Any]] = {
            "airlight image": ["-m", "airlight", "image", photo, "-o", out, "-y", "--light", "0.6,0.35", *named],
            "airlight image, classic": ["-m", "airlight", "image", photo, "-o", out, "-y", "--light", "0.6,0.35", *CLASSIC, *named],
            "read and write alone": ["-c", ALONE, photo, out],
        }
        times: dict[str, list[float]] = {name: [] for name in commands}
        for turn in range(runs + 1):  # the first fills caches
            for name, command in commands.items():
                start = time.perf_counter()
                subprocess.run([sys.executable, *map(str, command)], check=True, capture_output=True, timeout=300)
                if turn:
                    times[name].append((time.perf_counter() - start) * 1e3)
        return times
