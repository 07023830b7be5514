"""Whole processes: `airlight image` on a 12-megapixel JPEG, beside reading and writing the file alone."""

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
RUN = "import sys; from airlight.cli import main; sys.exit(main())"
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


def measure(device_name: str | None, runs: int = 5) -> dict[str, list[float]]:
    """Wall ms of each run of `airlight image` and of reading and writing alone, in turn."""
    with tempfile.TemporaryDirectory() as folder:
        photo, out = Path(folder, "photo.jpg"), Path(folder, "out.jpg")
        write_image(photo, np.minimum(foliage(*SIZE), 1.0))
        named = [] if device_name is None else ["--device", device_name]
        commands: dict[str, list[Any]] = {
            "airlight image": ["-c", RUN, "image", photo, "-o", out, "-y", "--light", "0.6,0.35", *named],
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
