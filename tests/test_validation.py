"""The whole way, from a glTF file through pygfx, shadow maps and the march, against the float64 tracer over the same triangles."""

import numpy as np
import pytest

pytest.importorskip("pygfx")
from airlight import presets
from airlight.parameters import March, Medium, Parameters
from airlight.pygfx.lamps import lamps
from airlight.reference import tracer
from airlight.reference.triangles import world_triangles
from airlight.scenes import VALIDATION, open_scene
from airlight.scenes.offline import Shot, Studio

EDGE = 0.05  # ratio of distances of neighbours between which there is an edge


def compared(name: str, width: int, height: int, **values: object) -> tuple[float, float]:
    """(rmse, bias) over the mean, one sample at pixel centres, without the pixels within 2 of an edge of depth and the worst 1 % of the
    rest (the bias with them)."""
    stage = open_scene(name)
    built = presets.build(stage.settings | {"method": "march", "quality": "final"} | values)
    studio = Studio(stage, Shot(width, height, samples=1), built[Parameters], medium=built[Medium], march=built[March])
    found = studio.frame(layer=True).layer[..., :3].astype(float)
    seen, casting = world_triangles(stage.scene, stage.lights)
    camera = studio.camera
    truth, way = tracer.layer(
        camera.view_matrix, camera.projection_matrix, (width, height), seen, lamps(stage.lights), studio.shafts.air, casting
    )
    logs, edges = np.log(way), np.zeros(way.shape, bool)
    for axis in (0, 1):
        step = np.abs(np.diff(logs, axis=axis)) > EDGE
        edges |= np.insert(step, 0, False, axis=axis) | np.insert(step, step.shape[axis], False, axis=axis)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(edges, 2), (5, 5)).any(axis=(2, 3))
    off, mean = (found - truth)[~near], truth[~near].mean()
    worst = np.abs(off).mean(axis=1)
    kept = off[worst <= np.quantile(worst, 0.99)]
    return float(np.sqrt(np.mean(kept**2)) / mean), float(off.mean() / mean)


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
