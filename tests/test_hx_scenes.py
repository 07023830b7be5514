"""Settings from Hx Volumetric Lighting in whole scenes: variance shadow maps that are kept while nothing moves, a light's own density."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("pygfx")
import validating
from test_kept_maps import Hall

from airlight.options import March
from airlight.scatter.march import variance
from airlight.scenes import open_scene

SOFT = March(shadow_size=64, steps=16, cascades=2, shadow_filter="variance")


def hall(still: Any) -> Hall:
    made = Hall(still)
    made.shafts.march = SOFT
    return made


@pytest.mark.slow
def test_moments_are_made_anew_only_where_something_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    compute = variance.compute
    monkeypatch.setattr(variance, "compute", lambda *what: (made.append(what[4]), compute(*what)))
    for still, again in (((), 0), (None, 6)):
        room = hall(still)
        first = room.picture()
        assert len(made) == 6  # rows and columns of three lights
        made.clear()
        assert np.array_equal(room.picture(), first) and len(made) == again
        made.clear()
        room.cube.local.position = (1.2, 0.3, 0.1)
        moved, once = room.picture(), len(made)
        made.clear()
        other = hall(None)
        other.cube.local.position = (1.2, 0.3, 0.1)
        assert np.array_equal(moved, other.picture()) and once == 6 and not np.array_equal(moved, first)
        made.clear()


@pytest.mark.slow
def test_a_lights_own_density_in_a_program() -> None:
    """It may change at any time, and does nothing to surfaces."""
    room = Hall()
    plain = room.picture()
    for light in room.shafts.lights:
        light.density = 3.0
    dense = room.picture()
    assert np.abs(dense - plain).max() > 0.03
    for light in room.shafts.lights:
        light.density = 0.0
    dark = room.picture()
    room.shafts.lights[:] = []
    assert np.abs(dark - room.picture()).max() < 1e-3
    assert dark.mean() < plain.mean() < dense.mean()


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("name", "values", "factors"),
    [
        ("foliage-beside", {"sun_distance": 20.0, "sun_glow": 0.4, "sun_glow_size": 60.0}, (1.0, 1.0)),
        ("foliage-view", {"sun_glow": 0.2, "sun_glow_size": 3.0, "fog": "exponential", "fog_depth": 4.0}, (2.0, 0.5)),
        ("two-spots", {"fog": "linear", "fog_depth": 6.0}, (2.0, 0.25)),
        ("cage", {"ambient": (0.02, 0.02, 0.03)}, (0.5, 3.0)),
    ],
)
def test_a_picture_with_them_is_that_of_the_tracer(name: str, values: Any, factors: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """factors: density and extinction of the first light alone."""

    def stage(name: str) -> Any:
        made = open_scene(name)
        made.lights[0].density, made.lights[0].extinction = factors
        return made

    monkeypatch.setattr(validating, "open_scene", stage)
    drawn = validating.draw(name, 240, 135, **values)
    assert (drawn.lamps[0].density, drawn.lamps[0].extinction) == factors
    rmse, bias = validating.error(drawn.layer, *drawn.traced())
    assert rmse < 0.01 and abs(bias) < 0.005
