"""The scenes that scattering in the world is validated on: small glTF files, made by scripts/validation_scenes.py, each with the medium
that it is meant for, as a preset of its name; some with a density in it, made by scripts/validation_volumes.py."""

from importlib import resources
from pathlib import Path

from airlight.files.volumes import read_volume
from airlight.medium.field import Field
from airlight.options import presets
from airlight.scenes.gltf.load import load
from airlight.scenes.names import VALIDATION
from airlight.scenes.stage import Stage

FOLDER = Path(str(resources.files("airlight"))) / "data" / "scenes" / "validation"
VOLUMES = {  # the file, and how far it is moved in the world, m
    "smoke-sun": ("plume", (-1.35, 0.0, -0.45)),
    "smoke-spot": ("plume", (-0.5, 0.0, -0.9)),
    "in-smoke": ("bank", (0.0, 0.0, 0.0)),
}


def validation(name: str) -> Stage:
    """Open one of VALIDATION; its settings are those of its medium."""
    file, camera = VALIDATION[name]
    stage = load(str(FOLDER / f"{file}.glb"), "none")
    stage.name = name
    stage.cameras = {camera: stage.cameras[camera], **stage.cameras}
    stage.settings = presets.load(FOLDER / f"{name}.toml")
    if name in VOLUMES:
        density, move = VOLUMES[name]
        volume = read_volume(str(FOLDER / f"{density}.npz"))
        volume.matrix[:3, 3] += move
        stage.fields = [Field(volume)]
    return stage
