"""Cookies by the names of lights, and projectors, as commands take them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airlight.errors import AirlightError
from airlight.jobs.shape_text import put_cookies, read_shape_text, shaped

gfx = pytest.importorskip("pygfx")
from PIL import Image  # noqa: E402

from airlight.pygfx import SceneLight  # noqa: E402
from airlight.pygfx.projector import Projector  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402


@pytest.fixture
def slide(tmp_path: Path) -> str:
    Image.fromarray(np.arange(60, dtype=np.uint8).reshape(4, 5, 3)).save(tmp_path / "slide.png")
    return str(tmp_path / "slide.png")


def named(stage: Any, lamp: Any, name: str) -> Any:
    lamp.name = name
    stage.scene.add(lamp)
    light = SceneLight(lamp)
    stage.lights.append(light)
    return light


def test_cookies_go_to_the_lights_of_their_names(slide: str) -> None:
    stage = open_scene("slats")
    kinds = {"sun": gfx.DirectionalLight, "lamp": gfx.SpotLight, "bulb": gfx.PointLight}
    sun, spot, point = (named(stage, kind(), name) for name, kind in kinds.items())
    put_cookies(stage, [f"sun={slide};size=2.5", f"lamp={slide}"])
    assert sun.cookie.size == 2.5 and sun.cookie.pixels.shape == (4, 5, 3) and spot.cookie is not None and point.cookie is None
    for text, told in (
        (f"bulb={slide}", "--cookie bulb: shines all around; name a spot, a projector or a sun"),
        (f"lamp={slide};size=2", "is no sun, whose cookies alone have a size"),
        (f"lmp={slide}", "has no light of that name.*did you mean 'lamp'"),
        ("lamp=none.png", "none.png"),
    ):
        with pytest.raises(AirlightError, match=told):
            put_cookies(stage, [text])


def test_projectors_come_beside_the_lights_of_a_scene(slide: str) -> None:
    from airlight.scenes.lamps import lighting

    stage = open_scene("slats")
    requested = shaped(stage, {"projector": [f"1,2,3;target=0,1,0;cookie={slide}"]})
    made = lighting(stage, requested)
    assert isinstance(requested[0], Projector) and requested[0].cookie is not None
    assert [light.target for light in made.lights] == [stage.lights[0].target, requested[0]]


def test_what_shapes_a_light_is_read_without_its_file() -> None:
    from airlight.jobs.shape_text import COOKIE

    assert read_shape_text("a light=a=b.png;size=3", COOKIE).path == "a=b.png"
    with pytest.raises(AirlightError, match="write NAME=FILE"):
        read_shape_text("gobo.png", COOKIE)
    with pytest.raises(AirlightError, match="size is 0"):
        read_shape_text("sun=gobo.png;size=0", COOKIE)


def test_lights_and_suns_of_texts_take_cookies(slide: str) -> None:
    from airlight.jobs.light_text import PLACE, SUN, read_scene_light
    from airlight.scenes.lamps import lighting

    sun = read_scene_light(f"60,30;cookie={slide};size=2.5;strength=3", SUN)
    assert sun.cookie is not None and (sun.cookie.size, sun.cookie.pixels.shape, sun.strength) == (2.5, (4, 5, 3), 3)
    stage = open_scene("slats")  # its light is a spot
    spot = named(stage, gfx.SpotLight(), "lamp")
    by_place, by_name = (read_scene_light(f"{place};cookie={slide}", PLACE) for place in ("0,2,0", "lamp"))
    made = lighting(stage, [by_place, by_name, sun]).lights
    assert [light.cookie for light in made] == [by_place.cookie, by_name.cookie, sun.cookie] and made[1].target is spot.target
    stage.lights = []
    with pytest.raises(AirlightError, match="a light that shines all around; give --light the name of a spot"):
        lighting(stage, [by_place])


@pytest.mark.parametrize(
    ("text", "form", "told"),
    [
        ("60,30;size=2", "azimuth,elevation", "goes with cookie.*write cookie=FILE;size=2"),
        ("60,30;cookie=a.png;size=0", "azimuth,elevation", "size is 0.001 to 1e.06 m"),
        ("60,30;ies=a.ies", "azimuth,elevation", "cannot read 'ies=a.ies'"),
        ("lamp;size=2;cookie=a.png", "x,y,z", "cannot read 'size=2'"),
        ("lamp;cookie=a.png;ies=a.ies", "x,y,z", "has two shapes"),
    ],
)
def test_what_shapes_of_lights_texts_cannot_be_is_told(text: str, form: str, told: str) -> None:
    from airlight.jobs.light_text import light_numbers

    with pytest.raises(AirlightError, match=told):
        light_numbers(text, form)
