"""Shows and sets what shapes a scene's light: of a projector where it aims, its frustum and falloff; and cookies of files."""

from dataclasses import replace
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.jobs.cookies import open_cookie
from airlight.jobs.shape_text import names
from airlight.lights.punctual import triple
from airlight.lights.shape import Cookie
from airlight.pygfx import Projector, SceneLight
from airlight.scenes.lamps import cast_shadow
from airlight.viewer.state import LightControl

SIZE = 0.1  # of the scene's radius: width of a sun's cookie, until the user says another


def describe(control: LightControl, light: SceneLight, radius: float) -> None:
    """Say in a control what its light has of this. radius: the scene's, m."""
    own, target = names(light), light.target
    control.name = own[0] if own else ""
    if isinstance(target, Projector):
        control.aim, control.fov, control.falloff = _place(target.target), target.fov, target.falloff
        control.written = target.written or None
        power = np.array(target.color.to_physical()[:3], float)
        top = float(power.max()) or 1.0
        control.intensity, control.color = float(f"{target.intensity * top:.6g}"), triple((power / top).round(4))
    control.takes_cookie = isinstance(target, Projector) or (bool(own) and isinstance(target, gfx.SpotLight | gfx.DirectionalLight))
    if isinstance(target, gfx.DirectionalLight):
        control.gobo_size = float(f"{SIZE * radius:.3g}")


def _place(thing: Any) -> tuple[float, ...]:
    return tuple(round(float(v), 5) for v in thing.world.position)


class Shapes:
    """Gives lights what their controls say; one for each stage.

    cookies: those of files that were read, by path: what is taken back needs them again.
    """

    def __init__(self) -> None:
        self.cookies: dict[str, Cookie] = {}
        self._touched: set[int] = set()
        self._before: dict[int, tuple[Any, Any, float]] = {}  # by light: its cookie, its color, and its intensity, as they were exposed
        self._sized: dict[tuple[str, float], Cookie] = {}

    def read(self, path: str) -> None:
        """Read a cookie's file, again where it was read before. Raises AirlightError."""
        self.cookies[path] = open_cookie(path)
        self._sized = {key: cookie for key, cookie in self._sized.items() if key[0] != path}

    def apply(self, number: int, light: SceneLight, control: LightControl, before: LightControl, stage: Any) -> None:
        """Set what a control says of its light; nothing while nobody has changed it."""
        if number not in self._touched and shape_of(control) == shape_of(before):
            return
        target = light.target
        if number not in self._touched:
            self._touched.add(number)
            known = (target.color, float(target.intensity)) if isinstance(target, Projector) else (None, 0.0)
            self._before[number] = light.cookie, *known
        cookie, color, intensity = self._before[number]
        light.cookie = self._cookie(control, isinstance(target, gfx.DirectionalLight)) if control.gobo else cookie
        if hasattr(light.cookie, "frame") and not any(light.cookie is one for one in stage.cookies):
            stage.cookies.append(light.cookie)  # a film
        if not isinstance(target, Projector) or control.aim is None or control.fov is None:
            return
        if control.aim != control.position:
            target.target.world.position = control.aim
        target.world.position = control.position
        target.fov, target.falloff = control.fov, control.falloff
        same = control.color == before.color
        target.color = color if same else gfx.Color.from_physical(*control.color)
        top = max(color.to_physical()[:3]) if same else 1.0
        own = max(color.to_physical()[:3]) * intensity  # in units of the exposure
        target.intensity = own * (control.intensity / before.intensity if before.intensity else 0.0) / (top or 1.0)
        cast_shadow(target, stage.center, stage.radius)

    def _cookie(self, control: LightControl, sized: bool) -> Cookie:
        path = control.gobo
        if not sized:
            return self.cookies[path]
        key = path, control.gobo_size
        if key not in self._sized:
            film = hasattr(self.cookies[path], "frame")
            sized_one = open_cookie(path, control.gobo_size) if film else replace(self.cookies[path], size=control.gobo_size)
            self._sized[key] = sized_one
        return self._sized[key]


def shape_of(control: LightControl) -> tuple[Any, ...]:
    """Collect what is shown and set here."""
    place = (*control.position, *control.aim, control.color) if control.aim is not None else ()
    return place, control.fov, control.falloff, control.intensity, control.gobo, control.gobo_size
