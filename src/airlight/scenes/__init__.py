"""Scenes in three dimensions: those that come with Airlight, and any glTF file. Needs the extra `scenes`."""

import os

from airlight.errors import AirlightError
from airlight.scenes.names import NAMES, VALIDATION, is_scene
from airlight.scenes.stage import Stage

__all__ = ["NAMES", "VALIDATION", "Stage", "is_scene", "open_scene"]


def open_scene(
    name_or_path: str | os.PathLike[str], environment: str | None = None, seed: int | None = None, *, lamps: bool = False
) -> Stage:
    """Open "table", "flying", a scene of VALIDATION, or a .glb or .gltf file, in its pose at time 0.

    environment: for a file, "none", "sunrise", "sky" or an equirectangular .exr or .hdr file; None: what suits its lights.
    seed: of the path of "flying", None: its own. lamps: some will be added, so a file without lights gets no sun.
    Raises AirlightError where there is no such scene, or the file is damaged or asks for more than the limits of `gltf`.
    """
    name = os.fspath(name_or_path)
    if seed is not None and name != "flying":
        raise AirlightError(f"{name}: has no seed; only flying has")
    if name in (*NAMES, *VALIDATION):
        if environment is not None:
            raise AirlightError(f"{name}: has its own environment; choose another for a .glb or .gltf file")
        if name in VALIDATION:
            from airlight.scenes.validation import validation

            return validation(name)
        if name == "table":
            from airlight.scenes.table import table

            return table()
        from airlight.scenes.flying import flying

        return flying() if seed is None else flying(seed)
    if not is_scene(name):
        raise AirlightError(f"{name}: is not a scene; give table, flying, or a .glb or .gltf file")
    from airlight.scenes.gltf.load import load

    return load(name, environment, lamps)
