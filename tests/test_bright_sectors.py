"""The sectors of lines that get close lines: those that meet something bright, and no others."""

import numpy as np
import pytest

from airlight.gpu.device import Device, open_device
from airlight.scatter.epipolar.bright import BrightSectors
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.epipolar.grid import QUALITY, SECTOR, Grid
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.screen import Target

SIZE = 640, 360


def grids(light: tuple[float, float]) -> tuple[Grid, Grid]:
    mix = mixture(0.9, 3.0, 2e-3)
    close, wide = (Grid(SIZE, light, mix, 3.0, 0.9, QUALITY["normal"], "clamp", part=part) for part in ("close", "wide"))
    assert close.halves
    return close, wide


def lit_sectors(device: Device, light: tuple[float, float], at: list[tuple[int, int]]) -> tuple[Grid, np.ndarray]:
    """Find which sectors are lit by single pixels at (x, y) of radiance 100, in a sky of .5."""
    close, wide = grids(light)
    picture = np.full((SIZE[1], SIZE[0], 4), 0.5, np.float16)
    for x, y in at:
        picture[y, x] = 100
    source = device.texture(*SIZE, "rgba16float")
    device.write(source, picture, SIZE[0] * 8)
    found = BrightSectors(device, close, wide, source, 0)
    encoder = device.encoder()
    found.record(encoder)
    device.submit(encoder)
    return close, np.frombuffer(device.queue.read_buffer(found.lit), np.float32) > 0


def sectors_of(light: tuple[float, float], x: float, y: float) -> set[int]:
    """Number the sectors whose lines pass a position, pixels, where wide lines are not close enough."""
    numbers = set()
    grid, wide = grids(light)
    near = {(q.axis, q.sign): wide.near(q) for q in wide.quadrants}
    for q in grid.quadrants:
        u = q.sign * ((x, y)[q.axis] - grid.light[q.axis])
        if u > near[q.axis, q.sign]:
            sector = ((y, x)[q.axis] - grid.light[1 - q.axis] - q.m_lo * u) / (q.dm * u * SECTOR)
            if 0 <= sector < q.lines // SECTOR:
                numbers.add(q.sector0 + int(sector))
    return numbers


@pytest.mark.parametrize("light", [(-20.0, 150.0), (10.0, 100.0), (800.0, -100.0), (-40_000.0, 30_000.0)])
def test_pixels_light_their_sectors(light: tuple[float, float]) -> None:
    """Each bright pixel lights the sectors of its corners; a picture without one lights none, two of them not all."""
    device = open_device()
    pixels = [(400, 300), (303, 17)]
    _, lit = lit_sectors(device, light, pixels)
    for x, y in pixels:
        for corner in ((x - 0.5, y - 0.5), (x + 1.5, y - 0.5), (x - 0.5, y + 1.5), (x + 1.5, y + 1.5)):
            assert all(lit[n] for n in sectors_of(light, *corner))
    assert 0 < lit.sum() <= max(0.5 * len(lit), 8)
    assert not lit_sectors(device, light, [])[1].any()


def test_a_sun_at_the_light_lights_none() -> None:
    """Wide lines are close enough there."""
    device = open_device()
    assert not lit_sectors(device, (10.0, 100.0), [(10, 100), (13, 104)])[1].any()


def test_one_grid_suffices_elsewhere() -> None:
    """A light well inside, rays past the light and other qualities have one."""
    device = open_device()
    source, layer = (device.texture(*SIZE, "rgba16float") for _ in range(2))
    for light, density, quality, passes in (
        ((300.0, 200.0), 0.9, "normal", 1),
        ((700.0, 200.0), 0.9, "normal", 3),
        ((700.0, 200.0), 1.5, "normal", 1),
        ((700.0, 200.0), 0.9, "final", 1),
    ):
        plan = EpipolarPlan(device, SIZE, light, Target(source, layer), density=density, lam=3.0, border="clamp", quality=quality)
        assert len(plan.passes) == passes
