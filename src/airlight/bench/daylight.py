"""Daylight at 1280 x 720, in one run: sky and aerial perspective of the table of view rays, and of even air, as ratios to a copy; and in
scenes, with their shadows, as a ratio to the march of their sun in an even medium."""

import importlib.util
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from airlight.bench.measure import Passes, _times, record_of
from airlight.daylight import Atmosphere
from airlight.gpu.device import Device, shared_device
from airlight.options import Medium, Parameters, SceneOptions, build
from airlight.scatter.daylight.passes import DaylightPass
from airlight.scatter.daylight.table import ViewTable

SIZE = (1280, 720)
CASES: dict[str, dict[str, Any]] = {
    "sky and air": {},
    "the same, in shadow": {"shadow": True},
    "the same, as layers": {"parts": True},
    "even air, Eq. 1": {"even_air": True},
}
MOVING = "a table for another sun"
SUN, ALTITUDE, STEP = 20.0, 50.0, 0.01  # degrees, m, degrees that the sun moves
SCENES, SIGMA_T = ("flying", "foliage-beside"), 0.02  # and 1/m, of their fog
AIR, MARCH = ("daylight shadows", "daylight"), ("march sun", "upsample")  # passes
FARTHEST, NEAREST = 6e4, 5.0  # m, of what is seen in the lower half of the picture


def _projection() -> np.ndarray:
    """Make the matrix of a camera with a field of view of 60 degrees across."""
    width, height = SIZE
    across = 1 / np.tan(np.radians(30))
    return np.array([[across, 0, 0, 0], [0, across * width / height, 0, 0], [0, 0, -1.0, -0.1], [0, 0, -1, 0]])


def daylight(device: Device, say: Callable[[str], None], runs: int = 9) -> list[dict[str, Any]]:
    """Measure each of CASES beside a copy, interleaved, then what filling a table takes while the sun moves."""
    width, height = SIZE
    source, layer, depth = (device.texture(width, height, kind) for kind in ("rgba16float", "rgba16float", "r32float"))
    device.write(source, np.ones((height, width, 4), np.float16), 8 * width)
    metres = np.full((height, width), np.inf, np.float32)
    metres[height // 2 :] = np.geomspace(FARTHEST, NEAREST, height - height // 2)[:, None]
    device.write(depth, metres, 4 * width)
    table, air = ViewTable(device), Atmosphere(multiple="psi")  # which costs a pixel the same as orders, and less before
    table.update(air, SUN, ALTITUDE)

    def case(shadow: bool = False, parts: bool = False, even_air: bool = False) -> Callable[[Any], None]:
        made = DaylightPass(device, SIZE, "ray", even_air=even_air)
        made.update(table, np.eye(4), _projection(), (0, 0.3, -1))
        return lambda encoder: made.record(encoder, depth, source, source if shadow else None, parts)

    sun = SUN

    def moved(_: Any) -> None:
        nonlocal sun
        sun += STEP
        table.update(air, sun, ALTITUDE)

    timed = [Passes(device, source, layer).copy(), *(case(**settings) for settings in CASES.values()), moved]
    times = _times(device, timed, runs)
    records = [record_of("daylight", name, SIZE, own) for name, own in zip(("copy", *CASES, MOVING), times, strict=True)]
    base = records[0]["ms"]
    for one in records[1:]:
        say(f"daylight {one['method']:24} {one['ms']:8.1f} ms {one['ms'] / base:6.1f} copies")
    return records


def shadowed(_: Device, say: Callable[[str], None], runs: int = 5) -> list[dict[str, Any]]:
    """Measure in each of SCENES, quality normal, what air with the scene's shadows in it takes, beside the march of the same sun through
    an even fog, in the same frames. Nothing without pygfx or timestamps."""
    if importlib.util.find_spec("pygfx") is None:
        say("daylight: pygfx is not installed (pip install 'airlight[scenes]'), so scenes are left out")
        return []
    from airlight.scenes import open_scene
    from airlight.scenes.daylight import Daylight
    from airlight.scenes.offline import Shot, Studio
    from airlight.scenes.replay import Replay

    shared_device()
    records: list[dict[str, Any]] = []
    for name in SCENES:
        stage = open_scene(name)
        built = build(stage.settings)
        Daylight(Atmosphere(30.0, multiple="psi"), lambda _: (60.0, SUN)).put(stage)
        parameters = msgspec.structs.replace(built[Parameters], method="march", quality="normal")
        medium = Medium(sigma_t=(SIGMA_T, SIGMA_T, SIGMA_T))
        replay = Replay(Studio(stage, Shot(*SIZE, samples=1), parameters, in_scene=built[SceneOptions], medium=medium))
        replay.frame(layer=True)
        frames = [replay.spent()[1] for _ in range(runs)]
        if not all(frames):
            say("daylight: this device has no timestamps, so scenes are left out")
            return records
        air, march = ([sum(frame.get(label, 0.0) for label in labels) for frame in frames] for labels in (AIR, MARCH))
        records += [record_of("daylight", f"{name}, {what}", SIZE, ms) for what, ms in (("march", march), ("air", air))]
        ratio = records[-1]["ms"] / records[-2]["ms"]
        say(f"daylight {name + ', with shadows':24} {records[-1]['ms']:8.1f} ms {ratio:6.2f} times the march of its sun in even fog")
    return records
