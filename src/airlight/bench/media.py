"""Media that vary in space at 1280 x 720: what they cost beside an even one, pass by pass, in one run. The volume is a ball of smoke that
covers a third of the picture."""

import importlib.util
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from airlight.bench.measure import record_of
from airlight.bench.world import SIZE, sun_at
from airlight.gpu.device import Device, shared_device
from airlight.options import March, Medium, Parameters, build

EVEN = "even"
SUNS = {"beside": 50.0, "behind": 150.0}  # degrees from the way the camera looks to the sun
APART = ("merge", "light table")  # what is not the light's cost: putting it on the picture, and what stays while nothing moves
CELLS = 128  # along the sides of a volume
AHEAD, RADIUS = 12.0, 4.0  # m from the camera to the ball, and of it: it is in front of 35 % of the picture
PANES, PANE_SIZE = 16, 0.11  # things that are seen through, and their sides, of their distance: a sixth of the picture in all
CASES: dict[str, dict[str, Any]] = {
    EVEN: {},
    "exponential fog": {"fog": "exponential"},
    "noise, 3 octaves": {"noise_amount": 2.0, "noise_octaves": 3},
    f"volume, {CELLS}^3": {"air": 1.0},
    f"{PANES} panes": {},
}


def smoke(centre: Any, radius: float) -> Any:
    """Make a ball of smoke, thick in its middle, on a grid of CELLS^3."""
    from airlight.files.volumes import Volume
    from airlight.files.volumes.volume import between

    bounds = np.array([np.asarray(centre, float) - radius, np.asarray(centre, float) + radius])
    x = (np.arange(CELLS) + 0.5) / CELLS * 2 - 1
    away = x[:, None, None] ** 2 + x[None, :, None] ** 2 + x[None, None, :] ** 2
    density = (4 * np.maximum(1 - away, 0) ** 2).astype(np.float32)
    return Volume(density, between(bounds, density.shape), 0.5, "")


def put_panes(scene: Any, camera: Any) -> None:
    """Hang PANES squares of glass before a camera, 4 by 4, each farther than the one before."""
    import pygfx as gfx

    right, up, back = np.asarray(camera.world.matrix, float)[:3, :3].T
    for k in range(PANES):
        away = 4.0 + k
        material = gfx.MeshBasicMaterial(color=(0.6, 0.8, 0.9), opacity=0.25, alpha_mode="blend", side="both")
        pane = gfx.Mesh(gfx.plane_geometry(PANE_SIZE * away, PANE_SIZE * away), material)
        pane.world.matrix = camera.world.matrix
        across, along = (k % 4 - 1.5) * 0.19 * away, (k // 4 - 1.5) * 0.12 * away
        pane.world.position = np.asarray(camera.world.position) - away * back + across * right + along * up
        scene.add(pane)


def _replay(angle: float, case: str) -> Any:
    """Film the foliage with a case's medium."""
    from airlight.scenes import open_scene
    from airlight.scenes.offline import Shot, Studio
    from airlight.scenes.replay import Replay

    stage = open_scene("foliage-beside")
    built = build(stage.settings | {"method": "march", "quality": "normal"} | CASES[case])
    camera = next(iter(stage.cameras.values()))
    stage.pose(0.0, camera)
    if case.endswith("panes"):
        put_panes(stage.scene, camera)
    if case.startswith("volume"):
        stage.fields = [smoke(np.add(camera.world.position, AHEAD * np.array(camera.world.forward)), RADIUS)]
    shot = Shot(*SIZE, samples=1, lights=(sun_at(stage, angle),))
    found = Replay(Studio(stage, shot, built[Parameters], medium=built[Medium], march=built[March]))
    found.frame()
    return found


def media(
    _: Device, say: Callable[[str], None], runs: int = 7, suns: Sequence[str] = tuple(SUNS), cases: Sequence[str] = tuple(CASES)
) -> list[dict[str, Any]]:
    """Measure each of CASES with the sun in each of SUNS, quality normal, interleaved: the light's cost over that in the even medium, and
    its passes. Nothing where pygfx is not installed."""
    if importlib.util.find_spec("pygfx") is None:
        say("media that vary: pygfx is not installed (pip install 'airlight[scenes]'), so they are left out")
        return []
    shared_device()
    records = []
    for sun in suns:
        replays = {case: _replay(SUNS[sun], case) for case in cases}
        times: dict[str, list[dict[str, float]]] = {case: [] for case in cases}
        for _turn in range(runs):
            for case, replay in replays.items():
                whole, passes = replay.spent()
                times[case].append(passes or {"whole": whole})
        base = 0.0
        for case in cases:
            cost = [sum(ms for label, ms in run.items() if label not in APART) for run in times[case]]
            parts = {label: float(np.median([run.get(label, 0.0) for run in times[case]])) for label in times[case][0]}
            one = record_of(f"foliage, sun {sun}", case, SIZE, cost, passes=parts)
            base = base or one["ms"]
            records.append(one | {"ratio": one["ms"] / base})
            shown = ", ".join(f"{label} {ms:.1f}" for label, ms in parts.items() if label != "merge")
            say(f"foliage, sun {sun:8} {case:18} {one['ms']:8.1f} ms {one['ms'] / base:6.2f} times the even medium  ({shown})")
    return records
