"""Humid air over ground that lies below a level: its mass, where it ends, and the ground's heights as a scene's casters tell them."""

from typing import Any

import numpy as np
import pytest

import airlight
from airlight.errors import AirlightError, AirlightWarning
from airlight.medium.basin import bake, without_narrow

pytestmark = pytest.mark.filterwarnings("error")
gfx = pytest.importorskip("pygfx")
from airlight.gpu.device import shared_device  # noqa: E402
from airlight.pygfx.basin import SIZE, Basin  # noqa: E402
from airlight.pygfx.casters import Casters  # noqa: E402
from airlight.pygfx.origin import near_origin  # noqa: E402

RANDOM = np.random.default_rng(5)


def filled(heights: np.ndarray, bounds: Any, level: float) -> float:
    """The space between the ground and the level, m^3."""
    area = np.prod(np.diff(bounds, axis=0)) / heights.size
    return float(np.nansum(np.maximum(level - heights, 0)) * area)


@pytest.mark.parametrize("cells", [16, 50, 128])
@pytest.mark.parametrize("shape", [(64, 64), (37, 90), (1, 20)])
def test_its_mass_is_the_space_up_to_the_level(cells: int, shape: tuple[int, int]) -> None:
    heights, bounds = RANDOM.uniform(-3, 5, shape), np.array([[-7, 100], [13, 140]])
    heights[RANDOM.random(shape) < 0.1] = np.nan
    for level in (float(np.nanmin(heights)) + 0.1, 0.7, 9):
        volume = airlight.basin(heights, bounds, level, 2.5, cells=cells)
        assert volume.mass == pytest.approx(2.5 * filled(heights, bounds, level), rel=1e-5)
        assert volume.density.max() <= 2.5 and volume.density.shape[2] <= cells and volume.density.shape[0] <= cells
        low, high = volume.bounds
        assert high[1] == pytest.approx(level) and low[1] == pytest.approx(np.nanmin(heights))
        assert (low[[0, 2]] >= bounds[0] - 1e-9).all()


def test_cells_hold_their_share() -> None:
    """Over a floor at 0 and a step at 1.5 that fills two of four columns, up to 2: layers of 1/8."""
    heights = np.repeat([[0.0, 0.0, 1.5, 1.5]], 4, axis=0)
    grid, matrix = bake(heights, ((0, 0), (4, 4)), 2.0, 16)
    assert grid.shape == (4, 16, 4) and matrix[1, 1] == pytest.approx(1 / 8)
    np.testing.assert_allclose(grid[:, :, :2], 1)
    np.testing.assert_allclose(grid[0, :, 2], np.arange(16) >= 12)
    grid, _ = bake(heights + [[0, 0, 0.05, 0]], ((0, 0), (4, 4)), 2.0, 16)
    np.testing.assert_allclose(grid[0, 10:14, 2], [0, 0, 0.6, 1], atol=1e-6)
    grid, matrix = bake(np.repeat(np.repeat(heights, 16, axis=0), 16, axis=1), ((0, 0), (4, 4)), 2.0, 16)
    assert grid.shape == (16, 16, 16)
    np.testing.assert_allclose(matrix @ [0, 0, 0, 1], [1 / 8, 1 / 16, 1 / 8, 1])


def test_what_is_narrow_is_no_ground() -> None:
    heights = np.zeros((60, 80))
    heights[:, 30:34], heights[10:50, 60:80], heights[5, 5], heights[40, :20] = 9, 3, 7, np.nan
    found = without_narrow(heights, 8)
    assert np.isnan(found[40, :20]).all()
    known = np.isfinite(heights)
    np.testing.assert_array_equal(found[known], np.where(heights == 3, 3.0, 0.0)[known])
    slope = RANDOM.random((20, 20)).cumsum(axis=0)
    for width in (1, 3, 8, 100):
        opened = without_narrow(slope, width)
        assert (opened <= slope).all()
        np.testing.assert_allclose(without_narrow(opened, width), opened)  # once is enough
    side = min(5, 20)
    windows = np.lib.stride_tricks.sliding_window_view(slope, (side, side)).min(axis=(2, 3))
    by_hand = [[windows[max(i - 4, 0) : i + 1, max(j - 4, 0) : j + 1].max() for j in range(20)] for i in range(20)]
    np.testing.assert_array_equal(without_narrow(slope, 5), by_hand)


@pytest.mark.parametrize(
    "more, line",
    [
        ({"ground": np.zeros(5)}, r"heights have the shape \(5,\); give"),
        ({"bounds": ((0, 0), (0, 1))}, "bounds are no rectangle"),
        ({"bounds": ((0, 0), (np.nan, 1))}, "bounds are no rectangle"),
        ({"cells": 4}, "cells = 4; give 16 to 512"),
        ({"density": -1}, "density = -1; give 0"),
        ({"level": 1e-13}, "no ground lies below the level 1e-13 m"),
        ({"level": -2}, "no ground lies below the level -2 m: the lowest is at 0 m; give a higher level"),
    ],
)
def test_what_cannot_be(more: dict[str, Any], line: str) -> None:
    given = {"ground": np.zeros((4, 4)), "bounds": ((0, 0), (1, 1)), "level": 1.0, **more}
    with pytest.raises(AirlightError, match=line):
        airlight.basin(**given)


# ---------------------------------------------------------------- a scene


def box(size: tuple[float, float, float], at: tuple[float, float, float], **more: Any) -> Any:
    mesh = gfx.Mesh(gfx.box_geometry(*size), gfx.MeshBasicMaterial(color="#888", **more))
    mesh.local.position = at
    return mesh


def valley() -> tuple[Any, Casters]:
    """A floor of 40 by 20 m at y = 1, between two hills of 8 and 12 m width whose tops lie at 5; a thin mast on the floor."""
    scene = gfx.Scene()
    scene.add(box((40, 1, 20), (0, 0.5, 0)), box((8, 5, 20), (-16, 2.5, 0)))
    scene.add(box((12, 5, 20), (14, 2.5, 0)), box((0.3, 9, 0.3), (2, 4.5, 3)))
    return scene, Casters(shared_device().device, scene)


def test_a_valley_of_two_boxes() -> None:
    _, casters = valley()
    found = Basin(casters).ground(casters.gather())
    assert found is not None
    heights, bounds = found
    x = bounds[0, 0] + (np.arange(SIZE) + 0.5) / SIZE * np.ptp(bounds[:, 0])
    z = bounds[0, 1] + (np.arange(SIZE) + 0.5) / SIZE * np.ptp(bounds[:, 1])
    inside, texel = (np.abs(z) < 9.9)[:, None] & (np.abs(x) < 19.9), 42 / SIZE
    expected = np.where((x > -12 + texel) & (x < 8 - texel), 1.0, 5.0)[None, :] + np.zeros((SIZE, 1))
    sure = inside & ((np.abs(x + 12) > texel) & (np.abs(x - 8) > texel))[None, :]
    np.testing.assert_allclose(heights[sure], expected[sure], atol=1e-4)
    assert np.isnan(heights[np.abs(z) > 10.1]).all()
    field = Basin(casters).field(casters.gather(), 3.0, 0.5, 64)
    assert field is not None and field.blend == "add" and field.factor == 0.5
    assert field.volume.mass == pytest.approx(20 * 20 * 2, rel=0.01)
    np.testing.assert_allclose(field.volume.bounds, [[-12, 1, -10], [8, 3, 10]], atol=0.7)
    middle = field.volume.density[10:-10, :, 10:-10]
    np.testing.assert_allclose(middle, 1, atol=1e-3)  # under the mast's top, too


def test_it_is_drawn_once_while_the_scene_is_still() -> None:
    scene, casters = valley()
    basin = Basin(casters)
    drawn: list[int] = []
    draw = casters.draw_layers
    casters.draw_layers = lambda *given: (drawn.append(1), draw(*given))[1]  # type: ignore[method-assign, misc]
    casters.still = "so"
    first = basin.field(casters.gather(), 3.0, 1.0)
    mast, hill = scene.children[3], scene.children[2]
    mast.local.x = 4  # narrow
    assert basin.field(casters.gather(), 3.0, 1.0) is first and len(drawn) == 1
    other = basin.field(casters.gather(), 2.0, 1.0)
    assert other is not first and len(drawn) == 1
    hill.local.x = 16
    moved = basin.field(casters.gather(), 2.0, 1.0)
    assert moved.volume.mass > 1.05 * other.volume.mass and len(drawn) == 2
    casters.still = None
    for count in (3, 3):  # meshes that deform are alone looked at in each frame, then
        assert basin.field(casters.gather(), 2.0, 1.0) is moved and len(drawn) == count
    floor = scene.children[0].geometry.positions
    floor.data[:, 1] += np.where(floor.data[:, 1] > 0, 0.5, -0.5)
    floor.update_full()
    assert basin.field(casters.gather(), 2.0, 1.0).volume.mass < 0.6 * moved.volume.mass and len(drawn) == 4
    assert basin.field(casters.gather(), None, 1.0) is None is basin.field(casters.gather(), 2.0, 0.0)


def test_a_plain_without_end_is_looked_at_as_far_as_one_sees() -> None:
    scene, casters = valley()
    scene.add(box((9000, 0.1, 9000), (0, 0.6, 0)))
    basin = Basin(casters)
    coarse = basin.field(casters.gather(), 3.0, 1.0)
    assert np.ptp(coarse.volume.bounds[:, 0]) > 8999
    near = basin.field(casters.gather(), 3.0, 1.0, 128, ((3, 2, -4), 40.0))
    np.testing.assert_allclose(near.volume.bounds, [[-50, 0.65, -50], [50, 3, 50]], atol=0.5)
    assert near.volume.mass == pytest.approx(20 * 20 * 2 + ((100 * SIZE / (SIZE - 3)) ** 2 - 800) * 2.35, rel=2e-3)
    assert basin.field(casters.gather(), 3.0, 1.0, 128, ((5, 2, -9), 40.0)) is near
    assert basin.field(casters.gather(), 3.0, 1.0, 128, ((15, 2, -9), 40.0)).volume.bounds[0, 0] == pytest.approx(-30, abs=0.5)


def test_where_no_ground_lies_below_a_line_says_so() -> None:
    scene, casters = valley()
    basin = Basin(casters)
    with pytest.warns(AirlightWarning, match="basin_level = 0.5: no ground lies below it: the lowest is at 1 m; give a higher one"):
        assert basin.field(casters.gather(), 0.5, 1.0) is None
    assert basin.field(casters.gather(), 0.25, 1.0) is None  # said once
    scene.clear()
    with pytest.warns(AirlightWarning, match="there is no ground"):
        assert Basin(casters).field(casters.gather(), 0.5, 1.0) is None


def test_where_a_scene_is_drawn_near_the_origin_it_stays_in_the_world() -> None:
    scene, casters = valley()
    basin, camera = Basin(casters), gfx.PerspectiveCamera()
    near = basin.field(casters.gather(), 3.0, 1.0)
    for child in scene.children:
        child.local.position = np.add(child.local.position, (4e6, 1000, -2e6))
    with near_origin(scene, camera, (4e6, 1000, -2e6)):
        far = basin.field(casters.gather(), 1003.0, 1.0)
    np.testing.assert_allclose(far.volume.bounds - near.volume.bounds, [(4e6, 1000, -2e6)] * 2, atol=1e-3)
    assert far.volume.mass == pytest.approx(near.volume.mass, rel=1e-3)
