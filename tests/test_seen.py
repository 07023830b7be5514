"""What is not seen is told: a medium that hides all or is too thin, a lamp out of the view; and options of a medium ask for march."""

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import airlight
from airlight import scenes
from airlight.cli import main
from airlight.errors import AirlightError
from airlight.jobs.seen import doubt_of_medium
from airlight.medium.resolve import HIDING_DEPTH, resolve
from airlight.options import March, Medium, declared, of_medium_alone

SMALL = ["--width", "64", "--height", "36", "--quality", "draft", "-y"]
DARK, WHITE = np.zeros((100, 3)), np.ones((100, 3))


@pytest.fixture(autouse=True, scope="module")
def opened_once() -> Iterator[None]:
    """Open the table once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "open_scene", functools.cache(scenes.open_scene))
        yield


def told(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    capsys.readouterr()
    code = main([str(one) for one in arguments])
    return code, capsys.readouterr().err


def said(depth: Any, drawn: Any = True, light: Any = DARK, picture: Any = WHITE, own: Any = None, **keywords: Any) -> str:
    medium = resolve(Medium(sigma_t=keywords.pop("sigma_t", 0.1), **keywords), March(), "normal", 10.0)
    length = np.broadcast_to(np.asarray(depth, float) / 0.1, 100)
    return doubt_of_medium(medium, length, np.broadcast_to(drawn, 100), light, picture, own) or ""


def test_a_medium_hides_from_its_visibility_on() -> None:
    for over, says in ((0.99, False), (1.01, True)):
        line = said(HIDING_DEPTH * over)
        assert ("hides the scene: an optical depth of 4 over 39.5 m" in line and "about 0.013 1/m" in line) is says, line
    assert not said(10, extinction=False)  # surfaces are seen
    assert not said(10, drawn=False)  # there are none
    assert not said(10, sigma_t=(0.1, 0.1, 0.01))  # blue is seen
    assert "hides" in said(np.where(np.arange(100) < 49, 3.7, 10))
    assert not said(np.where(np.arange(100) < 51, 3.7, 10))  # half may be seen, were they black


@pytest.mark.parametrize(("lit", "says"), [(4, True), (6, False)])
def test_what_shows_by_its_own_light_is_not_hidden(lit: int, says: bool) -> None:
    """Of 100 surfaces in a dense medium some send more than a contrast of .02 of what is there through it."""
    bright = (np.arange(100) < lit)[:, None]
    assert ("hides" in said(4.2, light=WHITE, own=np.where(bright, 0.021, 0.019) * WHITE)) is says
    assert ("hides" in said(4.2, light=DARK, own=np.where(bright, 7e-4, 5e-4) * WHITE)) is says  # less is black


def test_a_medium_is_too_thin_below_a_visible_contrast() -> None:
    assert "too thin to be seen" in said(0.01)
    assert not said(0.03)  # it dims what is seen
    assert not said(0.01, light=DARK + 0.05)  # a beam shows in it
    assert "too thin" in said(0.01, light=DARK + 0.01)  # not before white
    assert not said(0.01, light=DARK + 0.01, picture=DARK)  # before black
    assert "too thin" in said(0.01, light=DARK + 5e-4, picture=DARK)  # two codes
    assert not said(0.01, light=None, picture=None)
    assert not said(0.01, sigma_t=0)  # meant to be empty


def test_media_of_a_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The option alone asks for march; a medium that hides the scene says so; its cure is followed, and nothing is said."""
    out = tmp_path / "a.png"
    code, err = told(capsys, "render", "table", "--sigma-t", 3, "-o", out, *SMALL)
    assert code == 0 and err.count("\n") == 1 and "the medium hides the scene" in err
    code, err = told(capsys, "render", "table", "--sigma-t", err.rpartition("about ")[2].split()[0], "-o", out, *SMALL)
    assert (code, err) == (0, "")
    code, err = told(capsys, "render", "table", "--sigma-t", 2e-6, "-o", out, *SMALL)
    assert code == 0 and err.count("\n") == 1 and "too thin to be seen" in err


@pytest.mark.parametrize("name", ["a.####.png", "a.mp4"])
def test_of_many_frames_the_first_tells(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before the second is begun, and no other again: a film may take hours."""
    from airlight.scenes.offline import Studio

    inner, before = Studio.frame, []

    def frame(studio: Studio, *arguments: Any, **keywords: Any) -> Any:
        before.append(capsys.readouterr().err)
        return inner(studio, *arguments, **keywords)

    monkeypatch.setattr(Studio, "frame", frame)
    code, after = told(capsys, "render", "table", "--sigma-t", 3, "--turntable", 3, "-o", tmp_path / name, *SMALL)
    assert code == 0 and ["hides the scene" in text for text in (*before, after)] == [False, True, False, False]


def test_a_lamp_out_of_the_view(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A method that works on the picture says once that it draws no shafts of it, and which method does."""
    out, away = tmp_path / "a.####.png", ["--eye", "0,1,-3", "--target", "0,1,-10", "--light", "0,1,30"]
    code, err = told(capsys, "render", "table", *away, "--turntable", 8, "--frames", "1-2", "-o", out, *SMALL)
    assert code == 0 and err.count("behind the camera: method epipolar") == 1 and "--method march" in err
    code, err = told(capsys, "render", "table", *away, "--turntable", 2, "-o", out, *SMALL)  # one frame sees it
    assert code == 0 and "behind" not in err
    code, err = told(capsys, "render", "table", *away, "--method", "march", "-o", tmp_path / "b.png", *SMALL)
    assert code == 0 and "behind" not in err


@pytest.mark.parametrize("name", ["sigma_t", "albedo", "anisotropy", "steps"])
def test_options_of_a_medium_mean_something_with_march_alone(name: str) -> None:
    assert getattr(of_medium_alone([name, "samples"]), "name", "") == name
    assert of_medium_alone(["samples", "resolution", "jitter", "quality"]) is None
    assert {one.name for one in declared(scenes=True) if one.group == "medium"} <= {
        one.name for one in declared(scenes=True) if of_medium_alone([one.name])
    }


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["render", "table", "--sigma-t", "1", "--method", "radial"], "--sigma-t means nothing with method radial: leave it out, or use"),
        (["render", "table", "--sigma-t", "1", "--samples", "9"], "--samples means nothing with method march, which --sigma-t asks for"),
        (["render", "table", "--albedo", "1", "--preset", "vesper"], "with method radial, which --preset vesper asks for"),
        (["image", "a.jpg", "--sigma-t", "1"], "--sigma-t is for the air of a 3-D scene"),
        (["view", "a.jpg", "--steps", "9"], "--steps is for the air of a 3-D scene"),
    ],
)
def test_options_of_a_medium_refused(arguments: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, err = told(capsys, *arguments, *(["--screenshot"] if arguments[0] == "view" else ["-o"]), tmp_path / "out.png")
    assert code == 2 and err.count("\n") == 1 and says in err, err


def test_options_of_a_medium_in_the_api() -> None:
    with pytest.raises(AirlightError, match="sigma_t is for the air of a 3-D scene"):
        airlight.add_light_shafts(np.ones((9, 9, 3), np.float32), (0.5, 0.5), sigma_t=1)
