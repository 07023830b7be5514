"""The whole way, from a glTF file through pygfx, shadow maps and the march, against the float64 tracer over the same triangles, and
against Mitsuba."""

import pytest

pytest.importorskip("pygfx")
import numpy as np
import validating
from rasterising import edge_error

from airlight.options import March, Medium, Parameters, SceneOptions, build
from airlight.scenes import VALIDATION, open_scene
from airlight.scenes.offline import Shot, Studio


@pytest.mark.parametrize("name", ["window", "mirrored", "headlamp", "mist-lamp"])
def test_a_small_picture_is_that_of_the_tracer(name: str) -> None:
    width = 64 if name in validating.VARYING + validating.SEEN_THROUGH else 96
    drawn = validating.draw(name, width, width * 9 // 16, shadow_size=2048)
    rmse, bias = validating.error(drawn.layer, *drawn.traced())
    assert rmse < 0.0095 + 0.1 * edge_error()  # edges of shadows
    assert abs(bias) < 0.005


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", VALIDATION)
def test_every_scene_is_that_of_the_tracer(name: str) -> None:
    drawn, truth, way = validating.exact(name)
    rmse, bias = validating.error(drawn.layer, truth, way)
    fine = name in (*validating.VARYING, "stained", "gobo", "leaves")  # of a smaller picture, of lead or of a cookie there are more edges
    assert rmse < (0.01 if fine else 0.006)
    assert abs(bias) < (0.003 if name in validating.VARYING else 0.001)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", [name for name in VALIDATION if name not in validating.NOT_OF_MITSUBA])
def test_every_scene_is_that_of_mitsuba(name: str) -> None:
    for tracers in (False, True):
        found = validating.error_by_mitsuba(name, tracers)
        assert found.rmse < 0.02
        assert abs(found.bias) < 0.01
        assert found.unsure < 0.003


def stepped(name: str, width: int, height: int, time: float = 0.0, by: int | str = 64, quality: str = "normal") -> float:
    """The rmse over the mean of 64 steps at half the resolution, whole pictures, from the exact walk at all of it. by: instead of 64."""
    stage, found = open_scene(name), []
    for steps, resolution in (("exact", 1.0), (by, 0.5)):
        built = build(stage.settings | {"method": "march", "steps": steps, "quality": quality, "shadow_size": 2048})
        more = {"medium": built[Medium], "march": built[March], "in_scene": SceneOptions(resolution=resolution)}
        studio = Studio(stage, Shot(width, height, samples=1), built[Parameters], **more)
        found.append(studio.frame(time, layer=True).layer[..., :3].astype(float))
    return float(np.sqrt(np.mean((found[1] - found[0]) ** 2)) / found[0].mean())


def test_steps_at_half_the_resolution_are_near_the_walk() -> None:
    assert stepped("foliage-view", 320, 180) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("name", "time"), [("foliage-view", 0), ("foliage-beside", 0), ("foliage-behind", 0), ("flying", 20.2)])
def test_steps_at_half_the_resolution_of_a_picture_are_near_the_walk(name: str, time: float) -> None:
    assert stepped(name, 640, 360, time) < 0.03


def test_a_table_is_near_the_walk() -> None:
    assert stepped("foliage-view", 320, 180, by="table") < 0.025


@pytest.mark.slow
@pytest.mark.parametrize(("quality", "most"), [("draft", 0.025), ("normal", 0.021), ("final", 0.018)])
@pytest.mark.parametrize("name", ["foliage-view", "foliage-beside", "foliage-behind", "window"])
def test_a_table_for_a_picture_is_near_the_walk(name: str, quality: str, most: float) -> None:
    assert stepped(name, 640, 360, by="table", quality=quality) < most
