"""Projectors in the viewer: dragged, aimed, given cookies; and the command that makes what is shown."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pygfx as gfx
import pytest
from viewer_driver import SCENE_SIZE, SIZE, Driver, read_by_render

from airlight import scenes
from airlight.files import write_image
from airlight.jobs.projector_text import change_projector, make_projector
from airlight.pygfx import Projector, SceneLight
from airlight.scenes import Stage
from airlight.scenes.lamps import cast_shadow
from airlight.viewer import command
from airlight.viewer.desktop import Desktop

OWN = "0.1,1.3,1;target=1,0.2,0;fov=50,40;intensity=30,30,30"
SETTINGS = {"method": "march", "steps": 3, "shadow_size": 32, "resolution": 0.25, "sigma_t": (0.2, 0.2, 0.2)}


def hall(name: str = "hall", **_: Any) -> Stage:
    """A wall, a spot, a sun, and a projector of its own."""
    scene = gfx.Scene()
    wall = gfx.Mesh(gfx.box_geometry(0.2, 3, 3), gfx.MeshStandardMaterial(color="#ffffff"))
    wall.local.position = (1.2, 0, 0)
    own = make_projector(OWN)
    own.name, own.written = "film", ""
    spot = gfx.SpotLight("#ffffff", 5, decay=2, angle=0.4)
    spot.name, spot.local.position = "spot", (0, 2, 0)
    sun = gfx.DirectionalLight("#ffffff", 0.2)
    sun.name, sun.local.position = "sun", (0, 5, 5)
    scene.add(gfx.AmbientLight(intensity=0.1), wall, own, own.target, spot, spot.target, sun)
    for light in (own, spot, sun):
        cast_shadow(light, np.zeros(3), 3.0)
    camera = gfx.PerspectiveCamera(50, depth_range=(0.1, 100))
    camera.local.position = (0, 0.5, 6)
    camera.look_at((0, 0, 0))
    lights = [SceneLight(target=light) for light in (own, spot, sun)]
    made = Stage(name, scene, {"front": camera}, lights, 0.0, lambda *_: None, np.zeros(3), 3.0, settings=SETTINGS)
    made.draggable = [own, spot]
    return made


@pytest.fixture
def shown(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> Iterator[Driver]:
    monkeypatch.setattr(scenes, "open_scene", hall)
    hands.canvas.set_logical_size(*SCENE_SIZE)
    hands.viewer.open("table")
    hands.frame(3)
    yield hands
    hands.canvas.set_logical_size(*SIZE)


@pytest.fixture
def gobo(tmp_path: Path) -> str:
    path = str(tmp_path / "gobo.png")
    write_image(path, None, encoded=np.tile(np.array([[[255, 0, 0]], [[0, 0, 255]]], np.uint8), (4, 8, 1)))
    return path


def film(driver: Driver) -> Projector:
    found = driver.viewer.scene.stage.lights[0].target
    assert isinstance(found, Projector)
    return found


def seen(driver: Driver) -> np.ndarray:
    return driver.frame(2)[:, 360:].astype(int)


def test_a_projector_is_dragged_and_aimed(shown: Driver) -> None:
    state, marks = shown.state, shown.viewer.marks
    before, aimed = seen(shown), marks.aims()[0]
    assert aimed is not None and marks.aims()[1:] == [None, None]
    shown.drag(aimed, (aimed[0] - 40, aimed[1] + 30))
    now = marks.aims()[0]
    assert np.allclose(now, (aimed[0] - 40, aimed[1] + 30), atol=1)
    assert tuple(film(shown).target.world.position) == pytest.approx(state.lights[0].aim) and state.lights[0].position == (0.1, 1.3, 1)
    assert np.abs(seen(shown) - before).max() > 10
    start = marks.lights()[0]
    shown.drag(start, (start[0] + 30, start[1] - 20))
    assert tuple(film(shown).world.position) == pytest.approx(state.lights[0].position)
    assert np.allclose(marks.aims()[0], now, atol=1), "it goes on shining there"
    (option,) = [word for word in command.options(state) if word.startswith("--projector")]
    assert option.startswith("--projector=film;position=") and not any(w.startswith("--light") for w in command.options(state))
    again = hall().lights[0].target
    change_projector(again, option.partition("=")[2])
    assert np.allclose(again.world.position, film(shown).world.position) and np.allclose(again.target.world.position, state.lights[0].aim)
    for _ in range(2):
        state.requests.append(("undo", ""))
        shown.frame(2)
    assert tuple(film(shown).world.position) == pytest.approx((0.1, 1.3, 1)) and np.array_equal(seen(shown), before)
    assert command.shape_words(state) == []


@pytest.mark.slow
def test_its_frustum_and_cookie_are_of_the_panel(shown: Driver, gobo: str) -> None:
    state = shown.state
    before = seen(shown)
    shown.choose("falloff 0", "inverse")
    assert film(shown).falloff == "inverse"
    shown.click("intensity 0", 0.9)
    assert film(shown).intensity > 1000 and np.abs(seen(shown) - before).max() > 20
    shown.click("fov 0", 0.1)
    assert film(shown).fov[0] < 45 and film(shown).angle < np.radians(60)
    (option,) = command.shape_words(state)
    assert "falloff=inverse" in option and "intensity=" in option and "fov=" in option
    _, params = read_by_render(state)
    assert params["projector"] == (option.partition("=")[2],)
    shown.type("cookie path 0", gobo)
    shown.click("load cookie 0")
    shown.frame(2)
    assert state.lights[0].gobo == gobo and command.shape_words(state)[1] == f"--cookie=film={gobo}"
    shown.click("own cookie 0")
    assert state.lights[0].gobo == ""


def test_a_cookie_is_that_of_a_file(shown: Driver, gobo: str) -> None:
    state = shown.state
    before = seen(shown)
    state.requests.append(("cookie", f"0:{gobo}"))
    shown.frame(2)
    assert state.lights[0].gobo == gobo and not state.is_error and "light 1 sends out gobo.png" in state.message
    red = seen(shown)
    assert np.abs(red - before).max() > 20
    assert command.shape_words(state) == [f"--cookie=film={gobo}"]
    state.requests.append(("undo", ""))
    shown.frame(2)
    assert np.array_equal(seen(shown), before) and state.lights[0].gobo == ""
    state.requests.append(("redo", ""))
    shown.frame(2)
    Path(gobo).unlink()  # what was read is kept
    assert np.array_equal(seen(shown), red)


def test_what_is_no_cookie_is_a_line(shown: Driver, tmp_path: Path) -> None:
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
    for path in (str(bad), str(tmp_path / "none.png"), str(tmp_path)):
        shown.state.requests.append(("cookie", f"0:{path}"))
        shown.frame(2)
        assert shown.state.is_error and "\n" not in shown.state.message and Path(path).name in shown.state.message
        assert shown.state.lights[0].gobo == ""


@pytest.mark.slow
def test_a_chosen_file_is_the_cookie_of_its_light(shown: Driver, gobo: str, monkeypatch: pytest.MonkeyPatch) -> None:
    state, desktop = shown.state, shown.viewer.errands.desktop
    asked: list[Any] = []
    monkeypatch.setattr(Desktop, "choose", lambda self, folder, light=None: asked.append(light) or "")
    shown.click("cookie 2")
    shown.frame(2)
    assert asked == [2]
    desktop.receive([gobo], 2)
    shown.frame(3)
    assert state.lights[2].gobo == gobo and state.source == "table"
    state.lights[2].gobo_size = 0.5
    shown.frame(2)
    assert shown.viewer.scene.stage.lights[2].cookie.size == 0.5
    assert command.shape_words(state) == [f"--cookie=sun={gobo};size=0.5"]
    desktop.receive([gobo], 7)  # of a light that is not there any more
    shown.frame(2)
    assert state.source == "table" and not state.is_error


@pytest.mark.slow
def test_one_of_the_command_line_is_written_anew(folder: Path, gobo: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenes, "open_scene", hall)
    text = f"-2,2,1;target=0,0,0;fov=30,20;cookie={gobo}"
    hands = Driver("hall.glb", folder, shapes={"projector": (text, "film;near=0.5")})
    state = hands.state
    assert [word for word in command.options(state) if "projector" in word] == ["--projector=film;near=0.5", f"--projector={text}"]
    assert state.lights[3].movable and state.lights[3].aim == (0, 0, 0)
    state.lights[3].position, state.lights[3].fov = (-1.0, 2.0, 1.0), (35.0, 20.0)
    hands.frame(2)
    (option,) = command.shape_words(state)
    assert option == f"--projector=-1,2,1;cookie={gobo};target=0,0,0;fov=35,20"
    state.lights[1].position = (0.5, 2.0, 0.0)
    hands.frame(2)
    lights = [word for word in command.options(state) if word.startswith(("--light", "--sun"))]
    assert lights[:2] == ["--light=0.1,1.3,1", "--light=0.5,2,0"] and len(lights) == 3
