"""The whole way, from a glTF file through pygfx, shadow maps and the march, against the float64 tracer over the same triangles."""

import pytest

pytest.importorskip("pygfx")
from airlight import presets
from airlight.compare import rule
from airlight.parameters import March, Medium, Parameters
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
