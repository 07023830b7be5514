"""Scenes in three dimensions: those that come with Airlight, and any glTF file. Needs the extra `scenes`."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError

if TYPE_CHECKING:
    import numpy as np
    import pygfx as gfx

    from airlight.pygfx import SceneLight

NAMES = ("table", "flying")
VALIDATION = {  # scattering in the world is validated on: the file of each, and its camera
    "slats": ("slats", "room"),
    "foliage-view": ("foliage", "view"),
    "foliage-beside": ("foliage", "beside"),
    "foliage-behind": ("foliage", "behind"),
    "cage": ("cage", "room"),
    "two-spots": ("two-spots", "front"),
    "window": ("window", "corner"),
    "headlamp": ("headlamp", "eye"),
    "dense": ("dense", "front"),
    "mirrored": ("mirrored", "front"),
}


def is_scene(source: str) -> bool:
    """Tell a scene, by its name or its file's, from a picture."""
    return source in (*NAMES, *VALIDATION) or source.lower().endswith((".glb", ".gltf"))


@dataclass
class Stage:
    """A scene with all that is needed to film it.

    cameras: the first is the default. lights: what casts shafts. duration: seconds of its animation, which is looped; 0: still.
    pose(t, camera): put everything where it is at time t (seconds), the same for the same t whatever came before;
    the camera, if given and one of those that follow something, moves too.
    center: (3,), radius: a sphere around what there is to see. movable: the light that a user may drag, or None.
    path: a line where something flies along, hidden until its `visible` is set, or None.
    settings: values of declared parameters that the scene is meant for, where a user gives none; of its medium and march.
    """

    name: str
    scene: gfx.Scene
    cameras: dict[str, gfx.PerspectiveCamera]
    lights: list[SceneLight]
    duration: float
    pose: Callable[[float, gfx.PerspectiveCamera | None], None]
    center: np.ndarray
    radius: float
    movable: SceneLight | None = None
    path: gfx.WorldObject | None = None
    settings: dict[str, Any] = field(default_factory=dict)


def open_scene(name_or_path: str | os.PathLike[str], environment: str | None = None, seed: int | None = None) -> Stage:
    """Open "table", "flying", a scene of VALIDATION, or a .glb or .gltf file, in its pose at time 0.

    environment: for a file, "none", "sunrise", "sky" or an equirectangular .exr or .hdr file; None: what suits its lights.
    seed: of the path of "flying", None: its own.
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

    return load(name, environment)
