"""The scenes that scattering in the world is validated on: small glTF files, made by scripts/validation_scenes.py, each with the medium
that it is meant for, as a preset of its name; some with a density in it, made by scripts/validation_volumes.py, some with other lights,
shaped.py."""

import math
from importlib import resources
from pathlib import Path

import numpy as np

from airlight.files.volumes import Volume, read_volume
from airlight.medium.field import Field
from airlight.medium.particles import bake
from airlight.options import presets
from airlight.scenes.gltf.load import load
from airlight.scenes.names import VALIDATION
from airlight.scenes.shaped import put_shapes
from airlight.scenes.stage import Stage

FOLDER = Path(str(resources.files("airlight"))) / "data" / "scenes" / "validation"
VOLUMES = {  # the file, and how far it is moved in the world, m
    "smoke-sun": ("plume", (-1.35, 0.0, -0.45)),
    "smoke-spot": ("plume", (-0.5, 0.0, -0.9)),
    "in-smoke": ("bank", (0.0, 0.0, 0.0)),
    "smoke-slide": ("plume", (-0.5, 0.0, -0.9)),
}
PUFFS, PUFF_CELLS = 30, 48  # particles, and cells along the longest side of their grid


def puffs() -> Volume:
    """Bake particles that wind around the lamp of the cage."""
    k = np.arange(PUFFS)
    turn, away = k * math.pi * (3 - math.sqrt(5)), 0.8 + 0.9 * (k % 5) / 4
    points = np.stack([away * np.cos(turn), 0.35 + 2.5 * (k + 0.5) / PUFFS, away * np.sin(turn)], axis=1)
    density, matrix, _ = bake(points, 0.2 + 0.07 * (k % 3), 2.5 + 1.5 * (k % 4), PUFF_CELLS)
    return Volume(density, matrix, 0.0, "puffs")


def validation(name: str) -> Stage:
    """Open one of VALIDATION; its settings are those of its medium."""
    file, camera = VALIDATION[name]
    stage = load(str(FOLDER / f"{file}.glb"), "none")
    stage.name = name
    stage.cameras = {camera: stage.cameras[camera], **stage.cameras}
    stage.settings = presets.load(FOLDER / f"{name}.toml")
    put_shapes(stage)
    if name in VOLUMES:
        density, move = VOLUMES[name]
        volume = read_volume(str(FOLDER / f"{density}.npz"))
        volume.matrix[:3, 3] += move
        stage.fields = [Field(volume)]
    elif name == "puffs":
        stage.fields = [Field(puffs())]
    return stage
