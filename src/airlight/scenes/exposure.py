"""Exposes scenes with physical lights: how bright their pictures are, and their own radiances scaled so that half floats hold them.

Lights of 100 lux, of 1,000 candela and more are physical, those that a user gives in units, and all that shines with 100 and more. Files
with weaker lights are exposed where they would be burned otherwise. What is of order 1 beside them, as unlit colours, and the background
and fill light that a file without surroundings is given, stands for what a display shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_decode, srgb_encode
from airlight.scenes.stage import Stage

PHYSICAL_LUX, PHYSICAL_CANDELA, PHYSICAL_RADIANCE = 100.0, 1000.0, 100.0  # from which lights, and what shines, are physical
DOUBTED, BURNED = 0.1, -2.0  # share of these from which lights of a file are metered; stops from which such a file needs exposure
METERED_WIDTH, METERED_TIMES = 160, 4  # pixels; times of an animation
PASSES, NEAR_STOPS = 4, 6.0  # at most; each begins with what the last has found, until that is so near
BRIGHT_HALF = (0.5, 0.98)  # between these shares of all pixels by luminance their logarithms are averaged
KEY, HIGHLIGHT = 0.27, 2.0  # what that average becomes; what the upper share's luminance becomes at most
DARK = 2.0**-10  # of the brightest: what is darker is not metered
LEAST = 1e-7  # luminance as it is drawn, below which there is no light
HIGHLIGHT_STOPS = 1.5  # at most, by which highlights outdoors darken a picture: of a glint on water nobody sees more than that it is bright
SKY_PART = (0.1, 0.9)  # between these shares of the sky's pixels by luminance their logarithms are averaged: without disc, and its glow
SKY_KEY, SKY_MOST = 0.7, 1.2  # what that average is wanted to be, and is at most
SPAN_TIMES, BURNED_SPAN = 5, 0.5  # of a sun that moves: times that are metered, and stops by which each may be brighter than by itself
HALF_MOST = 65504.0
STOPS = (-40.0, 8.0)
FAR_STOPS = 3.0  # between the exposure and what radiances are scaled by, where a sun moves


@dataclass(frozen=True)
class Exposure:
    """Says how a stage is exposed.

    automatic: stops; None: its lights are not physical. pre: factor that its radiances are given, a power of 2.
    """

    automatic: float | None = None
    pre: float = 1.0

    @property
    def ev(self) -> float:
        """Give the stops where none are asked for."""
        return self.automatic or 0.0

    def line(self) -> str:
        """Say what was chosen."""
        return f"exposure {self.ev:+.2f} EV, automatic for lights in lux and candela; --ev N sets it"


def strengths(scene: gfx.Scene) -> tuple[float, float]:
    """Find the greatest lux of a scene's suns and candela of its lamps, as they are scaled."""
    suns, lamps = [0.0], [0.0]
    for thing in scene.iter(skip_invisible=True):
        if isinstance(thing, gfx.DirectionalLight | gfx.PointLight | gfx.SpotLight):
            (suns if isinstance(thing, gfx.DirectionalLight) else lamps).append(thing.intensity * max(thing.color.to_physical()[:3]))
    return max(suns), max(lamps)


def is_physical(scene: gfx.Scene) -> bool:
    """Tell whether a scene, not scaled yet, has a physical light."""
    sun, lamp = strengths(scene)
    return sun >= PHYSICAL_LUX or lamp >= PHYSICAL_CANDELA


def may_need(stage: Stage) -> bool:
    """Tell whether a stage, not scaled yet, may have an automatic exposure."""
    if stage.measured or is_physical(stage.scene):
        return True
    sun, lamp = strengths(stage.scene)
    return stage.photometric and (sun >= DOUBTED * PHYSICAL_LUX or lamp >= DOUBTED * PHYSICAL_CANDELA)


Seen = Callable[[float, float], tuple[np.ndarray, np.ndarray]]


def meter(stage: Stage, seen: Seen) -> Exposure:
    """Find the automatic exposure of a stage, whose radiances are left scaled by its `pre`.

    seen: luminances of a small picture at a time (s), with the light in the air, for a pre-exposure: scaled by it; and which of its pixels
    show something that is drawn, and no sky. They are taken at fixed times of the whole animation, so that any frames of it have one
    exposure; and by two pre-exposures, so that what does not scale, being for a display, is known, and left out.
    """
    expose(stage, 1.0)
    if not may_need(stage):
        return Exposure()
    is_sure = stage.measured or is_physical(stage.scene)
    sun, lamp = strengths(stage.scene)
    times = [stage.duration * k / METERED_TIMES for k in range(METERED_TIMES if stage.duration else 1)]
    if stage.daylight is not None and stage.daylight.span is not None:  # from halfway of which the exposure follows the sky
        times = [sum(stage.daylight.span) / 2]
    stops = round(-math.log2(max(sun, lamp / max(stage.radius, 0.1) ** 2, 1.0)))
    ev = float(stops)
    for _ in range(PASSES):
        light, lacks = _wanted(stage, seen, times, stops)
        ev = round(min(max(stops + lacks, STOPS[0]), STOPS[1]), 2)
        if abs(ev - stops) < NEAR_STOPS:
            break
        stops = round(ev)
    if not is_sure and (ev > BURNED or not light.max() > 0):
        expose(stage, 1.0)
        return Exposure()
    if stage.daylight is not None and stage.daylight.span is not None:
        ev = _not_burned(stage, seen, ev)
    expose(stage, 2.0 ** round(ev))
    return Exposure(ev, stage.pre_exposure)


def _wanted(stage: Stage, seen: Seen, times: Sequence[float], stops: int) -> tuple[np.ndarray, float]:
    """Measure luminances at some times, as these stops show them, and the stops by which they lack exposure."""
    found = []
    drawn = np.zeros(0, bool)
    for part in (1.0, 0.25):
        pre = part * 2.0**stops
        expose(stage, pre)
        pictures = [seen(time, pre) for time in times]
        luminance = np.concatenate([one.ravel() for one, _ in pictures]).astype(np.float64)
        drawn = np.concatenate([one.ravel() for _, one in pictures])
        found.append(np.nan_to_num(luminance, nan=0.0, posinf=HALF_MOST).clip(0, HALF_MOST))
    light = (found[0] - found[1]) / 0.75
    return light, lacking(light) if stage.daylight is None else lacking_outdoors(light, drawn)


def _not_burned(stage: Stage, seen: Seen, ev: float) -> float:
    """Lower the stops halfway of the track of a stage's sun, where at other times of it, followed, they would burn the picture."""
    daylight = stage.daylight
    first, last = daylight.span
    for time in np.linspace(first, last, SPAN_TIMES):
        daylight.move(stage, float(time), background=False)
        follows = daylight.stops()
        stops = round(min(max(ev + follows, STOPS[0]), STOPS[1]))
        light, lacks = _wanted(stage, seen, [float(time)], stops)
        if light.max() > 0:
            ev = min(ev, stops + lacks - follows + BURNED_SPAN)
    return round(max(ev, STOPS[0]), 2)


def lacking_outdoors(luminance: np.ndarray, drawn: np.ndarray) -> float:
    """Compute the stops by which a picture in daylight lacks exposure: what the ground lacks and what the sky lacks, each as the root of
    the picture that it takes, but no more than leaves the sky its colour. drawn: which of its pixels are not sky.

    Neither is led by the sun's disc or its glint on water, however bright they are. Of the ground it is what `lacking` gives, of shadows
    too, and highlights darken it by HIGHLIGHT_STOPS at most; of the sky the logarithms of its middle part are averaged, for SKY_KEY.
    """
    ground, sky = luminance[drawn & (luminance > LEAST)], luminance[~drawn & (luminance > LEAST)]
    lacks = []
    if ground.size:
        average, highlights = _average_and_highlights(ground)
        lacks.append((max(min(average, highlights), average - HIGHLIGHT_STOPS), math.sqrt(ground.size)))
    if sky.size:
        low, high = np.quantile(sky, SKY_PART)
        average = float(np.log2(sky[(sky >= low) & (sky <= high)]).mean())
        wanted = math.log2(SKY_KEY) - average
        lacks.append((min([wanted, *(stops for stops, _ in lacks)]), math.sqrt(sky.size)))  # a sky that is darker than the ground stays so
    if not lacks:
        return 0.0
    found = sum(stops * weight for stops, weight in lacks) / sum(weight for _, weight in lacks)
    return min(found, math.log2(SKY_MOST) - average) if sky.size else found


def lacking(luminance: np.ndarray) -> float:
    """Compute the stops by which a picture of these luminances lacks exposure, of what is not dark beside the brightest of it.

    The logarithms of the brighter half's luminances, but for the brightest 2 %, are averaged, and the average put at KEY; less bright where
    that would put more than these 2 % beyond HIGHLIGHT.
    """
    y = luminance[luminance > max(DARK * float(np.quantile(luminance, 0.999)), LEAST)]
    return min(_average_and_highlights(y)) if y.size else 0.0


def _average_and_highlights(y: np.ndarray) -> tuple[float, float]:
    """Compute the stops that the average of the brighter half lacks of KEY, and those that its upper end lacks of HIGHLIGHT."""
    low, high = np.quantile(y, BRIGHT_HALF)
    average = float(np.log2(y[(y >= low) & (y <= high)]).mean())
    return math.log2(KEY) - average, math.log2(HIGHLIGHT / high)


# ---------------------------------------------------------------- scaling a scene

_SKIES: WeakKeyDictionary[Any, tuple[Any, float]] = WeakKeyDictionary()  # of skybox materials: the map at first, the factor of that it has
_EMISSION: WeakKeyDictionary[Any, float] = WeakKeyDictionary()  # of materials: their emissive intensity at first


def expose(stage: Stage, pre: float) -> None:
    """Scale a stage's own radiances by a factor, a power of 2, that stands instead of the last one.

    Its sky is scaled in proportion to its sun: by what makes the sky's own sun as bright as that, where that is physical.
    """
    factor = pre / stage.pre_exposure
    if pre == stage.pre_exposure == 1.0 and not (stage.measured or is_physical(stage.scene)):
        return
    sun = strengths(stage.scene)[0] / stage.pre_exposure
    stage.pre_exposure = pre
    sky = pre * sun / stage.sky_sun if stage.sky_sun and sun >= PHYSICAL_LUX else 1.0
    materials = {}
    for thing in stage.scene.iter():
        if isinstance(thing, gfx.DirectionalLight | gfx.PointLight | gfx.SpotLight):
            thing.intensity *= factor
        material = getattr(thing, "material", None)
        if material is not None:
            materials[id(material)] = material
    for material in materials.values():
        if isinstance(material, gfx.MeshStandardMaterial):
            if stage.daylight is None:
                material.env_map_intensity = sky
            intensity = _EMISSION.setdefault(material, float(material.emissive_intensity))
            physical = max(material.emissive.to_physical()[:3]) * intensity >= PHYSICAL_RADIANCE
            material.emissive_intensity = intensity * pre if physical else intensity
        elif isinstance(material, gfx.BackgroundSkyboxMaterial) and stage.daylight is None:
            _scale_sky(material, sky)


def _scale_sky(material: Any, factor: float) -> None:
    """Make the map of a skybox anew, so many times as bright as its first."""
    first, now = _SKIES.get(material, (material.map, 1.0))
    if factor == now:
        return
    texture = getattr(first, "texture", first)
    codes = texture.data.astype(np.float32)
    codes[..., :3] = srgb_encode(np.minimum(srgb_decode(codes[..., :3]) * np.float32(factor), np.float32(HALF_MOST)).astype(np.float32))
    material.map = gfx.Texture(codes.astype(np.float16), dim=2, size=texture.size, generate_mipmaps=True)
    _SKIES[material] = first, factor
