"""The lights of a scene as those that shine on its medium."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.lamps import Lamp, Triple, triple
from airlight.pygfx.lights import BODY, SceneLight, beam

KINDS = (gfx.DirectionalLight, gfx.SpotLight, gfx.PointLight)


def lamps(lights: Sequence[SceneLight]) -> list[Lamp]:
    """What shines on the medium: each visible gfx light that is the target of one of `lights`, or below it, once; what is given by a
    position or direction alone, or by a target without gfx lights, as color times strength, in candela or lux. Dark ones are left out.

    A gfx light's intensity is what its surfaces take it for, lux of a sun, else candela: its decay has to be 2, pygfx's default is 0.
    Raises AirlightError for what a light cannot be.
    """
    found: list[Lamp] = []
    taken: set[int] = set()
    for light in lights:
        light.check()
        own = [] if light.target is None else [thing for thing in light.target.iter() if isinstance(thing, KINDS)]
        body = light.body()
        near = 0.0 if body is None else BODY * body[1]
        if not own:
            found.append(_placed(light, near))
        for one in own:
            if id(one) not in taken and _shines(one):
                taken.add(id(one))
                found.append(_of(one, light, near))
    placed = [lamp for lamp in found if np.isfinite([*lamp.position, *lamp.direction]).all()]
    return [lamp for lamp in placed if lamp.strength * max(lamp.intensity) > 0]


def _unit(v: Any) -> Triple:
    """(0, 0, 1) of nothing."""
    length = float(np.linalg.norm(v))
    return triple(np.asarray(v, float) / length) if length > 0 else (0.0, 0.0, 1.0)


def _shines(light: Any) -> bool:
    return all(thing.visible for thing in _upwards(light))


def _upwards(thing: Any) -> Iterator[Any]:
    while thing is not None:
        yield thing
        thing = thing.parent


def _placed(light: SceneLight, near: float) -> Lamp:
    """A light that pygfx does not know."""
    place, color = light.place(), triple(light.color)
    if place[3] == 0:
        return Lamp("sun", color, direction=_unit(place[:3]), strength=light.strength, anisotropy=light.anisotropy)
    return Lamp("point", color, position=triple(place[:3]), strength=light.strength, anisotropy=light.anisotropy, near=near)


def _of(gfx_light: Any, light: SceneLight, near: float) -> Lamp:
    power = np.array(gfx_light.color.to_physical()[:3]) * gfx_light.intensity
    intensity = triple(np.maximum(power, 0) * light.color)
    at = np.asarray(gfx_light.world.position, float)
    if isinstance(gfx_light, gfx.PointLight):
        reach = float(gfx_light.distance)
        return Lamp("point", intensity, triple(at), range=reach, strength=light.strength, anisotropy=light.anisotropy, near=near)
    direction = _unit(beam(gfx_light))
    if isinstance(gfx_light, gfx.DirectionalLight):
        return Lamp("sun", intensity, direction=_unit(np.negative(direction)), strength=light.strength, anisotropy=light.anisotropy)
    outer = min(float(gfx_light.angle), math.pi / 2)
    return Lamp(
        "spot",
        intensity,
        triple(at),
        direction,
        inner=outer * (1 - float(gfx_light.penumbra)),
        outer=outer,
        range=float(gfx_light.distance),
        strength=light.strength,
        anisotropy=light.anisotropy,
        near=near,
    )
