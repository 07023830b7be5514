"""The whole way, from a glTF file through pygfx, shadow maps and the march, against the float64 tracer over the same triangles, and
against Mitsuba."""

import pytest

pytest.importorskip("pygfx")
import validating

from airlight.scenes import VALIDATION


@pytest.mark.parametrize("name", ["window", "mirrored", "headlamp"])
def test_a_small_picture_is_that_of_the_tracer(name: str) -> None:
    drawn = validating.draw(name, 96, 54, shadow_size=2048)
    rmse, bias = validating.error(drawn.layer, *drawn.traced())
    assert rmse < 0.01
    assert abs(bias) < 0.005


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", VALIDATION)
def test_every_scene_is_that_of_the_tracer(name: str) -> None:
    drawn, truth, way = validating.exact(name)
    rmse, bias = validating.error(drawn.layer, truth, way)
    assert rmse < 0.006
    assert abs(bias) < 0.001


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", VALIDATION)
def test_every_scene_is_that_of_mitsuba(name: str) -> None:
    for tracers in (False, True):
        found = validating.error_by_mitsuba(name, tracers)
        assert found.rmse < 0.02
        assert abs(found.bias) < 0.01
        assert found.unsure < 0.003
