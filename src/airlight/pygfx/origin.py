"""Brings what is far from the origin near it while it is drawn: pygfx's GPU side counts in float32, whose digits end after seven."""

import contextlib
import contextvars
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.lights.punctual import triple
from airlight.pygfx.lights import SceneLight

_origin: contextvars.ContextVar[np.ndarray | None] = contextvars.ContextVar("origin", default=None)


def current_origin() -> np.ndarray:
    """Give (3,) the world coordinates that are drawn at the origin now, see `near_origin`; 0 elsewhere."""
    found = _origin.get()
    return np.zeros(3) if found is None else found


@contextlib.contextmanager
def near_origin(scene: Any, camera: Any, origin: Any, lights: Sequence[SceneLight] = ()) -> Iterator[None]:
    """Shift a scene, its camera and `lights` by -origin for as long as the block lasts, in float64.

    origin: (3,) world coordinates near what is seen; 0: nothing is done. To be put around a renderer's render(scene, camera).
    """
    offset = np.asarray(origin, np.float64)
    if not offset.any():
        yield
        return
    targets = [thing.target for thing in scene.iter() if isinstance(thing, gfx.DirectionalLight | gfx.SpotLight)]  # these hang nowhere
    targets += [light.target for light in lights if light.target is not None]
    roots = {id(root): root for root in map(root_of, (scene, camera, *targets))}
    # What is skinned and `attached` is placed by its bones alone: its own matrix has to cancel, which it does in float32 only where it
    # moves nothing.
    skins = [thing for thing in scene.iter() if isinstance(thing, gfx.SkinnedMesh) and thing.bind_mode == "attached" and not thing.children]
    saved = [(thing, _state(thing.local)) for thing in (*roots.values(), *skins)]
    placed = [(light, light.position) for light in lights if light.position is not None]
    before = _origin.set(offset)
    try:
        for root in roots.values():
            if root.local.state_basis == "components":
                root.local.position = root.local.position - offset
            else:
                root.local.matrix = _moved(root.local.matrix, -offset)
        for skin in skins:
            matrix = np.array(skin.world.matrix)
            matrix[:3, 3] = 0
            skin.world.matrix = matrix
        for light, position in placed:
            light.position = triple(np.asarray(position, np.float64) - offset)
        yield
    finally:
        _origin.reset(before)
        for thing, state in saved:
            if thing.local.state_basis == "components":
                thing.local.components = state
            else:
                thing.local.matrix = state
        for light, position in placed:
            light.position = position


def root_of(thing: Any) -> Any:
    """Find what an object hangs on in the end; itself where on nothing."""
    while thing.parent is not None:
        thing = thing.parent
    return thing


def _state(local: Any) -> Any:
    """Copy what a transform is set by."""
    return [np.array(part) for part in local.components] if local.state_basis == "components" else np.array(local.matrix)


def _moved(matrix: np.ndarray, offset: np.ndarray) -> np.ndarray:
    matrix = np.array(matrix, np.float64)
    matrix[:3, 3] += offset
    return matrix
