"""Scenes in the viewer: parameters of a medium, time, cameras, lights."""

from pathlib import Path

import numpy as np
import pytest
from gltf_rooms import room
from hypothesis import given
from hypothesis import strategies as some
from viewer_driver import SCENE_SIZE, Driver, read_by_render, resident, stage

from airlight import scenes
from airlight.errors import AirlightError
from airlight.files import read_image
from airlight.lights.directional import DirectionalLight
from airlight.options import Medium, declared, presets
from airlight.scatter.methods import of_screen
from airlight.viewer import app, command, controls
from airlight.viewer import state as st


def test_a_scene(scene: Driver) -> None:
    state = scene.state
    assert not state.is_image and state.duration == 4.0
    seen = scene.frame()
    scene.click("shafts")
    dark = scene.frame(2)
    assert (seen[:, 360:].astype(int) - dark[:, 360:]).max() > 10
    scene.click("shafts")
    assert np.array_equal(scene.frame(2)[:, 360:], seen[:, 360:])


@pytest.mark.parametrize("source", [*scenes.NAMES, *scenes.VALIDATION, "model.glb", "MODEL.GLTF"])
def test_every_scene_is_taken_for_one(scene: Driver, photo: str, source: str) -> None:
    scene.viewer.open(photo)
    assert scene.state.is_image
    scene.viewer.open(source)
    assert not scene.state.is_image and command.command_line(scene.state)[:3] == ["airlight", "render", source]


def test_the_path_is_drawn_on_request(scene: Driver) -> None:
    plain = scene.frame(2)
    scene.click("path drawn")
    assert scene.state.path_drawn and np.abs(scene.frame(2)[:, 360:].astype(int) - plain[:, 360:]).max() > 50
    scene.click("path drawn")
    assert np.array_equal(scene.frame(2)[:, 360:], plain[:, 360:])


def test_each_parameter_of_a_scene_has_a_widget(scene: Driver) -> None:
    groups = ("Shafts in the scene", "Composite", "Method")
    for group in groups:
        scene.open_group(group)
    assert {d.name for d in st.shown(scene.state)} <= set(scene.places)
    for group in groups:
        scene.open_group(group)


@pytest.fixture
def lit(scene: Driver, monkeypatch: pytest.MonkeyPatch) -> Driver:
    """A scene whose medium is lit, once; then only the panel is looked at."""
    st.set_values(scene.state, {"method": "march", "steps": "exact", "shadow_size": 64, "resolution": 0.25})
    scene.frame(2)
    monkeypatch.setattr(scene.viewer.scene, "show", lambda *_: None)
    scene.canvas.set_logical_size(400, 1400)  # where nothing has to be scrolled to
    scene.frame(2)
    return scene


def test_each_parameter_of_a_medium_has_a_widget_only_where_it_means_something(lit: Driver) -> None:
    of_medium, of_view = ({d.name for d in declared(scenes=True) if d.methods == methods} for methods in (("march",), of_screen()))
    groups = ("Method", "Composite", "Shafts in the scene", "March")
    for group in groups:
        lit.open_group(group)
    seen = set(lit.places)
    assert {d.name for d in st.shown(lit.state)} <= seen and of_medium <= seen and not of_view & seen
    assert {"group Medium", "group March"} <= seen and "group Shafts" not in seen
    lit.choose("method", "epipolar")
    seen = set(lit.places)
    assert not of_medium & seen and {"samples", "group Shafts"} <= seen and not {"group Medium", "group March"} & seen
    lit.choose("method", "march")
    assert lit.state.march.steps == "exact"  # kept
    lit.choose("jitter", "gradient")
    assert lit.state.parameters.jitter == "gradient"
    lit.choose("jitter", "auto (gradient)")
    lit.frame()
    assert lit.state.parameters.jitter is None and lit.state.automatic["jitter"] == "blue"
    for group in groups:
        lit.open_group(group)


def test_three_numbers_a_word_and_a_truth(lit: Driver) -> None:
    state = lit.state
    lit.open_group("March")
    assert state.medium.sigma_t is None and state.automatic["sigma_t"] == pytest.approx([0.5 / 6] * 3, rel=1e-2)  # of a radius of 3 m
    lit.click("sigma_t auto")
    assert state.medium.sigma_t == state.automatic["sigma_t"]
    lit.drag(lit.where("sigma_t", 0.5), lit.where("sigma_t", 0.42))
    red, green, blue = state.medium.sigma_t
    assert red == blue == state.automatic["sigma_t"][0] and 0 < green < red
    lit.drag(lit.where("albedo", 0.9), lit.where("albedo", 0.83))
    assert state.medium.albedo[:2] == (0.9, 0.9) and 0.2 < state.medium.albedo[2] < 0.8
    lit.click("extinction", 0.1)
    lit.click("snap", 0.1)
    assert (state.medium.extinction, state.march.snap) == (False, True)
    lit.click("steps exact", 0.1)
    assert isinstance(state.march.steps, int)
    lit.click("steps auto", 0.1)
    assert state.march.steps is None and state.automatic["steps"] == 64
    lit.click("steps auto", 0.1)
    lit.click("steps exact", 0.1)
    assert state.march.steps == "exact"
    lit.choose("shadow_size", "512")
    values, _ = read_by_render(state)
    assert values == {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert values.items() >= {"method": "march", "extinction": False, "snap": True, "steps": "exact", "shadow_size": 512}.items()
    lit.click("reset medium")
    assert state.medium == Medium() and state.march.snap and state.message == ""
    lit.open_group("March")


def test_media_in_the_panel(lit: Driver) -> None:
    lit.choose("medium", "underwater")
    assert st.medium(lit.state) == "underwater" and lit.state.medium.anisotropy == 0.924
    st.change(lit.state, "max_distance", 50.0)
    lit.choose("medium", "smoke")
    assert lit.state.medium == Medium(**presets.load("smoke", presets.MEDIA), max_distance=50.0)
    st.change(lit.state, "albedo", 0.5)
    assert lit.state.medium.albedo == (0.5, 0.5, 0.5) and st.medium(lit.state) == ""
    lit.choose("medium", "clear-air")  # of which there is too little in six metres
    lit.frame(2)
    assert lit.state.message == "" and "too thin" in lit.state.doubt and "message" in lit.places
    lit.choose("medium", "own")
    lit.frame(2)
    assert lit.state.medium == Medium(max_distance=50.0) and lit.state.doubt == "" and "message" not in lit.places


def test_what_a_scene_is_meant_for_stands_where_the_user_says_nothing(scene: Driver, photo: str, monkeypatch: pytest.MonkeyPatch) -> None:
    meant = stage("dense")
    meant.settings = {"sigma_t": (0.1, 0.2, 0.3), "snap": True}
    st.set_values(scene.state, {"albedo": 0.5, "method": "march", "steps": "exact", "shadow_size": 64})
    monkeypatch.setattr(scenes, "open_scene", lambda name, **_: meant)
    scene.viewer.open("table")
    state = scene.state
    assert (state.medium.sigma_t, state.medium.albedo, state.march.snap) == ((0.1, 0.2, 0.3), (0.5, 0.5, 0.5), True)
    assert not {"--sigma-t", "--snap"} & set(command.command_line(state))
    st.change(state, "snap", False)
    assert "--no-snap" in command.command_line(state)
    st.change(state, "sigma_t", 0.4)
    st.change(state, "sigma_t", None)
    assert state.medium.sigma_t == (0.1, 0.2, 0.3)
    st.reset(state)
    assert state.march.snap and state.medium.albedo == (0.9, 0.9, 0.9)
    st.change(state, "method", "march")
    scene.viewer.open(photo)
    assert (state.parameters.method, state.medium) == ("epipolar", Medium()) and "march is for scenes" in state.message
    with pytest.raises(AirlightError, match="airlight render SCENE"):
        app.Viewer(scene.canvas, photo, values={"method": "march"})


def test_time_runs_pauses_and_is_scrubbed(scene: Driver) -> None:
    assert scene.state.time == 0
    scene.click("play")
    scene.frame(3)
    assert scene.state.playing and scene.state.time > 0
    scene.click("play")
    stood = scene.state.time
    scene.frame(3)
    assert not scene.state.playing and scene.state.time == stood
    scene.drag(scene.where("time", 0.5), scene.where("time", 0.75))
    assert scene.state.time == pytest.approx(3.0, abs=0.15)


def test_the_light_of_a_scene_is_dragged(scene: Driver) -> None:
    mark = scene.viewer.marks.lights()[0]
    assert mark is not None
    scene.drag(mark, (mark[0] + 60, mark[1] - 40))
    now = scene.viewer.marks.lights()[0]
    assert now == pytest.approx((mark[0] + 60, mark[1] - 40), abs=2)
    x, y, z = scene.state.lights[0].position
    assert x > 0.1 and y > 0.55 and not scene.state.eye.moved
    assert np.allclose(scene.viewer.scene.stage.lights[0].target.world.position, (x, y, z), atol=1e-4)


def test_orbit_fly_and_cameras(scene: Driver) -> None:
    eye = scene.state.eye
    first = eye.eye
    scene.drag((500, 450), (600, 450))
    for _ in range(30):
        scene.frame()
    assert eye.moved and np.linalg.norm(eye.eye) == pytest.approx(np.linalg.norm(first), rel=0.02)
    assert np.linalg.norm(np.subtract(eye.eye, first)) > 0.5
    scene.choose("camera", "side")
    scene.frame(2)
    assert not eye.moved and eye.eye == pytest.approx((4, 0.5, 6))
    scene.state.time = 2.0
    scene.frame()
    assert eye.eye == pytest.approx((4, 0.7, 6))  # it follows
    scene.choose("steer", "fly")
    before = eye.eye
    scene.canvas.submit_event({"event_type": "key_down", "key": "w", "modifiers": ()})
    scene.frame(5)
    scene.canvas.submit_event({"event_type": "key_up", "key": "w", "modifiers": ()})
    scene.frame(5)
    assert eye.moved and eye.eye[2] < before[2] - 0.01
    scene.choose("camera", "front")
    scene.frame(2)
    assert not eye.moved and eye.eye == pytest.approx(first)


def test_debug_views_and_times_of_a_scene(scene: Driver) -> None:
    seen = [scene.frame()]
    for debug in ("occlusion", "source"):
        scene.state.debug = debug
        seen.append(scene.frame(2))
        assert all(np.abs(seen[-1][:, 400:].astype(int) - other[:, 400:]).max() > 20 for other in seen[:-1])
    scene.state.debug, scene.state.timing = None, True
    scene.frame()
    scene.viewer.following.settle()
    assert sum(ms for _, ms in scene.state.passes) > 0
    scene.state.timing = False
    name = scene.viewer.screenshot()
    assert read_image(name).codes.shape == (*SCENE_SIZE[::-1], 3)


def test_scene_picture_scene(scene: Driver, photo: str) -> None:
    seen = scene.frame(2)
    scene.state.requests.append(("open", photo))
    scene.frame(3)
    assert scene.state.is_image
    scene.choose("source", "flying")
    scene.state.playing, scene.state.time = False, 0.0
    scene.frame(3)
    assert not scene.state.is_image and scene.state.source == "flying"
    assert np.abs(scene.frame(2)[:, 360:].astype(int) - seen[:, 360:]).max() <= 1


@pytest.mark.slow
def test_memory_does_not_grow_in_scenes(scene: Driver, photo: str, capsys: pytest.CaptureFixture[str]) -> None:
    """300 frames of flying, sizes, ways of occlusion, presets, other scenes and pictures."""

    def turn(i: int) -> None:
        state = scene.state
        if i % 30 == 29:
            scene.viewer.open(("table", photo, "flying")[i // 30 % 3])
        if i % 30 == 15:
            scene.canvas.set_logical_size(*((640, 400), (560, 360))[i // 30 % 2])
        if i % 30 == 20:
            st.load(state, ("vesper", "soft", "long")[i // 30 % 3])
        if i % 30 == 5:
            st.change(state, "occluders", ("stencil", "prepass", "contrast")[i // 30 % 3])
        state.time, state.playing = i % 40 / 10, False
        state.debug = ("occlusion", None, "source")[i // 20 % 3]
        scene.frame()

    scene.canvas.set_logical_size(640, 400)
    for i in range(180):  # two rounds
        turn(i)
    first = resident()
    for i in range(300):
        turn(i)
    grown = resident() - first
    with capsys.disabled():
        print(f"\nmemory: {first >> 20} MiB after 180 frames, {grown / first:+.1%} after 300 more; ", end="")
    assert grown < 0.05 * first, f"{grown / 2**20:.1f} MiB more than {first / 2**20:.0f}"


@given(some.tuples(*[some.floats(-2, 2)] * 3), some.tuples(some.floats(350, 1200), some.floats(10, 700)))
def test_dragging_in_space_keeps_the_distance(point: tuple[float, float, float], to: tuple[float, float]) -> None:
    f = 1 / np.tan(np.radians(25))
    projection = np.array([[f / 1.5, 0, 0, 0], [0, f, 0, 0], [0, 0, -1.001, -0.1001], [0, 0, -1, 0]])
    turn = np.array([[0.8, 0, 0.6, 0], [0, 1, 0, 0], [-0.6, 0, 0.8, -7], [0, 0, 0, 1]])
    clip, area = projection @ turn, (0.0, 0.0, 1280.0, 720.0)
    moved = controls.drag_in_view(point, to, clip, area)
    assert controls.project(moved, clip, area) == pytest.approx(to, abs=1e-3)
    assert (clip @ [*moved, 1])[3] == pytest.approx((clip @ [*point, 1])[3])


def test_a_scene_with_a_sun_in_lux_is_exposed_and_the_slider_begins_there(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    import pygfx as gfx

    def sunny(*_: object, **__: object) -> object:
        made = stage()
        sun = gfx.DirectionalLight("#ffffff", 68300)
        sun.local.position = (2, 3, 4)
        made.scene.add(sun)
        return made

    monkeypatch.setattr(scenes, "open_scene", sunny)
    hands.viewer.open("table")
    state = hands.state
    state.playing = False
    hands.canvas.set_logical_size(*SCENE_SIZE)
    seen = hands.frame(3)[:, 360:]
    ev = state.automatic["ev"]
    assert -15 < ev < -12 and state.in_scene.ev is None
    assert 20 < seen.mean() < 200
    values, _ = read_by_render(state)
    assert values == {"ev": ev}
    st.change(state, "ev", ev)
    assert np.array_equal(hands.frame(2)[:, 360:], seen)
    st.change(state, "ev", ev - 2)
    assert hands.frame(2)[:, 360:].mean() < seen.mean() - 10
    st.change(state, "view_transform", "agx")
    assert not np.array_equal(hands.frame(2)[:, 360:], seen)
    monkeypatch.setattr(scenes, "open_scene", stage)  # of order 1, after that
    hands.viewer.open("table")
    hands.frame(2)
    assert state.automatic["ev"] == 0 and st.value(hands.state, "ev") == ev - 2  # what a user has set stays
    assert hands.viewer.scene.shafts.pre_exposure == 1
    st.set_values(hands.state, {})


def test_lamps_of_the_command_line(tmp_path: Path) -> None:
    """They shine, and the command that is copied repeats them, where they are now."""
    path = room(bulb=20).save(tmp_path)
    shown = Driver(path, tmp_path, lamps=("Bulb;strength=9", "1,2,3;strength=4"), animation=None, up=None)
    dark = Driver(room().save(tmp_path, "dark.glb"), tmp_path, lamps=("1,2,3;strength=0",))
    assert shown.frame()[:, 360:].mean() > dark.frame()[:, 360:].mean() + 20
    state = shown.state
    assert command.light_words(state) == ["--light=Bulb;strength=9", "--light=1,2,3;strength=4"]
    st.move(state, 1, (1.5, 2.0, 2.5))
    assert command.light_words(state) == ["--light=Bulb;strength=9", "--light=1.5,2,2.5;strength=4"]
    state.opening = ("--animation=walk",)
    assert "--animation=walk" in command.command_line(state)


def test_fog_that_loses_its_sun_is_told(scene: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    sun = DirectionalLight((1.0, 1.0, 1.0), (1.0, 0.03, 0.0))
    monkeypatch.setattr("airlight.pygfx.punctual.punctual_lights", lambda lights: [sun])
    quick = {"method": "march", "steps": 4, "shadow_size": 64, "resolution": 0.125, "sigma_t": 0.3, "fog": "exponential"}
    for depth, dark in ((20.0, True), (0.02, False)):
        st.set_values(scene.state, quick | {"fog_depth": depth})
        scene.frame(3)
        assert ("the fog is dark" in scene.state.doubt) is dark
