"""Opens the rooms that lights with a shape are shown in: `chapel`, dust in the sun through stained glass, and `matinee`, a film showing in
the haze of an attic."""

from importlib import resources
from typing import Any

import pygfx as gfx

from airlight.scenes.gltf.load import load
from airlight.scenes.stage import Stage
from airlight.scenes.validation import validation

DUST: dict[str, Any] = {"noise_amount": 4.0, "noise_size": 0.5, "noise_octaves": 4, "steps": 192, "wind": (0.05, 0.02, 0.03)}
HAZE: dict[str, Any] = {
    "method": "march",
    "ev": 2.2,
    "sigma_t": (0.25, 0.25, 0.25),
    "albedo": 0.98,
    "anisotropy": 0.25,
    "ambient": (0.002, 0.003, 0.005),
    "max_distance": 20.0,
    "noise_amount": 4.0,
    "noise_size": 0.7,
    "wind": (0.06, 0.05, 0.02),
}
SHEET, FACING = (-1.5, 1.45, -0.83), (0.8, 1.1, 0.0)  # m: just before the sheet that the film is shown on, and a place that it faces
BOUNCE = 11.0  # cd: what it reflects, on surfaces alone


def chapel() -> Stage:
    """Open the room of `stained`, whose air is even, with dust in it that drifts."""
    stage = validation("stained")
    stage.name, stage.settings = "chapel", stage.settings | DUST
    return stage


def matinee() -> Stage:
    """Open the attic; its lights are as strong as a display shows them, without an exposure."""
    stage = load(str(resources.files("airlight") / "data" / "scenes" / "models" / "matinee.glb"), "none")
    bounce = gfx.SpotLight(gfx.Color.from_physical(0.62, 0.78, 1.0), BOUNCE, decay=2, angle=1.45, penumbra=0.9)
    bounce.local.position, bounce.target.local.position = SHEET, FACING
    stage.scene.add(bounce, bounce.target)
    stage.name, stage.settings, stage.photometric = "matinee", HAZE, False
    return stage
