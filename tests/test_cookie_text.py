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
