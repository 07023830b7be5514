"""The screen-space method in 3-D scenes at 1280 x 720: each of its passes and all together, as ratios to a one-tap copy, in one run."""

import importlib.util
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from airlight.bench.measure import Passes, record_of
from airlight.gpu.device import Device, shared_device
from airlight.gpu.timing import run_ms
from airlight.options import Parameters, SceneOptions

SIZE = (1280, 720)
SCENES = {"table": 0.0, "flying": 0.0}  # and the time of the frame
# pmndrs postprocessing GodRays' defaults; its blur is left out
SIXTY = {"method": "radial", "samples": 60, "density": 0.96, "decay": 0.9, "weight": 0.4, "exposure": 0.6, "normalization": "listing"}
TURN_DEG = 0.05  # degrees that the camera turns from frame to frame, so that the lights are aimed anew


class _Frame:
    """Times one frame of a stage, carried out again with its lights aimed anew."""

    def __init__(self, name: str, time: float) -> None:
        from airlight.scenes import open_scene
        from airlight.scenes.offline import Shot, Studio
        from airlight.scenes.replay import Replay

        self.replay = Replay(Studio(open_scene(name), Shot(*SIZE, samples=1)))
        self.replay.frame(time)
        self.shafts = self.replay.shafts
        self.device: Device = self.shafts.device

    def record(self, encoder: Any) -> None:
        """Record the pass with its light aimed anew, as in a frame whose camera has turned."""
        turn = np.radians(TURN_DEG)
        about = np.eye(4)
        about[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(turn), np.sin(turn), -np.sin(turn), np.cos(turn)
        camera = self.replay.studio.camera
        camera.world.matrix = camera.world.matrix @ about
        self.replay.record(encoder)

    def per_pass(self, runs: int) -> dict[str, float]:
        """Find median ms of each pass by its label; {} where the device has no timestamps."""
        times: dict[str, list[float]] = {}
        for _ in range(runs):
            for label, ms in self.replay.spent(self.record)[1].items():
                times.setdefault(label, []).append(ms)
        return {label: float(np.median(own)) for label, own in times.items()}


def scenes(_: Device, say: Any, runs: int = 15, names: Sequence[str] = tuple(SCENES)) -> list[dict[str, Any]]:
    """Time mask, shafts and merge of the stencil, of contrast, and of the pre-pass with the occluders drawn again; and a sum of
    60 taps at half resolution instead of ours. Nothing where pygfx is not installed."""
    if importlib.util.find_spec("pygfx") is None:
        say("scenes: pygfx is not installed (pip install 'airlight[scenes]'), so they are left out")
        return []
    shared_device()
    records = []
    for name in names:
        frame = _Frame(name, SCENES[name])
        device, shafts = frame.device, frame.shafts
        source, layer = (device.texture(*SIZE, "rgba16float") for _ in range(2))
        copy = Passes(device, source, layer).copy()
        variants: dict[str, tuple[SceneOptions, Parameters]] = {
            "stencil": (SceneOptions(), Parameters()),
            "contrast": (SceneOptions(occluders="contrast"), Parameters()),
            "prepass": (SceneOptions(occluders="prepass"), Parameters()),
            "prepass, region 1": (SceneOptions(occluders="prepass", region=1.0), Parameters()),
            "60 taps, stencil": (SceneOptions(), msgspec.convert(SIXTY, Parameters)),
        }
        times: dict[str, list[float]] = {"copy": [], **{variant: [] for variant in variants}}
        passes: dict[str, dict[str, float]] = {}
        for turn in range(runs + 1):
            spent = {"copy": run_ms(device, copy)}
            for variant, (in_scene, parameters) in variants.items():
                shafts.in_scene, shafts.parameters = in_scene, parameters
                if turn == 0:
                    run_ms(device, frame.record)
                    run_ms(device, frame.record)
                    passes[variant] = frame.per_pass(5)
                run_ms(device, frame.record)  # what a change of variants makes anew
                spent[variant] = run_ms(device, frame.record)
            if turn:
                for variant, ms in spent.items():
                    times[variant].append(ms)
        base = float(np.median(times["copy"]))
        for variant, own in times.items():
            one = record_of(name, variant, SIZE, own) | ({"passes": passes[variant]} if variant in passes else {})
            records.append(one)
            parts = ", ".join(f"{label} {ms / base:.1f}" for label, ms in passes.get(variant, {}).items())
            say(f"{name:8} {variant:20} {one['ms']:8.1f} ms {one['ms'] / base:6.1f} copies  ({parts})")
    return records
