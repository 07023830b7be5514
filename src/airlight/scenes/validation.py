"""The scenes that scattering in the world is validated on: small glTF files, made by scripts/validation_scenes.py, each with the medium
that it is meant for, as a preset of its name."""

from importlib import resources
from pathlib import Path

from airlight.options import presets
from airlight.scenes.gltf.load import load
from airlight.scenes.names import VALIDATION
from airlight.scenes.stage import Stage

FOLDER = Path(str(resources.files("airlight"))) / "data" / "scenes" / "validation"


def validation(name: str) -> Stage:
    """Open one of VALIDATION; its settings are those of its medium."""
    file, camera = VALIDATION[name]
    stage = load(str(FOLDER / f"{file}.glb"), "none")
    stage.name = name
    stage.cameras = {camera: stage.cameras[camera], **stage.cameras}
    stage.settings = presets.load(FOLDER / f"{name}.toml")
    return stage
