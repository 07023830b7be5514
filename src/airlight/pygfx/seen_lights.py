"""Divides the lights of a medium, for method auto, between the picture, which shows what hides a light that is seen, and the march."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import project
from airlight.pygfx.lights import BODY, SceneLight
from airlight.scatter.march.cookies import shape_of
from airlight.scatter.methods import FOR_MEDIUM
from airlight.scatter.screen_shadows.screen_shadows import MOST_BODIES, SeenLight

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

FALL, LEAST = 4, 1 / 64  # how much faster a light is left to the march than shafts fade beyond the view, and the last of it


def share_of(fade: float) -> float:
    """Gives the share of a light, 0..1, that is summed on the picture, of its fade: 1 in the view. It falls faster than that, since beyond
    the border more and more of what hides the light is not seen."""
    return max(float(fade) ** FALL - LEAST, 0.0) / (1 - LEAST)


def refusal(light: PunctualLight, medium: ResolvedMedium) -> str | None:
    """Words why a light is not summed on the picture, to follow "lights are summed on the picture "; None: it is."""
    if medium.varies:
        return "in even air and in fog by height"
    if shape_of(light) != "none" or len(light.planes()) or light.falloff_terms() != (1.0, 0.0, 0.0):
        return "without cookies, photometry and projectors"
    if light.own_medium(medium) is not medium:
        return "without a density or extinction of their own"
    return None


def refusal_of_scene(shafts: "LightShafts", medium: ResolvedMedium, glass: bool) -> str | None:
    """Words why no light of a scene is, likewise. glass: something is seen through."""
    if medium.exact:
        return "where the medium's are not asked for exactly"
    if shafts.camera.projection_matrix[3, 3] != 0:
        return "of cameras with perspective"
    if medium.march.shadow_filter in ("soft", "variance") or medium.march.soften:
        return "without soft shadows"
    if glass or shafts.panes.held:
        return "where nothing is seen through"
    if shafts.daylight is not None:
        return "without daylight"
    if shafts.exclude:
        return "where all that is seen hides light: without exclude"
    return None


def divide_lights(
    shafts: "LightShafts", lights: Sequence[PunctualLight], medium: ResolvedMedium, view: Any, projection: Any, glass: bool
) -> tuple[list[SeenLight], list[PunctualLight], str | None]:
    """Gives the lights that are summed on the picture, what is left of all for the march, and a line where one is refused that is seen.

    A light in the view is the picture's, beyond it less and less, as it fades there; what it lacks is the march's.
    """
    seen: list[SeenLight] = []
    left: list[PunctualLight] = []
    why: str | None = None
    of_scene, bodies = refusal_of_scene(shafts, medium, glass), _bodies(shafts.lights)
    if len(bodies) > MOST_BODIES:
        of_scene = of_scene or f"with up to {MOST_BODIES} bodies of light"
    eye = np.linalg.inv(view)[:3, 3]
    for light in lights:
        share = share_of(project(_homogeneous(light), view, projection).fade) if light.fade(eye, medium) > 0 else 0.0
        refused = (of_scene or refusal(light, medium)) if share > 0 else None
        if share == 0 or refused is not None:
            why = why or refused
            left.append(light)
            continue
        seen.append(SeenLight(light, share, bodies))
        if share < 1:
            left.append(replace(light, strength=light.strength * (1 - share)))
    line = None if why is None else f"method auto: lights are summed on the picture {why}; here they go by {FOR_MEDIUM} alone"
    return seen, left, line


def _homogeneous(light: PunctualLight) -> np.ndarray:
    """Gives (4,) the light's position, world, or the direction towards it."""
    return np.append(light.in_view(np.eye(4)), 0.0 if light.directional else 1.0)


def _bodies(lights: Sequence[SceneLight]) -> np.ndarray:
    """Bounds (N, 4) bodies of light by spheres, as those do that cast no shadow: centre, world, and radius."""
    found = [body for light in lights if (body := light.body()) is not None]
    return np.array([[*centre, BODY * radius] for centre, radius, _ in found]).reshape(-1, 4)
