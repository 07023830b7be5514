"""Light with a shape at 1280 x 720, in one run: a projector with a cookie beside a spot, and slices beside steps of the march."""

import importlib.util
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from airlight.bench.measure import record_of
from airlight.bench.world import SIZE
from airlight.gpu.device import Device, shared_device
from airlight.options import March, Medium, Parameters, build

SPOT = "spot"
COOKIE = 512  # texels along a side
APART = ("merge",)  # putting the light on the picture
CASES: dict[str, tuple[bool, dict[str, Any]]] = {  # whether by a projector, and what is set
    SPOT: (False, {"method": "march", "quality": "normal"}),
    "projector, cookie": (True, {"method": "march", "quality": "normal"}),
    "spot, slices": (False, {"method": "slices", "quality": "normal"}),
}


def _replay(case: str) -> Any:
    """Film the room with slats, lit by its spot, or by a projector in its place that is as wide."""
    import pygfx as gfx

    from airlight.lights.shape import Cookie
    from airlight.pygfx import Projector, SceneLight
    from airlight.scenes import open_scene
    from airlight.scenes.offline import Shot, Studio
    from airlight.scenes.replay import Replay

    stage = open_scene("slats")
    of_projector, values = CASES[case]
    if of_projector:
        spot = stage.lights[0].target
        assert isinstance(spot, gfx.SpotLight)
        wide = 2 * math.degrees(spot.angle)
        cookie = Cookie(np.random.default_rng(5).uniform(size=(COOKIE, COOKIE, 3)).astype(np.float32))
        lamp = Projector(spot.color, spot.intensity, fov=(wide, wide), near=0.1, cookie=cookie)
        lamp.local.position, lamp.target.local.position = spot.world.position, spot.target.world.position
        stage.scene.add(lamp)
        stage.lights = [SceneLight(lamp)]
    built = build(stage.settings | values)
    found = Replay(Studio(stage, Shot(*SIZE, samples=1), built[Parameters], medium=built[Medium], march=built[March]))
    found.frame()
    return found


def shaped(_: Device, say: Callable[[str], None], runs: int = 7) -> list[dict[str, Any]]:
    """Measure each of CASES, interleaved: the light's cost over that of the spot, and its passes. Nothing where pygfx is not installed."""
    if importlib.util.find_spec("pygfx") is None:
        say("light with a shape: pygfx is not installed (pip install 'airlight[scenes]'), so it is left out")
        return []
    shared_device()
    replays = {case: _replay(case) for case in CASES}
    times: dict[str, list[dict[str, float]]] = {case: [] for case in CASES}
    for _turn in range(runs):
        for case, replay in replays.items():
            whole, passes = replay.spent()
            times[case].append(passes or {"whole": whole})
    records, base = [], 0.0
    for case in CASES:
        cost = [sum(ms for label, ms in run.items() if label not in APART) for run in times[case]]
        parts = {label: float(np.median([run.get(label, 0.0) for run in times[case]])) for label in times[case][0]}
        one = record_of("slats", case, SIZE, cost, passes=parts)
        base = base or one["ms"]
        records.append(one | {"ratio": one["ms"] / base})
        shown = ", ".join(f"{label} {ms:.1f}" for label, ms in parts.items() if label not in APART)
        say(f"slats {case:18} {one['ms']:8.1f} ms {one['ms'] / base:6.2f} times the spot  ({shown})")
    return records
