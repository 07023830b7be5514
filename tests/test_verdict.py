"""A result that is nearly all white, black or as it was says so in one line with its cure; so does a scene of which nothing is seen."""

from pathlib import Path

import numpy as np
import pytest
import thumbs

from airlight.cli import main
from airlight.colour import srgb_decode
from airlight.files import read_image, write_image
from airlight.jobs import doubts
from airlight.jobs.light_text import LightText
from airlight.jobs.verdict import DIM_LINEAR, brightest, changed_share, flat_share, percent
from airlight.options import Look, Parameters
from airlight.pictures import Rendered

SMALL = ["--width", "96", "--height", "54", "--quality", "draft", "-y"]
AWAY = ["--eye", "50,1,0", "--target", "60,1,0"]


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> list[str]:
    capsys.readouterr()
    assert main([str(one) for one in arguments]) == 0
    return capsys.readouterr().err.splitlines()


def test_shares() -> None:
    codes = np.full((40, 50, 3), 255, np.uint8)
    assert flat_share(codes) == ("white", 1.0) and flat_share(codes[:, :, [0, 1, 2, 2]]) == ("white", 1.0)
    codes[:3] = 0
    assert flat_share(codes) is None  # 92.5 %
    codes[3:], codes[:3] = (255, 254, 250), 255  # as the shoulder of a view transform leaves them
    assert flat_share(codes) == ("white", 1.0)
    codes[0], codes[1:] = 0, (2, 0, 1)
    assert flat_share(codes) == ("black", 1.0)
    light = np.full((40, 50, 3), 7, np.float32)
    assert flat_share(light) == ("white", 1.0) and flat_share(light, True) is None
    assert flat_share(0 * light + 1e-4) == ("black", 1.0) and flat_share(0 * light + 1e-4, True) is None
    assert flat_share(0 * light, True) == ("black", 1.0)
    assert changed_share(codes, codes + np.uint8(2)) == 0 and changed_share(codes, codes + np.uint8(3)) == 1
    assert changed_share(light, light + 1) == 0 and changed_share(light, light + 1, 65504) == 1
    assert (percent(0.999), percent(1), percent(0.955)) == ("99 %", "100 %", "95 %")


def test_a_picture_that_is_nearly_all_as_it_was(tmp_path: Path) -> None:
    write_image(tmp_path / "in.png", thumbs.linear(thumbs.SUN))
    picture, light = read_image(tmp_path / "in.png"), LightText("0.5,0.4")
    for rows, says in ((0, "hardly changed: "), (3, "hardly changed, 95 % of it not at all: "), (4, "")):
        after = picture.codes[..., :3].copy()
        after[:rows] = 255 - after[:rows] // 2
        lines: list[str] = []
        for look in (Look(), None):
            doubts.tell_unchanged(picture, Rendered(encoded=after), look, Parameters(), [light], False, lines.append)
            done = Rendered(srgb_decode(after / 255).astype(np.float32))
            doubts.tell_unchanged(picture, done, look, Parameters(), [light], False, lines.append)
        assert len(lines) == (4 if says else 0) and all(line.startswith(f"{tmp_path / 'in.png'}: {says}") for line in lines), lines
        assert not lines or (lines[:2] != lines[2:] and lines[0] == lines[1])
        declined: list[str] = []
        doubts.tell_unchanged(picture, Rendered(encoded=after, message="said"), None, Parameters(), [light], False, declined.append)
        assert declined == [f"{tmp_path / 'in.png'}: said"]


def test_a_picture_that_becomes_white(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_image(tmp_path / "in.png", np.full((40, 60, 3), 0.6, np.float32))
    args = ["image", tmp_path / "in.png", "-o", tmp_path / "out.png", "--light", "0.5,0.5"]
    sums = ["--occlusion", "none", "--blend", "add", "--mix", "1", "--veil", "0"]
    lines = said(capsys, *args, *sums, "--exposure", "5")
    assert len(lines) == 1 and "100 % of the result is white: a lower --exposure" in lines[0]
    assert said(capsys, *args, *sums, "-y", "--exposure", "0.1") == []


def test_an_input_beyond_white_that_an_output_cannot_hold(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_image(tmp_path / "lux.exr", 9000 * thumbs.linear(thumbs.SUN) + 2)
    args = ["image", tmp_path / "lux.exr", "--light", "0.5,0.4", "-o"]
    for more in ([], ["--look", "classic"], ["--light", "0.5,0.4;strength=0"]):
        told = [line for line in said(capsys, *args, tmp_path / "out.png", "-y", *more) if "brighter than white" in line]
        assert len(told) == 1 and "100 % of it" in told[0] and "write .exr" in told[0]
        assert not any("shows more" in line for line in said(capsys, *args, tmp_path / "out.png", "-y", *more))
    assert not any("brighter than white" in line for line in said(capsys, *args, tmp_path / "out.exr"))


def test_nothing_of_the_scene_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.png", "a.exr"):
        lines = said(capsys, "render", "table", "-o", tmp_path / name, *SMALL, *AWAY)
        assert len(lines) == 1 and "nothing of the scene is seen" in lines[0] and "--eye" in lines[0] and "--camera" in lines[0]
    assert said(capsys, "render", "table", "-o", tmp_path / name, *SMALL) == []
    lines = said(capsys, "render", "table", "-o", tmp_path / "f.mp4", *SMALL, *AWAY, "--turntable", "3")
    assert len(lines) == 1 and "all 3 frames" in lines[0]
    lines = said(capsys, "render", "table", "-o", tmp_path / "f.##.png", *SMALL, *AWAY, "--turntable", "3", "--frames", "1-2")
    assert len(lines) == 2 and "all 2 frames" in lines[0]


def test_a_scene_that_is_black_or_white(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dense = ["--method", "march", "--sigma-t", "300", "--albedo", "0"]
    lines = said(capsys, "render", "slats", "-o", tmp_path / "b.png", *SMALL, *dense)
    assert len(lines) == 2 and "the medium hides the scene" in lines[0] and "100 % of it is black: --ev 4" in lines[1], lines
    lines = said(capsys, "render", "table", "-o", tmp_path / "w.png", *SMALL, "--exposure", "1e5")
    assert len(lines) == 1 and "% of it is white: --ev -4" in lines[0]
    assert said(capsys, "render", "table", "-o", tmp_path / "w.exr", *SMALL, "--exposure", "1e5") == []  # light has no white


def test_a_scene_that_is_dark(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not black, but too dark to look at; its cure is followed, and nothing is said."""
    args = ["render", "slats", "--method", "march", *SMALL, "-o"]
    lines = said(capsys, *args, tmp_path / "a.png", "--ev", "-6")
    assert len(lines) == 1 and "a.png: it is dark, nearly all of it below 5 % of white: --ev " in lines[0], lines
    assert said(capsys, *args, tmp_path / "a.png", "--ev", lines[0].split("--ev ")[1].split()[0]) == []
    assert said(capsys, *args, tmp_path / "a.exr", "--ev", "-6.5") == []  # light has no exposure


@pytest.mark.parametrize(("lit", "says"), [(2, True), (5, False)])
def test_brightest(lit: int, says: bool) -> None:
    pixels = np.full((50, 60, 3), 0.01, np.float32)
    pixels[0, :lit] = 0.06
    assert (brightest(pixels) < DIM_LINEAR) is says


def test_compared_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_image(tmp_path / "in.png", thumbs.linear(thumbs.SUN))
    args = ["compare", tmp_path / "in.png", "-o", tmp_path / "s.png", "--light", "0.52,0.42", "--runs", "1"]
    lines = said(capsys, *args, "--variant", "method=epipolar,exposure=1e-4,mix=1,blend=add", "--variant", "method=radial")
    assert len(lines) == 1 and "100 % of it is as it was: raise its exposure" in lines[0], lines
