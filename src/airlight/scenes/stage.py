"""A scene with all that is needed to film it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import pygfx as gfx

    from airlight.pygfx import SceneLight


@dataclass
class Stage:
    """A scene with all that is needed to film it.

    cameras: the first is the default. lights: what casts shafts. duration: seconds of its animation, which is looped; 0: still.
    pose(t, camera): put everything where it is at time t (seconds), the same for the same t whatever came before;
    the camera, if given and one of those that follow something, moves too.
    center: (3,), radius: a sphere around what there is to see. movable: the light that a user may drag, or None.
    draggable: gfx lights, targets of `lights`, that stand still, so that a user may drag them too.
    path: a line where something flies along, hidden until its `visible` is set, or None.
    glowing: names of the meshes that emit light, of a scene without lights of its own.
    fields: densities that lie in its air, as LightShafts takes them; of those that follow a frame's number, frame 1 is at time 0, and there
    are fps a second. cookies: those of its lights that follow it too.
    pre_exposure: factor that its radiances are scaled by, see `scenes.exposure`. sky_sun: lux of a sun that its sky is in proportion to, or
    None where it has none.
    measured: whether a user gave some light in units, so that it is exposed however weak that is. photometric: whether its lights are of a
    file that gives them in lux and candela.
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
    glowing: tuple[str, ...] = ()
    fields: list[Any] = field(default_factory=list)
    cookies: list[Any] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    fps: float = 24.0
    pre_exposure: float = 1.0
    sky_sun: float | None = None
    measured: bool = False
    photometric: bool = False
    draggable: list[Any] = field(default_factory=list)
