"""`airlight render` to numbered frames: ranges, turntables, settings that repeat them."""

import json
import math

import numpy as np
import pytest
from render_stage import SIZE, picture, refused, render, stage

from airlight import scenes
from airlight.cli import main
from airlight.files import read_image, read_settings
from airlight.scenes import offline


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Frames 1 to 6 in one run, with light adaptation."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "open_scene", stage)
        assert render("-o", folder / "f.####.png", "--frames", "1-6", "--fps", "6", "--adapt", "0.6", "--camera", "follower") == 0
    return folder


def test_a_range_that_is_split_or_resumed_gives_the_same_bytes(whole, tmp_path, capsys):
    options = ("--fps", "6", "--adapt", "0.6", "--camera", "follower")
    for frames in ("4-6", "1-3x2"):
        assert render("-o", tmp_path / "f.%04d.png", "--frames", frames, *options) == 0
    (tmp_path / "f.0004.png").write_bytes(b"damaged")
    capsys.readouterr()
    assert render("-o", tmp_path / "f.%04d.png", *options, "--resume") == 0  # the whole animation: 1 s
    assert "4 of 6 exist" in capsys.readouterr().err
    for path in sorted(whole.iterdir()):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()
    assert len(list(tmp_path.iterdir())) == 6
    assert "exists already, as do 5 more" in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "f.%04d.png", *options)
    assert render("-o", tmp_path / "f.%04d.png", *options, "-n") == 0


def test_a_range_with_the_pre_pass_can_be_split_too(tmp_path):
    options = ("--fps", "6", "--occluders", "prepass", "--camera", "follower")
    for name, frames in (("a", "1-4"), ("b", "4")):
        buffer = tmp_path / f"o{name}.##.exr"
        assert render("-o", tmp_path / f"{name}.##.exr", "--occlusion-buffer", buffer, "--frames", frames, *options) == 0
    for name in ("", "o"):
        assert (tmp_path / f"{name}a.04.exr").read_bytes() == (tmp_path / f"{name}b.04.exr").read_bytes()


def test_a_frame_by_its_time_is_that_of_the_range(whole, tmp_path):
    assert render("-o", tmp_path / "a.png", "--time", "0.5", "--adapt", "0.6", "--camera", "follower") == 0
    assert np.array_equal(read_image(tmp_path / "a.png").codes, read_image(whole / "f.0004.png").codes)
    assert json.loads(read_settings(str(whole / "f.0004.png"))) == {"adapt": 0.6, "camera": "follower", "height": 48, "scene": "box"} | {
        "time": 0.5,
        "width": 64,
    }


def test_settings_of_a_frame_repeat_it(tmp_path):
    assert render("-o", tmp_path / "t.##.png", "--turntable", "8", "--frames", "3", "--light", "0,1,-3;color=1,0.5,0.25;strength=2") == 0
    assert main(["render", "-o", str(tmp_path / "again.png"), "--settings-from", str(tmp_path / "t.03.png")]) == 0  # the scene too
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "t.03.png").read_bytes()


def test_settings_of_another_command_are_refused(tmp_path, capsys):
    assert render("-o", tmp_path / "a.png") == 0
    line = refused(capsys, "image", tmp_path / "a.png", "-o", tmp_path / "b.png", "--settings-from", tmp_path / "a.png")
    assert "`airlight render`" in line
    assert main(["image", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png"), "--light", "0.5,0.5", "--rays", "24"]) == 0
    assert "`airlight image`" in refused(capsys, "render", "box", "-o", tmp_path / "c.png", "--settings-from", tmp_path / "b.png")


def test_a_turntable_goes_around_the_centre():
    studio = offline.Studio(stage(), offline.Shot(64, 48, 1))
    turned, straight = studio.frame(turn=1 / 8).pixels(), studio.frame().pixels()
    assert np.abs(straight - turned).mean() > 0.01
    assert np.array_equal(studio.frame(turn=1 / 8).pixels(), turned)
    at = 5 * math.sin(math.pi / 4)
    seen = offline.Studio(stage(), offline.Shot(64, 48, 1, eye=(at, 0, at), target=(0, 0, 0)))  # counter-clockwise from +z: towards +x
    assert np.abs(seen.frame().pixels() - turned).mean() < 1e-3


def test_a_turntable_as_numbered_frames(tmp_path):
    assert render("-o", tmp_path / "t.##.png", "--turntable", "4", "--layer", tmp_path / "l.##.exr") == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"{c}.{i:02d}.{e}" for c, e in (("l", "exr"), ("t", "png")) for i in range(1, 5)]
    front, back = picture(tmp_path / "t.01.png"), picture(tmp_path / "t.03.png")
    assert np.abs(front - back).mean() > 0.01
