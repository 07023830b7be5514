"""The lights of scenes as lamps of their medium, and the units of pygfx's surfaces."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltfs import TRIANGLE, Writer

from airlight.errors import AirlightError
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight

gfx = pytest.importorskip("pygfx")
from airlight.pygfx import SceneLight  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402


def test_a_sun_is_its_gfx_light() -> None:
    light = gfx.DirectionalLight(color=gfx.Color.from_physical(1.0, 0.5, 0.25), intensity=4)
    light.local.position, light.target.local.position = (0, 3, 4), (0, 0, 0)
    (sun,) = punctual_lights([SceneLight(light, color=(1, 1, 0.5), strength=2, screen_tint=(0.1, 0.1, 0.1), anisotropy=0.7)])
    assert (sun.kind, sun.strength, sun.anisotropy) == ("directional", 2, 0.7)
    assert sun.intensity == pytest.approx((4, 2, 0.5), rel=1e-5) and sun.direction == pytest.approx((0, 0.6, 0.8))


def test_a_spot_is_its_gfx_light_wherever_it_hangs() -> None:
    light = gfx.SpotLight(intensity=10, decay=2, distance=7, angle=0.6, penumbra=0.25)
    light.local.position, light.target.local.position = (1, 2, 3), (1, 0, 3)
    (spot,) = punctual_lights([SceneLight(light)])
    assert spot.direction == (0, -1, 0) and spot.position == (1, 2, 3) and spot.range == 7
    assert (spot.outer, spot.inner) == pytest.approx((0.6, 0.45)) and spot.intensity == pytest.approx((10, 10, 10))
    camera = gfx.PerspectiveCamera(50)
    camera.local.position = (5, 0, 0)
    camera.look_at((0, 0, 0))
    light.local.position = (0, 0, 0)
    camera.add(light)
    (spot,) = punctual_lights([SceneLight(light)])
    assert spot.position == pytest.approx((5, 0, 0)) and spot.direction == pytest.approx((-1, 0, 0), abs=1e-6)


@pytest.mark.parametrize("kind", [gfx.DirectionalLight, gfx.SpotLight])
@pytest.mark.parametrize("place", [(0, 0, 0), (3, 1, 0), (0, 0, -1), (0.5, 0, -4)])
@pytest.mark.parametrize("hangs", [False, True])
def test_shafts_and_medium_have_the_way_in_which_a_surface_is_lit(kind: Any, place: tuple[float, ...], hangs: bool) -> None:
    light, camera = kind(intensity=2), gfx.PerspectiveCamera(50)
    camera.local.position, camera.local.scale = (5, 2, 1), (2, 2, 2)
    camera.look_at((0, 0, 0))
    light.target.local.position = (0, 0, -1)
    (camera if hangs else gfx.Scene()).add(light)
    light.local.position = place
    (lamp,) = punctual_lights([SceneLight(light)])
    towards = SceneLight(light).homogeneous()
    light._gfx_update_uniform_buffer()
    shines = light.uniform_buffer.data["direction"][:3]
    if kind is gfx.SpotLight:
        assert lamp.direction == pytest.approx(shines, abs=1e-6) and towards == pytest.approx([*light.world.position, 1])
    else:
        assert np.negative(lamp.direction) == pytest.approx(shines, abs=1e-6)
        assert towards[:3] / np.linalg.norm(towards[:3]) == pytest.approx(-shines, abs=1e-6) and towards[3] == 0


def test_a_body_has_the_lights_below_it_each_once() -> None:
    ball, group, glow = gfx.Mesh(gfx.sphere_geometry(0.2), gfx.MeshBasicMaterial()), gfx.Group(), gfx.PointLight(intensity=3, decay=2)
    ball.local.position, group.local.position = (0, 1, 0), (0.5, 0, 0)
    ball.add(group)
    group.add(glow)
    found = punctual_lights([SceneLight(ball), SceneLight(glow)])
    assert [(lamp.kind, lamp.position) for lamp in found] == [("point", (0.5, 1, 0))]
    assert found[0].near == pytest.approx(0.21, abs=0.002) and found[0].intensity == pytest.approx((3, 3, 3))
    group.visible = False  # a renderer leaves it out too
    assert punctual_lights([SceneLight(ball)]) == []


def test_places_and_directions_alone_are_candela_and_lux() -> None:
    at, sun, dark = (
        SceneLight(position=(1, 2, 3), color=(1, 0.5, 0), strength=2),
        SceneLight(direction=(0, 2, 0)),
        SceneLight(direction=(0, 1, 0), strength=0),
    )
    assert punctual_lights([at, sun, dark]) == [
        PointLight((1, 0.5, 0), position=(1, 2, 3), strength=2),
        DirectionalLight((1, 1, 1), direction=(0, 1, 0)),
    ]


@pytest.mark.parametrize("bad", [{"anisotropy": 1.0}, {"anisotropy": math.nan}, {"screen_tint": (-1, 0, 0)}])
def test_bad_lights_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(AirlightError):
        SceneLight(position=(0, 0, 0), **bad)


def test_scenes_name_the_lights_that_shine_on_their_surfaces(tmp_path: Path) -> None:
    """Every gfx light of a scene, but the ambient ones, in its own units."""
    w = Writer()
    w.node(mesh=w.mesh(np.array(TRIANGLE)))
    bare = w.save(tmp_path)
    v = Writer()
    v.node(mesh=v.mesh(np.array(TRIANGLE)))
    v.node(extensions=v.light(type="spot", color=[0.5, 1, 0], intensity=30, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.4}))
    v.node(extensions=v.light(type="directional", intensity=3))
    (tmp_path / "lit").mkdir()
    for name in ("table", "flying", bare, v.save(tmp_path / "lit")):
        stage = open_scene(name)
        shining = [thing for thing in stage.scene.iter() if isinstance(thing, (gfx.DirectionalLight, gfx.PointLight, gfx.SpotLight))]
        expected = [tuple(np.array(one.color.to_physical()[:3]) * one.intensity) for one in shining]
        found = punctual_lights(stage.lights)
        assert len(found) == len(shining) > 0
        np.testing.assert_allclose(sorted(lamp.intensity for lamp in found), sorted(expected), rtol=1e-6)
        assert all(lamp.strength == 1 for lamp in found)
