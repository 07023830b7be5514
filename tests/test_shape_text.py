"""`--ies` and `ies=` of `--light`: which lights get which file, and what is said of names that no light has."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltf_rooms import room
from photometric_files import DATA, form, ies

from airlight.cli import main
from airlight.errors import AirlightError
from airlight.files.photometry import read_photometry
from airlight.jobs.light_text import PLACE, read_scene_light
from airlight.jobs.shape_text import put_photometry, read_shape_text
from airlight.options import March, Medium, Parameters
from airlight.pygfx import SceneLight
from airlight.pygfx.punctual import punctual_lights
from airlight.scenes import Stage, open_scene
from airlight.scenes.lamps import lighting
from airlight.scenes.offline import Shot, Studio
from airlight.viewer import command
from airlight.viewer.state import LightControl, ViewerState

STREET = str(DATA / "absolute_photometry.ies")
TILTED = str(DATA / "tilt_include_geometry2.ies")


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    """A room with a point, a spot that shines along +X, a sun, and a cube that emits."""
    w = room(bulb=3.0)
    w.node(extensions=w.light(type="point", intensity=40), translation=[-0.6, 2, -1], name="lamp")
    spot = w.light(type="spot", intensity=30, spot={"outerConeAngle": 0.5})
    w.node(extensions=spot, rotation=[0, -np.sqrt(0.5), 0, np.sqrt(0.5)], translation=[-3, 1, 0], name="spot")
    w.node(extensions=w.light(type="directional", intensity=2), name="sun")
    return open_scene(w.save(tmp_path), "none")


def test_how_it_is_written() -> None:
    found = read_shape_text(" street lamp = a b.ies ; absolute = 1 ")
    assert (found.name, found.path, found.known) == ("street lamp", "a b.ies", {"absolute": "1"})
    for text, says in (
        ("lamp", "write NAME=FILE, then ;absolute=1"), ("=x.ies", "write NAME=FILE"), ("lamp=", "write NAME=FILE"),
        ("lamp=x;absolute=yes", "use 0, 1"), ("lamp=x;absolutes=1", "did you mean 'absolute'"),
    ):  # fmt: skip
        with pytest.raises(AirlightError, match=says):
            read_shape_text(text)


def test_a_lights_own_candela_are_those_of_the_peak(stage: Stage) -> None:
    put_photometry(stage, [f"lamp={STREET}", f"spot={TILTED}"])
    point, spot, sun = punctual_lights(stage.lights)
    assert point.photometry.peak == 2200 and max(point.intensity) == pytest.approx(40) and not stage.measured
    assert spot.photometry.peak == 5000 and max(spot.intensity) == pytest.approx(30) and sun.photometry is None
    below, above, beside = point.colour(point.origin() + np.array([(0, -1.0, 0), (0, 1, 0), (2, 0, 0)]))
    assert (below == 1).all() and (above == 0).all() and (beside == 0).all()
    assert np.allclose(spot.axes(), [(0, 0, 1), (0, 1, 0), (1, 0, 0)], atol=1e-6)


def test_absolute_candela(stage: Stage) -> None:
    """They are the file's, with its TILT section for a lamp that does not point down; surfaces have them too, and they are exposed."""
    put_photometry(stage, [f"lamp={TILTED};absolute=1", f"spot={TILTED};absolute=1"])
    point, spot, _ = punctual_lights(stage.lights)
    assert max(point.intensity) == pytest.approx(5000) and max(spot.intensity) == pytest.approx(5000 * 0.82)
    assert stage.lights[0].target.intensity == pytest.approx(5000) and stage.measured


def test_lights_that_are_added(stage: Stage) -> None:
    asked = [read_scene_light("Bulb", PLACE), read_scene_light(f"0,2,0;ies={STREET};color=1,0.5,0.5;absolute=1", PLACE)]
    asked += [read_scene_light(f"spot;ies={STREET};strength=7cd", PLACE)]
    asked = put_photometry(stage, [f"Bulb={TILTED}"], asked)
    with (made := lighting(stage, asked)).shining():
        made.move()
        bulb, moved, spot = punctual_lights(made.lights)
    assert [one.photometry.peak for one in (bulb, moved, spot)] == [5000, 2200, 2200]
    assert moved.intensity == pytest.approx((2200, 1100, 1100)) and max(spot.intensity) == pytest.approx(7)
    added = read_scene_light(f"1,2,0;ies={STREET};strength=9", PLACE)
    stage.lights.clear()
    with (made := lighting(stage, [added])).shining():
        (lamp,) = punctual_lights(made.lights)
    assert lamp.photometry.peak == 2200 and lamp.intensity == pytest.approx((9, 9, 9))
    for text in ("0,2,0;absolute=1", f"0,2,0;ies={STREET};absolute=2", f"0,2,0;ies={STREET};absolute=1;strength=3cd"):
        with pytest.raises(AirlightError, match="absolute"):
            read_scene_light(text, PLACE)


def test_names_that_no_light_has(stage: Stage) -> None:
    with pytest.raises(AirlightError, match=r"--ies lmp: .* no light of that name; there is lamp, spot, sun; did you mean 'lamp'?"):
        put_photometry(stage, [f"lmp={STREET}"])
    with pytest.raises(AirlightError, match=r"there is lamp, spot, sun, Bulb$"):
        put_photometry(stage, [f"other={STREET}"], [read_scene_light("Bulb", PLACE), read_scene_light("0,0,0", PLACE)])
    with pytest.raises(AirlightError, match="--ies sun: is a sun, which has no photometry; name a point or a spot"):
        put_photometry(stage, [f"sun={STREET}"])
    stage.lights = [SceneLight(gfx.PointLight())]
    with pytest.raises(AirlightError, match="has no light of that name; none has a name: give --light"):
        put_photometry(stage, [f"lamp={STREET}"])


def test_scene_lights(tmp_path: Path) -> None:
    """Takes a path, which is read anew where it is another, or anything that has `at`; turns with its target."""
    lamp = SceneLight(position=(0, 1, 0), photometry=STREET)
    first = punctual_lights([lamp])[0].photometry
    assert punctual_lights([lamp])[0].photometry is first and first.peak == 2200
    lamp.photometry = Path(TILTED)
    assert punctual_lights([lamp])[0].photometry.peak == 5000
    lamp.photometry = first
    assert punctual_lights([lamp])[0].photometry is first
    turned = np.array([(0, 1.0, 0), (1, 0, 0), (0, 0, 1)])
    light = gfx.PointLight(decay=2)
    light.local.euler = (0, np.pi / 2, 0)  # +Z to +X
    (found,) = punctual_lights([SceneLight(light, photometry=first, turned=turned)])
    assert np.allclose(found.axes(), [(0, 1, 0), (0, 0, -1), (1, 0, 0)], atol=1e-6)
    for wrong in ({"photometry": 5}, {"turned": np.eye(3)}, {"turned": [1, 2]}, {"turned": np.zeros((3, 3))}):
        with pytest.raises(AirlightError, match=r"SceneLight's (photometry|turned) must be"):
            SceneLight(position=(0, 0, 0), **wrong)
    for sun in (SceneLight(direction=(0, 1, 0), photometry=first), SceneLight(gfx.DirectionalLight(), photometry=first)):
        with pytest.raises(AirlightError, match="a sun has none"):
            punctual_lights([sun])


def test_the_command(stage: Stage, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    small = ["--width", "48", "--quality", "draft", "--environment", "none"]
    out = tmp_path / "a.exr"
    assert main(["render", stage.name, "-o", str(out), "--ies", f"lamp={STREET}", *small]) == 0
    again = tmp_path / "b.exr"
    assert main(["render", stage.name, "-o", str(again), "--settings-from", str(out), *small]) == 0
    assert again.read_bytes() == out.read_bytes()
    capfd.readouterr()
    broken = tmp_path / "broken.ies"
    broken.write_bytes(form("half")[:200])
    for more, says in (
        (["--ies", f"lamp={broken}"], "is cut off"), (["--ies", f"lamp={tmp_path}/none.ies"], "cannot be read"),
        (["--ies", f"lamp={STREET}", "--method", "radial"], "--ies means nothing with method radial"),
    ):  # fmt: skip
        assert main(["render", stage.name, "-o", str(tmp_path / "c.png"), *more, *small]) == 2
        error = capfd.readouterr().err
        assert says in error and error.count("\n") == 1
    assert not (tmp_path / "c.png").exists() and read_photometry(STREET).peak == 2200


def test_a_constant_file_is_none_bit_for_bit_and_another_is_seen(stage: Stage, tmp_path: Path) -> None:
    (tmp_path / "even.ies").write_bytes(ies("C", [0, 90, 180], [0], np.full((1, 3), 70.0)))
    air = {"medium": Medium(sigma_t=(0.03,) * 3), "march": March(steps=16)}
    del stage.lights[2]
    layers = []
    for texts in ((), (f"lamp={tmp_path / 'even.ies'}", f"spot={tmp_path / 'even.ies'}"), (f"lamp={STREET}",)):
        put_photometry(stage, texts)
        layers.append(Studio(stage, Shot(48, 27, 1), Parameters(method="march"), **air).frame(layer=True).layer[..., :3].copy())
    np.testing.assert_array_equal(layers[0], layers[1])
    assert layers[0].max() > 0 and layers[2].sum() < 0.8 * layers[0].sum()


def test_the_viewers_command_keeps_what_its_panel_does_not_show() -> None:
    control = LightControl((0.0, 2.0, -3.0), written=f"0,2,-3;ies={STREET};strength=7cd;color=1,1,0.5", color=(1.0, 1.0, 0.5))
    state = ViewerState(source="room.glb", is_image=False, lights=[control], lights_before=[replace(control)])
    assert command.light_words(state) == [f"--light={control.written}"]
    control.position = (1.0, 2.0, -3.0)
    assert command.light_words(state) == [f"--light=1,2,-3;ies={STREET};strength=7cd;color=1,1,0.5"]
    control.strength = 2.0
    (word,) = command.light_words(state)
    assert word == f"--light=1,2,-3;color=1.0,1.0,0.5;strength=2.0;ies={STREET};strength=7cd"
    light = read_scene_light(word.removeprefix("--light="), PLACE)
    assert (light.intensity, light.strength, light.photometry.peak) == (7, 2, 2200)
