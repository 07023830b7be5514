"""A day of a scene in frames: no flicker, and all commands of the guide's kind end in pictures."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from airlight.cli import cli
from airlight.daylight import Atmosphere
from airlight.files import read_image
from airlight.options import March, Medium, Parameters
from airlight.scenes import open_scene
from airlight.scenes.daylight import Daylight
from airlight.scenes.offline import Shot, Studio


@pytest.mark.slow
def test_the_frames_of_a_day_do_not_flicker() -> None:
    """From 14 degrees to sunset: the mean of a picture changes evenly, where neither shadows nor the camera move."""
    stage = open_scene("table")
    Daylight(Atmosphere(visibility=20), lambda time: (180.0, 14.0 - time), span=(0.0, 14.0)).put(stage)
    medium = Medium(sigma_t=(0.0, 0.0, 0.0))
    studio = Studio(stage, Shot(64, 36, 1), Parameters(method="march", quality="draft"), medium=medium, march=March())
    assert studio.follows
    frames = [studio.frame(time) for time in np.arange(0, 14.01, 0.5)]
    means = np.log2([float(frame.pixels().mean()) for frame in frames])
    assert np.abs(np.diff(means)).max() < 0.35  # stops, of half a degree
    assert np.abs(np.diff(means, 2)).max() < 0.15
    exposures = np.log2([frame.exposure for frame in frames])
    assert (np.diff(exposures) > 0).all()  # the lower the sun, the longer


@pytest.mark.slow
def test_a_night_of_a_film_that_is_day_halfway_is_that_night() -> None:
    """Its radiances are scaled by what suits it: by what suits the day half floats would hold none of it."""
    pictures = []
    for span in ((0.0, 2.0), None):
        stage = open_scene("table")
        Daylight(Atmosphere(visibility=20), lambda time: (180.0, -12.0 if time == 0 else 40.0), span=span).put(stage)
        medium = Medium(sigma_t=(0.0, 0.0, 0.0))
        parameters = Parameters(method="march", quality="draft")
        studio = Studio(stage, Shot(64, 36, 1), parameters, medium=medium, march=March(), linear=True)
        pictures.append(studio.frame(0.0).pixels())
    film, alone = pictures
    # not of the lantern's glass, which stands for what a display shows
    assert alone.mean() > 0 and np.quantile(np.abs(film - alone) / np.maximum(alone, 1e-9), 0.9) < 0.01


@pytest.mark.slow
def test_commands(tmp_path: Path) -> None:
    def run(*words: str) -> str:
        found = CliRunner().invoke(cli, ["render", "table", "--width", "32", "--quality", "draft", "-y", *words])
        assert found.exit_code == 0, found.output
        return found.output

    pattern = str(tmp_path / "f.####.png")
    run("--daylight", "air", "--day", "2026-06-21", "--where", "47.4,11", "--frames", "1-3", "-o", pattern)
    pixels = [read_image(str(tmp_path / f"f.{k:04}.png")).linear() for k in (1, 2, 3)]
    assert all(one.mean() > 0.005 for one in pixels) and pixels[1].mean() > pixels[0].mean()
    path = str(tmp_path / "a.exr")
    run("--daylight", "air", "--sun", "150,20", "-o", path)
    light = read_image(path).linear()
    assert 300 < np.median(light) < 30_000  # cd/m2, of a sunlit wall and floor
    for method, *more in (("march", "--sigma-t", "0.01"), ("epipolar",), ("slices",)):
        run("--daylight", "air", "--sun", "150,20", "--method", method, *more, "-o", str(tmp_path / f"{method}.png"))
