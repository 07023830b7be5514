"""Gives scenes of validation lights with a shape; their pictures and photometric files are made by scripts/validation_shapes.py."""

from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.files import read_image
from airlight.files.photometry import read_photometry
from airlight.lights.shape import Cookie
from airlight.pygfx import SceneLight
from airlight.pygfx.projector import Projector
from airlight.scenes.lamps import cast_shadow
from airlight.scenes.stage import Stage

FOLDER = Path(str(resources.files("airlight"))) / "data" / "scenes" / "validation"
Place = tuple[float, float, float]


def put_shapes(stage: Stage) -> None:
    """Give a stage that bears a name of SHAPED the lights of that."""
    if stage.name in SHAPED:
        SHAPED[stage.name](stage)
        stage.movable = next((light for light in stage.lights if not isinstance(light.target, gfx.DirectionalLight)), None)


def cookie(name: str, size: float = 1.0) -> Cookie:
    """Read a cookie that comes with Airlight. size: m, of a sun's."""
    picture = read_image(str(FOLDER / f"{name}.png"))
    return Cookie(np.ascontiguousarray(np.maximum(picture.rec709(picture.linear()), 0)), size=size)


def _replaced(stage: Stage, lamp: gfx.Light, position: Place, target: Place | None = None, **more: Any) -> None:
    """Let a lamp shine in place of all that a stage has."""
    for light in stage.lights:
        light.target.parent.remove(light.target)
    lamp.local.position = position
    if target is not None:
        lamp.target.local.position = target
    cast_shadow(lamp, stage.center, stage.radius)
    stage.scene.add(lamp)
    stage.lights = [SceneLight(lamp, **more)]


def _warm(r: float, g: float, b: float) -> gfx.Color:
    return gfx.Color.from_physical(r, g, b)


def _slide(stage: Stage) -> None:
    """Project a slide through slats."""
    lamp = Projector(_warm(1.0, 0.92, 0.8), 950.0, fov=(26.0, 42.0), near=0.2, up=(0.0, 1.0, 0.15), cookie=cookie("slide"))
    _replaced(stage, lamp, (-5.4, 4.0, -0.9), (0.9, 0.5, -0.9))


def _gobo(stage: Stage) -> None:
    """Put a gobo into each of two spots, one of them turned; seen from near, so that no texel is narrower than a pixel."""
    stage.cameras["front"].local.position = 0.0, 1.75, 4.2
    half = np.sqrt(0.5)
    turned = np.array([[half, half, 0.0], [-half, half, 0.0], [0.0, 0.0, -1.0]])
    for light, colour, axes in zip(stage.lights, ((1.0, 0.85, 0.7), (0.75, 0.85, 1.0)), (None, turned), strict=True):
        light.target.color = _warm(*colour)
        light.cookie, light.turned = cookie("gobo"), axes


def _leaves(stage: Stage) -> None:
    """Let leaves that are not there shade the sun."""
    stage.lights[0].cookie = cookie("leaves", 1.6)


def _clipped(stage: Stage) -> None:
    """Cut two projectors off by planes; their light falls otherwise than with the square of the distance."""
    slanting, floor, wall = (0.0, -1.0, 0.2, 2.6), (0.0, 1.0, 0.0, -0.45), (-0.6, 0.0, 0.8, 1.1)
    first = Projector(_warm(1.0, 0.6, 0.3), 130.0, fov=(38.0, 24.0), near=1.2, far=5.2, falloff="inverse", clip=[floor, wall])
    _replaced(stage, first, (-2.9, 3.4, 1.9), (0.2, 1.1, -0.2))
    second = Projector(_warm(0.35, 0.6, 1.0), 420.0, fov=(20.0, 34.0), near=0.3, ambient=0.06, clip=[slanting], up=(0.3, 1.0, 0.0))
    second.local.position, second.target.local.position = (3.1, 3.9, 0.4), (-0.1, 1.0, 0.0)
    cast_shadow(second, stage.center, stage.radius)
    stage.scene.add(second)
    stage.lights.append(SceneLight(second))


def _street(stage: Stage) -> None:
    """Hang a street lamp over the posts of a fence."""
    lamp = gfx.PointLight(_warm(1.0, 0.8, 0.52), 420.0, decay=2)
    _replaced(stage, lamp, (0.35, 4.1, -5.1), photometry=read_photometry(str(FOLDER / "street.ies")))


def _flood(stage: Stage) -> None:
    """Let a floodlight with a cone shine through a wheel."""
    stage.lights[0].photometry = read_photometry(str(FOLDER / "flood.ies"))


def _pendant(stage: Stage) -> None:
    """Hang a lamp between panes of glass."""
    lamp = gfx.PointLight(_warm(1.0, 0.88, 0.7), 160.0, decay=2)
    _replaced(stage, lamp, (-0.75, 2.75, -1.95), photometry=read_photometry(str(FOLDER / "pendant.ldt")))


SHAPED: dict[str, Callable[[Stage], None]] = {
    "slide": _slide,
    "gobo": _gobo,
    "leaves": _leaves,
    "clipped": _clipped,
    "street": _street,
    "flood": _flood,
    "pendant": _pendant,
    "smoke-slide": _slide,
}
