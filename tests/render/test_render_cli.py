"""The command line of `airlight render`: what is refused, how lights are said, which values reach the pass."""

import json
import math
import sys

import pygfx as gfx
import pytest
from render_stage import SIZE, refused, render, stage

from airlight.errors import MachineError
from airlight.files import read_settings
from airlight.jobs.light_text import PLACE, SUN, read_scene_light
from airlight.options import Composite, March, Medium, Parameters, SceneOptions, presets
from airlight.pygfx import SceneLight
from airlight.scenes import offline


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["-o", "a.mp4", "--width", "63"], "even width and height"),
        (["-o", "a.mp4", "--resume"], "numbered frames"),
        (["-o", "a.mp4", "--layer", "l.exr"], "numbered frames"),
        (["-o", "a.png", "--frames", "1-3"], "a.png: 3 frames do not go into one picture"),
        (["-o", "a.png", "--turntable", "3"], "pattern"),
        (["-o", "a.#.png", "--layer", "l.exr"], "l.exr: "),
        (["-o", "a.#.png", "--frames", "0"], "frame 0 lies before"),
        (["-o", "a.png", "--camera", "side"], "it has front, follower"),
        (["-o", "a.png", "--camera", "front", "--eye", "0,0,1"], "exclude each other"),
        (["-o", "a.png", "--fov", "20"], "--eye"),
        (["-o", "a.png", "--eye", "0,0"], "x,y,z"),
        (["-o", "a.png", "--eye", "0,nan,0"], "x,y,z"),
        (["-o", "a.png", "--eye", "0,1,0", "--target", "0,1,0"], "one place"),
        (["-o", "a.png", "--light", "0,1"], "x,y,z"),
        (["-o", "a.png", "--light", "wal"], "did you mean 'wall'?"),
        (["-o", "a.png", "--light", "wall"], "emits no light; say how many candela it has, as in 'wall;strength=50'"),
        (["-o", "a.png", "--light", "0,1,2;colour=1,1,1"], "color=R,G,B"),
        (["-o", "a.png", "--sun", "10,91"], "beyond 90"),
        (["-o", "a.png", "--light", "0,1,2;strength=-1"], "not negative"),
        (["-o", "a.png", "--fps", "0"], "frames a second"),
        (["-o", "a.png", "--fps", "1/0"], "frames a second"),
        (["-o", "a.png", "--exclude", "wall"], "prepass"),
        (["-o", "a.png", "--method", "march", "--occlusion-buffer", "o.exr"], "with march give --layer"),
        (["-o", "a.png", "--exclude", "wal", "--occluders", "prepass"], "did you mean 'wall'?"),
        (["-o", "a.png", "--occlusion", "none"], "occlusion"),
        (["-o", "a.png", "--draw-path"], "leave --draw-path out"),
        (["-o", "a.png", "--device", "no such thing"], "no adapter matches"),
        (["-o", "a.gif"], "unknown extension"),
        (["-o", "nowhere/a.mp4"], "does not exist"),
        (["-o", "a.png", "--width", "16384", "--height", "16384"], "too large"),
        (["-o", "a.png", "--turn", "3", "--turntable", "4"], "exclude"),
        (["-o", "a.png", "--preset", "vespr-scene"], "did you mean 'vesper-scene'?"),
    ],
)
def test_refusals_are_one_line(args, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    size = [] if "--width" in args else SIZE
    assert says in refused(capsys, "render", "box", *size, *args)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("module", "extra"), [("av", "airlight[video]"), ("pygfx", "airlight[scenes]")])
def test_a_missing_extra_is_named(module, extra, tmp_path, monkeypatch, capsys):
    for name in list(sys.modules):
        if name.startswith("airlight.scenes"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    assert extra in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "a.mp4")


def test_a_sun_is_written_by_azimuth_and_elevation():
    for text, direction in (("0,0", (0, 0, -1)), ("90,0", (1, 0, 0)), ("180,0", (0, 0, 1)), ("270,30", (-math.sqrt(0.75), 0.5, 0))):
        assert read_scene_light(text, SUN).direction == pytest.approx(direction, abs=1e-12)
    light = read_scene_light("1,2,3;color=1,0.5,0;strength=2", PLACE)
    assert light.position == (1, 2, 3) and light.color == (1, 0.5, 0) and light.strength == 2


def test_a_light_moves_the_lamp_of_the_scene():
    at = stage()
    asked = (read_scene_light("1,2,-4;strength=2", PLACE), read_scene_light("0,1,0", PLACE), read_scene_light("90,10", SUN))
    studio = offline.Studio(at, offline.Shot(64, 48, 1, lights=asked))
    studio.frame(0.25)
    lamp = at.lights[0].target
    assert tuple(lamp.world.position) == (1, 2, -4)
    first, second, third = studio.shafts.lights
    assert first.target is lamp and first.strength == 2
    assert isinstance(second.target, gfx.PointLight) and tuple(second.target.world.position) == (0, 1, 0)
    assert isinstance(third.target, gfx.DirectionalLight) and third.homogeneous()[0] > 0.9


def test_a_sun_turns_the_lamp_that_is_one():
    at = stage()
    sun = gfx.DirectionalLight()
    sun.local.position = (0, 3, 0)
    at.scene.add(sun)
    at.lights.append(SceneLight(sun))
    studio = offline.Studio(at, offline.Shot(64, 48, 1, lights=(read_scene_light("90,0", SUN),)))
    studio.frame()
    assert [light.target for light in studio.shafts.lights] == [sun]
    assert tuple(sun.world.position) == pytest.approx((3, 0, 0), abs=1e-9)


def test_a_broken_scene_is_a_failure_and_not_a_hole(monkeypatch):
    at = stage()
    studio = offline.Studio(at, offline.Shot(64, 48, 1))
    import logging

    monkeypatch.setattr(studio.renderer, "render", lambda *_: logging.getLogger("pygfx").error("no such texture\nat line 3"))
    with pytest.raises(MachineError, match="no such texture at line 3"):
        studio.frame()


def test_the_values_of_the_command_reach_the_pass(tmp_path, monkeypatch):
    seen = []
    make = offline.Studio

    def studio(stage, shot, parameters, composite, in_scene, **more):
        seen.append((parameters, composite, in_scene, more))
        return make(stage, shot, parameters, composite, in_scene, **more)

    monkeypatch.setattr(offline, "Studio", studio)
    options = ("--preset", "vesper", "--samples", "64", "--occluders", "stencil", "--clear", "#102030", "--mix", "0.5")
    assert render("-o", tmp_path / "a.exr", *options) == 0
    assert seen[0][0] == Parameters(
        method="radial", samples=64, density=0.8 * 149 / 150, decay=0.99, weight=0.8, exposure=0.05, normalization="listing"
    )
    more = {"medium": Medium(), "march": March(), "exclude": (), "linear": True, "turns": (0.0,)}
    assert seen[0][1:] == (Composite(mix=0.5), SceneOptions(clear="#102030"), more)


def test_a_medium_reaches_the_pass_and_is_repeated(tmp_path, monkeypatch, capsys):
    seen = []
    make = offline.Studio

    def studio(*given, **more):
        seen.append((given[2], more["medium"], more["march"]))
        return make(*given, **more)

    monkeypatch.setattr(offline, "Studio", studio)
    options = ("--medium", "clear-air", "--albedo", "0.5,0.25,1", "--steps", "exact", "--shadow-size", "64", "--no-extinction", "--snap")
    assert render("-o", tmp_path / "a.exr", *options) == 0
    air = presets.load("clear-air", presets.MEDIA)
    assert seen[0] == (
        Parameters(method="march", quality=seen[0][0].quality),
        Medium(**air | {"albedo": (0.5, 0.25, 1)}, extinction=False),
        March(steps="exact", shadow_size=64, snap=True),
    )
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and err.startswith("airlight: warning: the medium is too thin to be seen")
    assert render("-o", tmp_path / "b.exr", "--settings-from", tmp_path / "a.exr") == 0
    assert seen[1] == seen[0] and json.loads(read_settings(str(tmp_path / "a.exr"))) == json.loads(read_settings(str(tmp_path / "b.exr")))
    assert render("-o", tmp_path / "c.exr", "--settings-from", tmp_path / "a.exr", "--sigma-t", "0.1", "--extinction") == 0
    assert seen[2][1] == Medium(**air | {"albedo": (0.5, 0.25, 1), "sigma_t": (0.1, 0.1, 0.1)})
    assert capsys.readouterr().err.count("warning") == 1  # of b, not of c
