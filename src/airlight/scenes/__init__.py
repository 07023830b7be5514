"""Scenes in three dimensions: those that come with Airlight, glTF files, and .obj, .ply and .stl. Needs the extra `scenes`."""

import os

from airlight.errors import AirlightError
from airlight.messages import nearest, nearest_file
from airlight.process import standard
from airlight.scenes.names import A_FILE, MESHES, NAMES, VALIDATION, is_picture, is_scene
from airlight.scenes.stage import Stage

__all__ = ["NAMES", "VALIDATION", "Stage", "is_scene", "open_scene"]


def open_scene(
    name_or_path: str | os.PathLike[str],
    environment: str | None = None,
    seed: int | None = None,
    animation: str | None = None,
    scene: str | None = None,
    *,
    lamps: bool = False,
    up: str | None = None,
) -> Stage:
    """Open one of NAMES or VALIDATION, or a .glb, .gltf, .obj, .ply or .stl file, in its pose at time 0.

    environment: for a file, "none", "sunrise", "sky" or an equirectangular .exr or .hdr file; None: what suits its lights.
    animation, scene: of a .glb or .gltf file, a clip and a scene by name, or by number from 0; None: its first clip, and its default scene.
    seed: of the path of "flying", None: its own. lamps: some will be added, so a file without lights gets no sun.
    up: "y" or "z", the axis of an .obj, .ply or .stl file that points up; None: z of .stl, else y. It becomes y: with z up, a point
    x, y, z of the file is x, z, -y.
    Raises AirlightError where there is no such scene, or the file is damaged or asks for more than the limits of `gltf`.
    """
    name = os.fspath(name_or_path)
    if seed is not None and name != "flying":
        raise AirlightError(f"{name}: has no seed; only flying has")
    if up is not None and is_scene(name) and not name.lower().endswith(MESHES):
        raise AirlightError(f"{name}: says itself which way is up; --up goes with .obj, .ply and .stl files")
    if name in (*NAMES, *VALIDATION) or name.lower().endswith(MESHES):
        for option, value in (("animation", animation), ("scene", scene)):
            if value is not None:
                raise AirlightError(f"{name}: has one {option} at most; leave --{option} out, or give a .glb or .gltf file")
    if name in (*NAMES, *VALIDATION):
        if environment is not None:
            raise AirlightError(f"{name}: has its own environment; choose another for {A_FILE}")
        if name in VALIDATION:
            from airlight.scenes.validation import validation

            return validation(name)
        if name == "table":
            from airlight.scenes.table import table

            return table()
        if name == "valley":
            from airlight.scenes.valley import valley

            return valley()
        if name in ("chapel", "matinee"):
            from airlight.scenes import rooms

            return rooms.chapel() if name == "chapel" else rooms.matinee()
        from airlight.scenes.flying import flying

        return flying() if seed is None else flying(seed)
    if not is_scene(name) and not standard.is_input(name):
        hint = "" if os.path.lexists(name) else nearest(name, (*NAMES, *VALIDATION)) or nearest_file(name)
        if is_picture(name):
            raise AirlightError(f"{name}: is a picture, not a scene: airlight image adds light shafts to it")
        raise AirlightError(f"{name}: is not a scene{hint or f'; give table, flying, or {A_FILE}'}")
    if name.lower().endswith(MESHES):
        try:
            from airlight.scenes.meshfiles import load as meshfiles
        except ImportError as error:
            raise AirlightError(f"{name}: needs an extra ({error.name} is missing): pip install airlight[scenes]") from None
        return meshfiles.load(name, environment, lamps, up)
    from airlight.scenes.gltf.load import load

    return load(name, environment, animation, scene, lamps)
