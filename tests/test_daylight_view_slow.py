"""Daylight on the device over suns, altitudes and airs: against the library, and without lines, bands or numbers that are none."""

import threading
from typing import Any

import numpy as np
import pytest
from calling import call
from test_daylight_view import ELEVATIONS, LUMINANCE, SKY, bound, differences, directions, read_solid

from airlight.daylight import Atmosphere
from airlight.daylight.multiple import Orders, kept
from airlight.gpu.device import open_device
from airlight.scatter.daylight import further
from airlight.scatter.daylight.table import VIEW, ViewTable

pytestmark = pytest.mark.slow
DISTANCES = [40.0, 900, 2e4, 1e5, SKY]


@pytest.fixture(scope="module")
def table() -> ViewTable:
    return ViewTable(open_device())


@pytest.mark.parametrize("altitude, most, through", [(2, 0.01, 0.002), (3000, 0.012, 0.002), (10_000, 0.018, 0.002), (40_000, 0.05, 0.005)])
@pytest.mark.parametrize("sun", [90.0, 45, 20, 6, 2, 0.5])
def test_table_is_that_of_the_library(table: ViewTable, sun: float, altitude: float, most: float, through: float) -> None:
    air = Atmosphere()
    table.update(air, sun, altitude)
    below = np.degrees(-np.arccos(6.36e6 / (6.36e6 + altitude)))
    found = differences(table, air, sun, altitude, np.clip(ELEVATIONS + below, -90, 90), DISTANCES)
    assert found["luminance"] < most and found["typical"] < 0.005 and found["transmittance"] < through, found


@pytest.mark.parametrize("sun", [-1.0, -4, -8, -14])
def test_twilight_is_that_of_the_library(table: ViewTable, sun: float) -> None:
    air = Atmosphere()
    table.update(air, sun, 2)
    found = differences(table, air, sun, 2, ELEVATIONS, [40.0, 900, 2e4, SKY])
    assert found["luminance"] < 0.06 and found["typical"] < 0.005, found


@pytest.mark.parametrize(
    "settings", [{"visibility": 5}, {"visibility": 0.3}, {"turbidity": 8}, {"wavelengths": "rgb"}, {"multiple": "psi"}]
)
def test_airs_are_those_of_the_library(table: ViewTable, settings: dict[str, Any]) -> None:
    air = Atmosphere(**settings)
    table.update(air, 25, 100)
    found = differences(table, air, 25, 100, ELEVATIONS, DISTANCES)
    assert found["luminance"] < 0.015 and found["typical"] < 0.006, found


def test_a_moving_sun_is_that_which_stands(table: ViewTable) -> None:
    """Tables of suns that were written on the way are those that a fresh table has; what comes next is solved meanwhile."""
    air, fresh = Atmosphere(ozone=290), ViewTable(open_device())
    for sun in np.arange(9, 12.1, 0.5):
        table.update(air, float(sun), 2)
    assert all(thread.name != "daylight" or thread.daemon for thread in threading.enumerate())
    fresh.update(air, 12.0, 2)
    for one, two in zip(table.textures, fresh.textures):
        assert bytes(read_solid(one)) == bytes(read_solid(two))


def test_coming_suns_are_solved_meanwhile() -> None:
    """Of a sun that moves up those above, and down those below; of one that stands none."""
    for moves, coming in (((20.0,), []), ((20.0, 20.4), [37, 38, 39]), ((20.0, 19.6), [31, 30, 29])):
        air, tables = Atmosphere(ozone=280 + len(moves) + moves[-1] / 100), further.Further(open_device())
        for sun in moves:
            tables.update(air, sun)
        if tables.solving is not None:
            tables.solving.join()
        solved = kept(Orders, air.coefficients).suns.solved
        needed = {i for sun in moves for i in range(further.needed(sun)[0], further.needed(sun)[1] + 1)}
        assert sorted(solved - needed) == sorted(coming)


def test_suns_move_without_jumps(table: ViewTable) -> None:
    air, view = Atmosphere(), directions(np.array([0.5, 3, 20, 70]), np.array([5.0, 60, 120, 170]))
    seen = []
    suns = np.arange(0.5, 2.51, 0.1)  # over two suns of the lattice
    for sun in suns:
        table.update(air, float(sun), 2)
        found = call(VIEW, "daylight_at", [view, np.float32(SKY)], bindings=bound(table))
        seen.append((found["single"] + found["multiple"]) @ LUMINANCE)
    steps = np.diff(np.log(seen), axis=0)
    assert np.abs(np.diff(steps, axis=0)).max() < 0.02


@pytest.mark.parametrize("altitude", [0.0, 2, 300, 9000, 50_000, 100_000])
@pytest.mark.parametrize("sun", [-18.0, -6, -2, 0, 1, 3, 8, 20, 45, 80, 90])
def test_sky_has_no_line_and_no_hole(table: ViewTable, sun: float, altitude: float) -> None:
    air = Atmosphere(multiple="psi")
    table.update(air, sun, altitude)
    horizon = float(np.degrees(-np.arccos(6.36e6 / (6.36e6 + altitude))))
    away = np.concatenate([np.linspace(-90, 180, 901), np.linspace(-0.5, 0.5, 801), [sun - horizon]])
    elevation = np.unique(np.clip(horizon + away, -90, 90))
    e, a = np.meshgrid(elevation, np.linspace(-180, 180, 61), indexing="ij")
    for t in (5.0, 3e4, SKY):
        found = call(VIEW, "daylight_at", [directions(e, a), np.float32(t)], bindings=bound(table))
        assert all(np.isfinite(found[name]).all() for name in ("single", "multiple", "transmittance"))
        assert (found["transmittance"] <= 1.01).all() and (found["transmittance"] >= -0.02).all()
        light = (found["single"] + found["multiple"]) @ LUMINANCE
        assert (light >= -1e-9).all()
        np.testing.assert_allclose(light[:, :30], light[:, :30:-1], rtol=1e-3, atol=1e-7 * light.max())  # left is right
        near = np.abs(elevation - horizon) < 0.5
        if t < SKY:  # what is near crosses the horizon without a line
            logs = np.log(np.maximum(light[near], max(1e-6 * light.max(), 1e-30)))
            assert np.abs(np.diff(logs, axis=0)).max() < 0.02
