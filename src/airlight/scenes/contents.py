"""Lists what a scene has, and where it lies in the world, for whoever places lights, volumes and cameras by hand."""

from typing import Any

import numpy as np
import pygfx as gfx

from airlight.lights.directional import DirectionalLight
from airlight.lights.punctual import PositionalLight
from airlight.messages import counted
from airlight.pygfx.prepass import shown
from airlight.pygfx.punctual import punctual_lights
from airlight.scenes.stage import Stage

MOST = 24  # things that are named


def contents(stage: Stage) -> list[tuple[str, str]]:
    """List (what, where) of a stage at its time 0, lengths in metres: what there is to see as a ball and its bounds, meshes and points by
    name, lights, cameras."""
    boxes: dict[str, np.ndarray] = {}
    for thing in shown(stage.scene):
        bounds = thing.get_world_bounding_box() if isinstance(thing, gfx.Mesh | gfx.Points) and thing.geometry is not None else None
        if bounds is None or not np.isfinite(bounds).all():
            continue
        name = _name(thing) or f"(no name, {sum(known.startswith('(') for known in boxes) + 1})"
        known = boxes.get(name, bounds)
        boxes[name] = np.array([np.minimum(known[0], bounds[0]), np.maximum(known[1], bounds[1])])
    found = [("scene", f"{_length(stage.radius)} m around {_place(stage.center)}; {counted(len(boxes), 'thing')}")]
    if boxes:
        every = np.array(list(boxes.values()))
        found.append(("bounds", _box(np.array([every[:, 0].min(axis=0), every[:, 1].max(axis=0)]))))
    largest = sorted(boxes, key=lambda name: -float(np.ptp(boxes[name], axis=0).max()))
    found += [(name, _box(boxes[name])) for name in largest[:MOST]]
    if len(largest) > MOST:
        found.append(("", f"and {len(largest) - MOST} smaller things"))
    for light in punctual_lights(stage.lights):
        if isinstance(light, DirectionalLight):
            found.append(("light", f"a {light.word}, towards {_place(light.direction)}"))
        elif isinstance(light, PositionalLight):
            found.append(("light", f"a {light.word}, at {_place(light.position)}"))
    found += [(f"camera {name}", f"at {_place(camera.world.position)}") for name, camera in stage.cameras.items()]
    return found


def _name(thing: Any) -> str:
    """Name a thing by itself or what it hangs on."""
    while thing is not None:
        if thing.name:
            return str(thing.name)
        thing = thing.parent
    return ""


def _box(bounds: np.ndarray) -> str:
    return f"{_place(bounds[0])} to {_place(bounds[1])}"


def _place(point: Any) -> str:
    return ",".join(_length(float(v)) for v in point)


def _length(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}" if abs(value) < 1e4 else f"{value:.0f}"
