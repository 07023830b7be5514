"""Settings, and commands that repeat what is shown."""

import shlex
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as some
from viewer_driver import CLASSIC, SCENE_SIZE, Driver, read_by_render, some_values

from airlight.cli import image as image_command
from airlight.cli.options import gather
from airlight.errors import AirlightError
from airlight.options import presets
from airlight.viewer import command
from airlight.viewer import state as st
from airlight.viewer.state import LightControl, ViewerState


def test_what_does_not_go_with_a_method_is_reset_or_told() -> None:
    state = ViewerState("x.png", True)
    st.set_values(state, {"method": "radial", "scale": 0.5, "normalization": "listing"})
    st.change(state, "method", "bands")
    assert st.values(state) == {"method": "bands", **CLASSIC}
    st.change(state, "scale", 0.5)
    assert state.is_error and "scale" in state.message and st.values(state) == {"method": "bands", **CLASSIC}


@given(some_values())
def test_settings_survive_a_file(tmp_path_factory: pytest.TempPathFactory, wanted: dict[str, Any]) -> None:
    state = ViewerState("a.png", True)
    try:
        st.set_values(state, wanted)
    except AirlightError:
        assume(False)
    path = tmp_path_factory.mktemp("settings") / "a.toml"
    st.save(state, str(path))
    assert presets.load(path) == st.values(state)


@given(some_values(scenes=False), some.lists(some.tuples(some.floats(-3, 3), some.floats(-3, 3)), min_size=1, max_size=3))
def test_the_command_says_what_is_shown(wanted: dict[str, Any], places: list[tuple[float, float]]) -> None:
    state = ViewerState("a picture.png", True)
    try:
        st.set_values(state, wanted)
    except AirlightError:
        assume(False)
    state.lights = [LightControl(place, (1.0, 0.5, 0.25), 2.0) for place in places]
    words = shlex.split(command.as_text(command.command_line(state)))
    assert words[:2] == ["airlight", "image"]
    with image_command.image.make_context("image", words[2:]) as ctx:
        values = gather(ctx, None)
        lights = image_command.image_request(ctx).lights
    said = {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert values == {name: v for name, v in said.items() if (name, v) != ("look", "smart")}  # which is the default
    assert ctx.params["sources"] == ("a picture.png",)
    for light, place in zip(lights, places, strict=True):
        assert [float(v) for v in light.position.split(",")] == pytest.approx(place, abs=1e-5)
        assert (light.color, light.strength) == ((1.0, 0.5, 0.25), 2.0)


def test_the_command_of_a_scene(scene: Driver) -> None:
    values, said = read_by_render(scene.state)
    assert values == {} and (said["scene"], said["width"], said["height"]) == ("table", *SCENE_SIZE)
    assert said["eye"] is None and said["camera"] is None and said["light"] == said["sun"] == ()
    scene.choose("camera", "side")
    scene.state.time = 1.25
    scene.frame(2)
    _, said = read_by_render(scene.state)
    assert (said["camera"], said["time"]) == ("side", 1.25)
    scene.state.lights[0].position = (-1.0, 2.0, -3.0)
    scene.state.lights[0].color = (1.0, 0.5, 0.25)
    scene.state.eye.moved = True
    scene.frame(2)
    _, said = read_by_render(scene.state)
    assert said["camera"] is None and said["light"] == ("-1,2,-3;color=1.0,0.5,0.25",)
    assert [float(v) for v in said["eye"].split(",")] == pytest.approx(scene.state.eye.eye, abs=1e-4)
    assert said["fov"] == pytest.approx(scene.state.eye.fov, rel=1e-3)


@given(some_values(), some.floats(-179, 179), some.floats(-80, 80))
def test_the_command_of_a_scene_says_all(wanted: dict[str, Any], azimuth: float, elevation: float) -> None:
    state = ViewerState("flying", False, size=(640, 360))
    wanted.pop("daylight", None)  # the sun is the air's then, and test_viewer_daylight.py reads its command
    try:
        st.set_values(state, wanted)
    except AirlightError:
        assume(False)
    turn, up = np.radians([azimuth, elevation])
    state.lights = [LightControl((np.sin(turn) * np.cos(up), np.sin(up), -np.cos(turn) * np.cos(up)), direction=True)]
    values, said = read_by_render(state)
    assert values == {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert [float(v) for v in said["sun"][0].split(",")] == pytest.approx((azimuth, elevation), abs=1e-3)
