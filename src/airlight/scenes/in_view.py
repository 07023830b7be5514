"""Tell whether a camera sees anything of a scene, by the boxes around its things."""

from typing import Any

import numpy as np
import pygfx as gfx

from airlight.pygfx.bounds import Bounds
from airlight.pygfx.prepass import shown

_bounds = Bounds()


def sees_something(scene: Any, camera: Any) -> bool:
    """Tell whether the box of any visible mesh, line or cloud of points reaches into the camera's view, as both are now."""
    things = [thing for thing in shown(scene) if isinstance(thing, gfx.Mesh | gfx.Line | gfx.Points | gfx.Text)]
    things = [thing for thing in things if getattr(thing.geometry, "positions", None) is not None]
    at = _bounds.hulls(things) @ camera.camera_matrix[:, :3].T + camera.camera_matrix[:, 3]
    x, y, z, w = np.moveaxis(at, -1, 0)
    outside = [x < -w, x > w, y < -w, y > w, z < 0, z > w]
    return bool((~np.any([side.all(axis=1) for side in outside], axis=0)).any())
