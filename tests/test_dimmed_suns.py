"""Fog that a sun's light does not get through is told, with a depth by which it does; in programs too."""

import math
import re
import warnings
from typing import Any

import numpy as np
import pygfx as gfx
import pytest
from rendercanvas.offscreen import OffscreenRenderCanvas

from airlight.errors import AirlightWarning
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.pygfx import LightShafts, SceneLight
from airlight.pygfx.dimmed_suns import doubt_of_suns, lit_share

LOW = DirectionalLight((1.0, 1.0, 1.0), (math.cos(math.radians(6)), math.sin(math.radians(6)), 0.0))
HIGH = DirectionalLight((1.0, 1.0, 1.0), (0.0, 1.0, 0.0))


def resolved(**keywords: Any) -> Any:
    return resolve(Medium(**{"sigma_t": 0.06, "fog": "exponential", "fog_depth": 40.0, **keywords}), March(), "normal", 200.0)


def said(*lights: Any, **keywords: Any) -> str | None:
    camera = gfx.PerspectiveCamera(50, depth_range=(0.1, 500))
    camera.local.position = (0, 5, 0)
    return doubt_of_suns(resolved(**keywords), lights, camera.view_matrix, camera.projection_matrix)


@pytest.mark.parametrize("fog", ["exponential", "linear"])
def test_a_low_sun_is_lost_in_high_fog_and_the_cures_are_cures(fog: str) -> None:
    line = said(LOW, fog=fog) or ""
    found = re.search(r"a fog_depth of about (\d+) m lets more of it through, or all with sun_extinction none$", line)
    assert line.startswith("the fog is dark: ") and found is not None
    assert said(LOW, fog=fog, fog_depth=float(found[1])) is None
    assert said(LOW, fog=fog, sun_extinction="none") is None
    assert said(LOW, fog=fog, fog_depth=4 * float(found[1])) is not None  # it is not far off


def test_what_lights_the_fog_leaves_no_doubt() -> None:
    lamp = PointLight((9.0, 9.0, 9.0), (0.0, 5.0, -5.0))
    assert said(LOW) and said(LOW, PointLight((0.0, 0.0, 0.0), (0.0, 5.0, -5.0)))
    assert said(LOW, HIGH) is said(HIGH) is said(LOW, lamp) is said(LOW, ambient=(0.1, 0.1, 0.1)) is said() is None
    assert said(LOW, sigma_t=(0.06, 0.06, 0.001)) is None  # blue gets through
    assert said(LOW, sigma_t=1e-6) is None and said(LOW, air=0.0) is None  # there is nothing that would show it
    assert "all of it does with sun_extinction none" in (said(LOW, fog_base=100.0) or "")  # no depth would do


def test_the_share_is_that_of_the_closed_form() -> None:
    """Along a level ray all is dimmed as at the eye; along a ray to the sun by 1 / whole optical depth less."""
    medium = resolved(fog_depth=5.0, max_distance=2000.0)
    start, level, climb = np.array([[0.0, 2.0, 0.0]]), np.array([[0.0, 0.0, -1.0]]), LOW.direction[1]
    column = 0.06 * 5 * math.exp(-2 / 5)
    lit, seen = lit_share(medium, [LOW], start, level)
    assert lit == pytest.approx(math.exp(-column / climb), rel=1e-6) and seen == pytest.approx(1, rel=0.01)
    lit, seen = lit_share(medium, [LOW, HIGH], start, np.array([LOW.direction]))
    assert seen == pytest.approx(1 - math.exp(-column / climb), rel=0.01)
    away = np.array([[-LOW.direction[0], climb, 0.0]])  # as steep: what is dimmed to the sun and to the eye add up to twice the one
    lit, _ = lit_share(medium, [LOW], start, away)
    depth = column / climb
    assert lit == pytest.approx(depth * math.exp(-depth) / (1 - math.exp(-depth)), rel=0.01)


def test_a_program_is_told_once() -> None:
    canvas = OffscreenRenderCanvas(size=(32, 24), pixel_ratio=1)
    renderer, scene, camera = gfx.WgpuRenderer(canvas), gfx.Scene(), gfx.PerspectiveCamera(50, depth_range=(0.1, 500))
    scene.add(gfx.Mesh(gfx.box_geometry(30, 4, 30), gfx.MeshBasicMaterial()))
    camera.local.position = (0, 5, 30)
    medium = Medium(sigma_t=0.06, fog="exponential", fog_depth=40.0)
    shafts = LightShafts(renderer, scene, camera, [SceneLight(direction=LOW.direction)], medium=medium)
    renderer.effect_passes = [shafts]
    canvas.request_draw(lambda: renderer.render(scene, camera))
    with pytest.warns(AirlightWarning, match="the fog is dark") as told:
        canvas.draw()
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        canvas.draw()
