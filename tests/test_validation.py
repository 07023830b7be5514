"""The whole way, from a glTF file through pygfx, shadow maps and the march, against the float64 tracer over the same triangles."""

import numpy as np
import pytest

pytest.importorskip("pygfx")
from airlight import presets
from airlight.compare import rule
from airlight.parameters import InScene, March, Medium, Parameters
from airlight.pygfx.lamps import lamps
from airlight.reference import tracer
from airlight.reference.triangles import world_triangles
from airlight.scenes import VALIDATION, open_scene
from airlight.scenes.offline import Shot, Studio


def compared(name: str, width: int, height: int, **values: object) -> tuple[float, float]:
    """(rmse, bias) over the mean, by the rule of `airlight compare`, one sample at pixel centres."""
    stage = open_scene(name)
    built = presets.build(stage.settings | {"method": "march", "quality": "final"} | values)
    studio = Studio(stage, Shot(width, height, samples=1), built[Parameters], medium=built[Medium], march=built[March])
    found = studio.frame(layer=True).layer[..., :3].astype(float)
    seen, casting = world_triangles(stage.scene, stage.lights)
    camera = studio.camera
    truth, way = tracer.layer(
        camera.view_matrix, camera.projection_matrix, (width, height), seen, lamps(stage.lights), studio.shafts.air, casting
    )
    found_errors = rule.errors(found, truth, rule.clear(way))
    return found_errors.rmse, found_errors.bias


@pytest.mark.parametrize("name", ["window", "mirrored", "headlamp"])
def test_a_small_picture_is_that_of_the_tracer(name: str) -> None:
    rmse, bias = compared(name, 96, 54, shadow_size=2048)
    assert rmse < 0.01
    assert abs(bias) < 0.005


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", VALIDATION)
def test_every_scene_is_that_of_the_tracer(name: str) -> None:
    rmse, bias = compared(name, 480, 270)
    assert rmse < 0.006
    assert abs(bias) < 0.001


def stepped(name: str, width: int, height: int, time: float = 0.0) -> float:
    """The rmse over the mean of 64 steps at half the resolution, whole pictures, from the exact walk at all of it."""
    stage, found = open_scene(name), []
    for steps, resolution in (("exact", 1.0), (64, 0.5)):
        built = presets.build(stage.settings | {"method": "march", "steps": steps})
        more = {"medium": built[Medium], "march": built[March], "in_scene": InScene(resolution=resolution)}
        studio = Studio(stage, Shot(width, height, samples=1), built[Parameters], **more)
        found.append(studio.frame(time, layer=True).layer[..., :3].astype(float))
    return float(np.sqrt(np.mean((found[1] - found[0]) ** 2)) / found[0].mean())


def test_steps_at_half_the_resolution_are_near_the_walk() -> None:
    assert stepped("foliage-view", 320, 180) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("name", "time"), [("foliage-view", 0), ("foliage-beside", 0), ("foliage-behind", 0), ("flying", 20.2)])
def test_steps_at_half_the_resolution_of_a_picture_are_near_the_walk(name: str, time: float) -> None:
    assert stepped(name, 640, 360, time) < 0.03
