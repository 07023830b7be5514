"""The sectors of lines that get close lines: those where the sums of wide ones bend from line to line, and no others."""

import numpy as np
import pytest
from calling import call

from airlight.gpu.device import Device, open_device
from airlight.reference import epipolar as reference
from airlight.scatter.epipolar.detail import wedges, windows
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.epipolar.grid import QUALITY, SECTOR, Grid
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.screen import Target

SIZE = 640, 360
LIGHTS = [(-20.0, 150.0), (10.0, 100.0), (800.0, -100.0), (-1500.0, 900.0)]


def grids(light: tuple[float, float]) -> tuple[Grid, Grid]:
    mix = mixture(0.9, 3.0, 2e-3)
    close, wide = (Grid(SIZE, light, mix, 3.0, 0.9, QUALITY["normal"], "clamp", part=part) for part in ("close", "wide"))
    assert close.halves
    return close, wide


def planned(device: Device, light: tuple[float, float], picture: np.ndarray) -> tuple[EpipolarPlan, np.ndarray, np.ndarray]:
    """Carry a plan out over a picture (H, W); give it, which sectors are lit, and the layer (H, W)."""
    source, layer = (device.texture(*SIZE, "rgba16float") for _ in range(2))
    device.write(source, np.repeat(picture[..., None], 4, axis=2).astype(np.float16), SIZE[0] * 8)
    plan = EpipolarPlan(device, SIZE, light, Target(source, layer), density=0.9, lam=3.0, border="clamp", quality="normal")
    encoder = device.encoder()
    plan.record(encoder)
    device.submit(encoder)
    count = sum(q.lines // SECTOR for q in plan.passes[2].grid.quadrants)
    lit = np.frombuffer(device.queue.read_buffer(plan.passes[1].lit), np.float32)[:count] > 0
    return plan, lit, np.frombuffer(device.read(layer, 8), np.float16).reshape(SIZE[1], SIZE[0], 4)[..., 0].astype(float)


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


@pytest.mark.parametrize("light", LIGHTS)
def test_lamps_light_their_sectors(light: tuple[float, float]) -> None:
    """Single bright pixels light the sectors of their centres, in a sky of .5, and not all; the sky alone lights only those in
    corners of the picture that are too narrow to be judged."""
    device = open_device()
    picture = np.full(SIZE[::-1], 0.5)
    assert planned(device, light, picture)[1].sum() <= 8
    pixels = [(400, 300), (303, 57)]
    for x, y in pixels:
        picture[y, x] = 300
    _, lit, _ = planned(device, light, picture)
    assert all(lit[n] for x, y in pixels for n in sectors_of(light, x + 0.5, y + 0.5))
    assert 0 < lit.sum() <= max(0.5 * len(lit), 8)


@pytest.mark.parametrize("light", LIGHTS[:3])
def test_fine_detail_everywhere_lights_all(light: tuple[float, float]) -> None:
    """Whatever its brightness: noise of a pixel between .5 and 1 along the lines, which is no brighter than a sky."""
    rows, columns = np.indices(SIZE[::-1])
    x, y = columns + 0.5 - light[0], rows + 0.5 - light[1]
    turn = np.arctan2(y, x)
    # rays of the light, a pixel wide at the picture's far end
    ray = np.round((turn - turn.min()) * np.hypot(x, y).max()).astype(int)
    picture = np.random.default_rng(3).uniform(0.5, 1, ray.max() + 1)[ray]
    plan, lit, _ = planned(open_device(), light, picture)
    judged = np.zeros(len(lit), bool)
    judged[windows(plan.passes[2].grid, plan.grid)["sector"]] = True
    assert lit[judged].mean() > 0.9 and lit[~judged].mean() < 0.2


def test_a_sun_at_the_light_lights_none() -> None:
    """Wide lines are close enough there."""
    picture = np.full(SIZE[::-1], 0.5)
    _, before, _ = planned(open_device(), (10.0, 100.0), picture)
    picture[96:104, 6:14] = 100
    _, lit, _ = planned(open_device(), (10.0, 100.0), picture)
    assert np.array_equal(lit, before)


@pytest.mark.parametrize("light", [*LIGHTS[:3], (4.0, 4.8), (-400_000.0, 0.5 * SIZE[1])])
def test_close_lines_reach_every_pixel(light: tuple[float, float]) -> None:
    """Where all sectors are lit, at the picture's edges too, but for corners' pixels on the outermost line."""
    device = open_device()
    picture = np.random.default_rng(8).uniform(0.5, 1, SIZE[::-1])
    plan, _, _ = planned(device, light, picture)
    close = plan.passes[2]
    lit = plan.passes[1].lit
    device.queue.write_buffer(lit, 0, np.ones(lit.size // 4, np.float32).tobytes())
    layer = close.back.layer.texture
    device.write(layer, np.full((SIZE[1], SIZE[0], 4), 9, np.float16), SIZE[0] * 8)
    encoder = device.encoder()
    close.record(encoder)
    device.submit(encoder)
    values = np.frombuffer(device.read(layer, 8), np.float16).reshape(SIZE[1], SIZE[0], 4)[..., 0].copy()
    assert values.min() > 0 and (values > 1).sum() <= 3
    values[:: SIZE[1] - 1, :: SIZE[0] - 1] = 0
    assert values.max() <= 1


@pytest.mark.parametrize("light", LIGHTS)
def test_no_triangle_is_a_needle(light: tuple[float, float]) -> None:
    """Triangles with an end so narrow that a driver loses the row, a 200th of the wide end, begin at the light itself."""
    grid, _ = grids(light)
    corners = wedges(grid)["position"].reshape(-1, 3, 2).astype(float)
    ends = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    from_light = (np.abs(corners - grid.light) < 1e-3).all(axis=2).any(axis=1)
    widest = max(q.dm * SECTOR * q.u[-1] for q in grid.quadrants)
    assert (from_light | (ends[:, 0] > widest / 200)).all()


def test_bend() -> None:
    rng = np.random.default_rng(5)
    sums = rng.random((3, 1000, 3)).astype(np.float32)
    found = call("scatter/epipolar/detail.wgsl", "bend", list(sums))
    np.testing.assert_allclose(found, reference.bend(*sums), rtol=1e-6, atol=1e-6)


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
