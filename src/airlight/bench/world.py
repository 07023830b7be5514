"""Light in a medium at 1280 x 720: exact walk, 2,000 steps, 64 jittered steps or planes at half resolution, and tables of visibility where
there are any, by passes, in one run."""

import importlib.util
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from airlight.bench.measure import Passes, record_of
from airlight.gpu.device import Device, shared_device
from airlight.gpu.timing import run_ms
from airlight.options import March, Medium, Parameters, SceneOptions, build

if TYPE_CHECKING:
    from airlight.pygfx import SceneLight
    from airlight.scenes import Stage

SIZE = (1280, 720)
SUNS = {"in view": 15.0, "beside": 50.0, "parallel": 90.0, "behind": 150.0}  # degrees from the way the camera looks to the sun
RAISED = 30.0  # degrees from sideways to upwards, of the side to which that is
CASES: dict[str, tuple[str, float | None]] = {f"foliage, sun {name}": ("foliage-beside", angle) for name, angle in SUNS.items()}
CASES |= {"slats, a spot": ("slats", None), "cage, a point": ("cage", None)}
EXACT, LONG, SHORT, TABLE, FINE, PLANES = "exact", "2000 steps", "64 steps, half", "table", "table, fine", "64 planes, half"
VARIANTS = {
    EXACT: (March(steps="exact"), 1.0),
    LONG: (March(steps=2000, shadow_filter="nearest"), 1.0),
    SHORT: (March(steps=64, shadow_filter="nearest"), 0.5),
    TABLE: (March(steps="table", shadow_filter="nearest"), 0.5),
    FINE: (March(steps="table", shadow_filter="nearest", shadow_size=2048), 0.5),
    PLANES: (March(planes=64, shadow_filter="nearest"), 0.5),
}
SET_UP = "set-up"  # what the passes do not account for
APART = ("shadows", "merge", SET_UP)  # what is not summing the light


def sun_at(stage: "Stage", angle: float) -> "SceneLight":
    """Turn a sun so many degrees from where the stage's first camera looks."""
    from airlight.pygfx import SceneLight

    right, up, back = np.asarray(next(iter(stage.cameras.values())).world.matrix, float)[:3, :3].T
    side = math.cos(math.radians(RAISED)) * right + math.sin(math.radians(RAISED)) * up
    x, y, z = math.sin(math.radians(angle)) * side - math.cos(math.radians(angle)) * back
    return SceneLight(direction=(x, y, z), disc_half_angle=1.0)


class _Case:
    """Times a scene's frame by one method, carried out again."""

    def __init__(self, scene: str, angle: float | None, variant: str) -> None:
        from airlight.scenes import open_scene
        from airlight.scenes.offline import Shot, Studio
        from airlight.scenes.replay import Replay

        stage = open_scene(scene)
        built = build(stage.settings)
        shot = Shot(*SIZE, samples=1, lights=() if angle is None else (sun_at(stage, angle),))
        march, resolution = VARIANTS[variant]
        more: dict[str, Any] = {"in_scene": SceneOptions(resolution=resolution), "medium": built[Medium], "march": march}
        parameters = msgspec.structs.replace(
            built[Parameters],
            method="slices" if variant == PLANES else built[Parameters].method,
            quality="final" if variant == FINE else built[Parameters].quality,
        )
        self.replay = Replay(Studio(stage, shot, parameters, **more))
        layer = self.replay.frame(layer=True).layer
        assert layer is not None
        self.light = layer[..., :3].astype(float)  # (H, W, 3)
        self.device: Device = self.replay.shafts.device
        self.times: dict[str, list[float]] = {}

    def run(self) -> None:
        whole, passes = self.replay.spent()
        passes = passes or {"whole": whole}
        for label, ms in (passes | {SET_UP: max(whole - sum(passes.values()), 0.0)}).items():
            self.times.setdefault(label, []).append(ms)

    @property
    def summing(self) -> list[float]:
        """Time each run, in ms, of summing the light alone."""
        return [float(sum(run)) for run in zip(*(ms for label, ms in self.times.items() if label not in APART))]

    @property
    def passes(self) -> dict[str, float]:
        return {label: float(np.median(ms)) for label, ms in self.times.items()}


def world(
    _: Device, say: Any, runs: int = 3, chosen: Sequence[str] = tuple(CASES), variants: Sequence[str] = tuple(VARIANTS)
) -> list[dict[str, Any]]:
    """Measure for each of CASES and VARIANTS: copies of the light alone, and of maps and set-up apart; the rmse of the light over its mean
    against the exact walk, of the whole picture; how many times as fast as 2,000 steps. Nothing where pygfx is not installed."""
    if importlib.util.find_spec("pygfx") is None:
        say("medium: pygfx is not installed (pip install 'airlight[scenes]'), so it is left out")
        return []
    shared_device()
    records = []
    for name in chosen:
        scene, angle = CASES[name]
        cases = {variant: _Case(scene, angle, variant) for variant in variants}
        device, truth = cases[EXACT].device, cases[EXACT].light
        copy = Passes(device, *(device.texture(*SIZE, "rgba16float") for _ in range(2))).copy()
        copies: list[float] = []
        for turn in range(runs):
            copies.append(run_ms(device, copy))
            for variant, case in cases.items():
                if variant != LONG or turn % 2 == 0:
                    case.run()
        records.append(record_of(name, "copy", SIZE, copies))
        base, long = float(np.median(copies)), float(np.median(cases[LONG].summing)) if LONG in cases else 0.0
        for variant, case in cases.items():
            error = float(np.sqrt(np.mean((case.light - truth) ** 2)) / truth.mean())
            one = record_of(name, variant, SIZE, case.summing, error=error, passes=case.passes)
            records.append(one)
            parts = ", ".join(f"{label} {ms / base:.1f}" for label, ms in case.passes.items())
            times = f"{long / one['ms']:6.1f} x" if long else ""
            say(f"{name:22} {variant:15} {one['ms']:8.1f} ms {one['ms'] / base:6.1f} copies {times}  rmse {error:6.2%}  ({parts})")
    return records
