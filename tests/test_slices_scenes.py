"""Slices in scenes: light through glass takes its colour there too, and what a method leaves out of a scene is told."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airlight.cli import main
from airlight.errors import AirlightWarning
from airlight.medium.resolve import AMID
from airlight.options import March, Parameters
from airlight.scatter.methods import METHODS, WINDOWS, of_medium

gfx = pytest.importorskip("pygfx")
from test_coloured_glass import BEHIND_GAP, BLUE, GREEN, RED, spot, tinted  # noqa: E402
from test_panes import SIZE, WALL, Stage, light, lying, mesh, shining, square  # noqa: E402

from airlight.pygfx import LightShafts  # noqa: E402


def by_slices(shafts: LightShafts, planes: int) -> LightShafts:
    """With maps as the exact walk has, each pixel by itself."""
    shafts.parameters = Parameters(method="slices")
    shafts.march = March(planes=planes, plane_cell=1, shadow_size=2048, steps="exact")
    return shafts


@pytest.mark.filterwarnings("ignore:method slices leaves out where in the air glass stands")
def test_a_suns_light_takes_the_colours_of_panes_in_a_row(stage: Stage) -> None:
    """Above the view, red between 2 and 6 m, blue between 4 and 8 m; white without them, and where shadows are left out."""
    for z, colour in (((2, 6), RED), ((4, 8), BLUE)):
        stage.scene.add(tinted(lying(11 + z[0] / 2, *z), colour))
    red, blue = np.array(RED), np.array(BLUE)
    parts = [(0, 2, 1.0), (2, 4, red), (4, 6, red * blue), (6, 8, blue), (8, WALL, 1.0)]
    expected = sum(left * (light(end) - light(begin)) for begin, end, left in parts)
    layer = stage.seen(by_slices(stage.shafts(), 512))[1]
    np.testing.assert_allclose(layer.mean(axis=(0, 1)), expected, rtol=0.01)
    none = stage.seen(by_slices(stage.shafts(transparency="none"), 512))[1]
    np.testing.assert_allclose(none.mean(axis=(0, 1)), light(WALL), rtol=0.01)


@pytest.mark.filterwarnings("ignore:method slices leaves out where in the air glass stands")
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spot", "point"])
def test_a_lamps_light_takes_the_colours_of_a_gap(stage: Stage, kind: str) -> None:
    """As in the exact walk, which is held to the tracer."""
    stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    solid = np.concatenate([square(40, 20, (0, 0, -9)), *(square(6, 9, (-6.5, 0, z), 90) for z in (-1.5, -8.5))])
    glass = [(square(3, 3, (-6.3, 1.5, -5), 90), RED), (square(0.9, 9, (-6.1, 0, -5), 90), BLUE), (square(3, 3, (-6.2, -1, -5), 90), GREEN)]
    stage.scene = gfx.Scene()
    stage.scene.add(mesh(solid, color="#000"), *(tinted(*one) for one in glass))
    sent = BEHIND_GAP if kind == "point" else spot()
    if sent.target is not None:
        stage.scene.add(sent.target)
    walked = stage.seen(shining(stage, sent, "exact"))[1]
    sliced = stage.seen(by_slices(shining(stage, sent, "exact"), 1024))[1]
    np.testing.assert_allclose(sliced.mean(axis=(0, 1)), walked.mean(axis=(0, 1)), rtol=0.02)
    assert np.sqrt(np.mean((sliced - walked) ** 2)) < 0.04 * walked.mean()
    assert np.ptp(walked.mean(axis=(0, 1))) > 0.1 * walked.mean()  # of no grey


# ---------------------------------------------------------------- what is left out


@pytest.mark.parametrize("method", [name for name in of_medium() if METHODS[name].lights != WINDOWS and not METHODS[name].follows_fields])
def test_programs_are_told_once_what_a_method_leaves_out(stage: Stage, method: str) -> None:
    """Noise, and what glass takes from light where it does not follow that; nothing of a scene that has neither."""
    stage.scene.add(mesh(square(40, 20, (0, 0, -9)), color="#444"))
    whole, noisy = ({"noise_amount": amount, "noise_size": 1.0} for amount in (0.0, 0.5))
    panes: list[tuple[Any, ...]] = [(), (tinted(lying(11, 2, 6), RED),)]
    for values, glass in ((whole, panes[0]), (noisy, panes[0]), (whole, panes[1]), (noisy, panes[1])):
        stage.scene.add(*glass)
        shafts = stage.shafts(steps=8, **values)
        shafts.parameters, shafts.exclude = Parameters(method=method), ()
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            stage.draw()
            stage.draw()
        of_noise = [] if values is whole else ["noise in the air"]
        of_glass = [] if not glass else [AMID] if METHODS[method].follows_glass else ["what glass takes from light"]
        lines = [str(one.message) for one in seen if issubclass(one.category, AirlightWarning)]
        lacks = " and ".join((*of_noise, *of_glass))
        assert lines == ([f"method {method} leaves out {lacks}, which this scene has: method march follows all of it"] if lacks else [])


def test_commands_tell_what_a_method_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a medium of a file, whose noise nobody asked this method for by name."""
    (tmp_path / "noisy.toml").write_text("noise_amount = 0.5\n")
    run = ["render", "slats", "--method", "slices", "--medium", str(tmp_path / "noisy.toml"), "--width", "32", "--height", "18"]
    assert main([*run, "-y", "-o", str(tmp_path / "out.png")]) == 0
    (line,) = re.findall("airlight: warning: (.*)", capsys.readouterr().err)
    assert line == "method slices leaves out noise in the air, which this scene has: method march follows all of it"
