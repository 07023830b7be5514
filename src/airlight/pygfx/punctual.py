"""Makes the lights that shine on a medium of a scene's lights."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.lights.directional import DirectionalLight
from airlight.lights.numbers import unit
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PunctualLight, Triple, triple
from airlight.lights.shape import axes_along
from airlight.lights.spot import SpotLight
from airlight.pygfx.lights import BODY, SceneLight, beam
from airlight.pygfx.projector import Projector

UP = 0.0, 1.0, 0.0  # of a projector, unset: then it may shine along it


def punctual_lights(lights: Sequence[SceneLight], pre_exposure: float = 1.0) -> list[PunctualLight]:
    """Makes what shines on the medium: each visible gfx light that is the target of one of `lights`, or below it, once; what is given by a
    position or direction alone, or by a target without gfx lights, as color times strength, in candela or lux. Dark ones are left out.

    pre_exposure: factor that gfx lights' own intensities hold already, and SceneLights' do not.
    A gfx light's intensity is what its surfaces take it for, lux of a sun, else candela: its decay has to be 2, pygfx's default is 0.
    Raises AirlightError for what a light cannot be.
    """
    found: list[PunctualLight] = []
    taken: set[int] = set()
    for light in lights:
        light.check()
        own = [] if light.target is None else [thing for thing in light.target.iter() if isinstance(thing, tuple(GFX_KINDS))]
        body = light.body()
        near = 0.0 if body is None else BODY * body[1]
        if not own:
            found.append(_placed(light, near, pre_exposure))
        for one in own:
            if id(one) not in taken and _shines(one):
                taken.add(id(one))
                found.append(_of(one, light, near, pre_exposure))
    placed = [one for one in found if np.isfinite([*one.in_view(np.eye(4)), *one.axis()]).all()]
    return [one for one in placed if one.strength * max(one.intensity) > 0]


def shaped_lights(lights: Sequence[SceneLight]) -> dict[int, PunctualLight]:
    """Makes those of `lights`' gfx lights, by their id, whose light is no plain one: of a projector, or with a cookie or photometry."""
    found: dict[int, PunctualLight] = {}
    for light in lights:
        for one in () if light.target is None else light.target.iter():
            if isinstance(one, tuple(GFX_KINDS)) and id(one) not in found:
                made = _of(one, light, 0.0, 1.0)
                if made.cookie is not None or made.photometry is not None or len(made.planes()):
                    found[id(one)] = made
    return found


def _unit(v: Any) -> Triple:
    """Normalises a vector; (0, 0, 1) of nothing."""
    return triple(unit(v)) if np.any(v) else (0.0, 0.0, 1.0)


def _shines(light: Any) -> bool:
    return all(thing.visible for thing in _upwards(light))


def _upwards(thing: Any) -> Iterator[Any]:
    while thing is not None:
        yield thing
        thing = thing.parent


def _own(light: SceneLight) -> Any:
    """Gathers what a light has to itself of a medium, as keywords of a PunctualLight."""
    return {name: getattr(light, name) for name in ("strength", "anisotropy", "density", "extinction", "cookie")} | _shape(light)


def _shape(light: SceneLight, gfx_light: Any = None) -> Any:
    """Gathers photometry and axes of a light, as keywords of a PunctualLight; gfx_light: in whose axes it is turned."""
    photometry, turned = light.distribution(), light.turned
    if photometry is not None and (light.direction is not None or isinstance(gfx_light, gfx.DirectionalLight | Projector)):
        kind = "projector" if isinstance(gfx_light, Projector) else "sun"
        raise AirlightError(f"photometry is for point and spot lights: a {kind} has none; leave it out")
    if turned is not None and gfx_light is not None:
        turned = np.asarray(turned, float) @ _axes_of(gfx_light).T
    return {"photometry": photometry, "turned": turned}


def _axes_of(gfx_light: Any) -> Any:
    """Finds (3, 3) the axes of a gfx light, columns, right, up and back. One with a target pygfx itself turns to that as it draws, so that
    before it did they are not in its matrix."""
    if isinstance(gfx_light, gfx.DirectionalLight | gfx.SpotLight):
        right, up, ahead = axes_along(_unit(beam(gfx_light)), gfx_light.world.reference_up)
        return np.column_stack([right, up, -ahead])
    axes = np.asarray(gfx_light.world.matrix, float)[:3, :3]
    return axes / np.maximum(np.linalg.norm(axes, axis=0), 1e-30)


def _placed(light: SceneLight, near: float, pre_exposure: float) -> PunctualLight:
    """Makes a light that pygfx does not know."""
    intensity = pre_exposure * (1.0 if light.intensity is None else light.intensity)
    position, color = light.homogeneous(), triple(np.multiply(light.color, intensity))
    own = _own(light)
    if position[3] == 0:
        return DirectionalLight(color, _unit(position[:3]), **own)
    return PointLight(color, triple(position[:3]), near=near, **own)


def _directional(gfx_light: Any, intensity: Triple, near: float, own: Any) -> PunctualLight:
    return DirectionalLight(intensity, _unit(np.negative(_unit(beam(gfx_light)))), **own)


def _point(gfx_light: Any, intensity: Triple, near: float, own: Any) -> PunctualLight:
    position = triple(np.asarray(gfx_light.world.position, float))
    return PointLight(intensity, position, range=float(gfx_light.distance), near=near, **own)


def _spot(gfx_light: Any, intensity: Triple, near: float, own: Any) -> PunctualLight:
    position, outer = triple(np.asarray(gfx_light.world.position, float)), min(float(gfx_light.angle), math.pi / 2)
    inner = outer * (1 - float(gfx_light.penumbra))
    reach = float(gfx_light.distance)
    return SpotLight(intensity, position, _unit(beam(gfx_light)), inner=inner, outer=outer, range=reach, near=near, **own)


def _projector(gfx_light: Any, intensity: Triple, near: float, own: Any) -> PunctualLight:
    position, direction = triple(np.asarray(gfx_light.world.position, float)), _unit(beam(gfx_light))
    upwards = np.asarray(gfx_light.upwards, float)
    if not np.array_equal(upwards, UP) and np.linalg.norm(np.cross(direction, unit(upwards))) <= 1e-6:
        raise AirlightError(f"a projector's up, {', '.join(f'{v:g}' for v in upwards)}, lies along its light; give another direction")
    _, up, _ = axes_along(direction, upwards)
    across, along = (math.radians(v) for v in gfx_light.fov)
    known = {"falloff": gfx_light.falloff, "ambient": gfx_light.ambient, "clip": gfx_light.clip, "range": float(gfx_light.distance)}
    own = {**own, "cookie": own.get("cookie") or gfx_light.cookie}
    near, far = gfx_light.near, gfx_light.far or 0.0
    return ProjectorLight(intensity, position, direction, triple(up), fov=(across, along), near=near, far=far, **known, **own)


GFX_KINDS: dict[type, Callable[[Any, Triple, float, Any], PunctualLight]] = {
    Projector: _projector,  # before the spot that it is for pygfx
    gfx.DirectionalLight: _directional,
    gfx.SpotLight: _spot,
    gfx.PointLight: _point,
}


def _of(gfx_light: Any, light: SceneLight, near: float, pre_exposure: float) -> PunctualLight:
    """Makes the light of a gfx light, tinted by its SceneLight."""
    own = gfx_light.intensity if light.intensity is None else light.intensity * pre_exposure
    power = np.array(gfx_light.color.to_physical()[:3]) * own
    intensity = triple(np.maximum(power, 0) * light.color)
    make = next(make for kind, make in GFX_KINDS.items() if isinstance(gfx_light, kind))
    return make(gfx_light, intensity, near, _own(light) | _shape(light, gfx_light))
