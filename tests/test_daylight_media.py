"""Daylight's shadows in the air: volumes, fog and glass take sunlight as walls do, and steps and the exact walk against float64."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from calling import call
from test_daylight_scene import AIR, AZIMUTH, ELEVATION, EYE, RADIUS, SIZE, UNIT, camera, filled, rays, read

from airlight.files.volumes import Volume
from airlight.files.volumes.volume import between
from airlight.gpu.device import Device, shared_device
from airlight.lights.directional import DirectionalLight
from airlight.medium.field import Field
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.reference import march_air
from airlight.reference.panes import pack_left
from airlight.scatter.march.daylight import AirLayer, Sun
from airlight.scatter.march.march import March as MarchPlan
from airlight.scenes.daylight import sun_direction
from airlight.shadows import Shadow

TO_SUN = np.asarray(sun_direction(AZIMUTH, ELEVATION))
SLAB = np.array([[-900.0, 300.0, -1400.0], [700.0, 330.0, -100.0]])  # m, of a volume
PIXELS = ((3, 4), (10, 20), (16, 8), (24, 2), (30, 24), (44, 12))  # left and top, of rays that are looked at


@pytest.fixture(scope="module")
def device() -> Device:
    return shared_device()


def missing(device: Device, quality: str, medium: Medium, density: float = 0.0, held: float = 0.0, glass: Any = None) -> np.ndarray:
    """Find what sunlight the air lacks, (H, W, 3), under a sun whose map holds one depth, in a medium with a slab of a density."""
    eye = camera()
    view, projection = (np.asarray(one, float) for one in (eye.view_matrix, eye.projection_matrix))
    resolved = resolve(medium, March(cascades=1, shadow_size=2048), quality, RADIUS)
    if density:
        full = np.full((2, 8, 8), density, np.float32)
        slab = Volume(full, between(SLAB, full.shape), 0.5, "")
        resolved = resolve(medium, March(cascades=1, shadow_size=2048), quality, RADIUS, fields=[Field(slab)])
    light = DirectionalLight((1.0, 1.0, 1.0), tuple(TO_SUN))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (0, 0.4) for z in (-1, 1)]) * RADIUS
    views = light.shadow_views(view, projection, corners[None], replace(resolved, shadow_size=64))
    shadow = Shadow(filled(device, held, (64, 64, 1)), 64, views)
    if glass is not None:
        side = 16
        shadow.glass, shadow.coloured = device.buffer(np.tile(glass, side * side).astype(np.uint32).tobytes()), len(glass) == 8
        shadow.glass_side = side
    depth = filled(device, 1.0, (*SIZE, 1))
    sun = Sun(AIR, TO_SUN, ELEVATION, UNIT, (0.0, 0.0, 0.0), EYE)
    march = MarchPlan(device, SIZE)
    march.update(view, projection, [(light, shadow)], resolved)
    found = []
    for lit in (False, True):
        layer = AirLayer(device, SIZE)
        shadowed = {"light": light, "shadow": shadow, "dimming": march.dimming(light)} if lit else {}
        layer.update(view, projection, sun, resolved, jitter="fixed", **shadowed)
        encoder = device.encoder()
        march.record(encoder, depth)
        layer.record(encoder, depth)
        device.submit(encoder)
        found.append(read(device, layer.layer)[..., :3].astype(float))
    return found[0] - found[1]


def expected(left: Any, count: int = 1500, most: float = 3e5) -> np.ndarray:
    """Sum in float64 what is missing on the rays of PIXELS. left: what is left of the sun at places (N, 3), m, in the world."""
    towards, elevation, azimuth = rays()
    eye = np.asarray(camera().world.position, float)
    t = np.geomspace(1.0, most + 1.0, count) - 1.0
    out = []
    for x, y in PIXELS:
        gathered = UNIT * AIR.aerial(elevation[y, x], azimuth[y, x], ELEVATION, EYE, t)[0]
        share = left(eye + 0.5 * (t[1:] + t[:-1])[:, None] * towards[y, x])
        out.append(((1 - share) * np.diff(gathered, axis=0)).sum(axis=0))
    return np.array(out)


def through_slab(places: np.ndarray) -> np.ndarray:
    """Measure the way to the sun through the slab, m."""
    ends = (SLAB[:, None] - places) / TO_SUN
    first, last = np.maximum(ends.min(axis=0).max(axis=1), 0), ends.max(axis=0).min(axis=1)
    return np.maximum(last - first, 0)


def at_pixels(found: np.ndarray) -> np.ndarray:
    return np.array([found[y, x] for x, y in PIXELS])


@pytest.mark.slow
@pytest.mark.parametrize("quality", ["normal", "final"])
def test_a_dense_volume_takes_what_a_wall_takes_and_a_thin_one_its_share(device: Device, quality: str) -> None:
    dense = at_pixels(missing(device, quality, Medium(sigma_t=(1.0, 1.0, 1.0), max_distance=2000.0), 1.0))
    wall = expected(lambda places: (through_slab(places) == 0)[:, None])
    assert (wall.max(axis=1) > 5e-3).sum() >= 4  # there is something to be missed
    assert (np.abs(dense - wall) < 0.06 * wall + 0.01 * wall.max()).all()  # the table of what dims the sun blurs its edge by a cell
    sigma = np.array([0.002, 0.004, 0.008])  # optical depths across the slab of 0.06 to 0.24, and more along the way to the sun
    thin = at_pixels(missing(device, quality, Medium(sigma_t=tuple(sigma.tolist()), max_distance=2000.0), 1.0))
    share = expected(lambda places: np.exp(-through_slab(places)[:, None] * sigma))
    assert (np.abs(thin - share) < 0.025 * share + 0.01 * share.max()).all()


@pytest.mark.slow
@pytest.mark.parametrize("quality", ["normal", "final"])
def test_fog_takes_sunlight_from_the_air_in_it(device: Device, quality: str) -> None:
    medium = Medium(sigma_t=(0.001, 0.002, 0.004), fog="exponential", fog_base=0.0, fog_depth=100.0, max_distance=2000.0)
    column = 100.0 / math.sin(math.radians(ELEVATION))
    sigma = np.array(medium.sigma_t)
    share = expected(lambda places: np.exp(-sigma * column * np.exp(-np.maximum(places[:, 1:2], 0) / 100.0)))
    found = at_pixels(missing(device, quality, medium))
    assert (np.abs(found - share) < 0.025 * share + 0.002 * share.max()).all()


@pytest.mark.slow
@pytest.mark.parametrize("quality", ["normal", "final"])
def test_glass_takes_its_colour_of_sunlight(device: Device, quality: str) -> None:
    clear = Medium(sigma_t=(0.0, 0.0, 0.0), max_distance=2000.0)
    hidden = missing(device, quality, clear, held=1.0)
    assert hidden.max() > 1e-3
    depths = np.array([1.0, 0, 0, 0], np.float16).view(np.uint32)
    half = np.full(2, 32768 * 65537)
    assert np.abs(missing(device, quality, clear, glass=[*depths, *half]) - 0.5 * hidden).max() < 3e-3 * hidden.max()
    left = np.array([0.9, 0.25, 0.0])
    code = int(pack_left(left))
    found = missing(device, quality, clear, glass=[*depths, *[code] * 4, 0, 0])
    assert np.abs(found - (1 - left) * hidden).max() < 3e-3 * hidden.max()


@pytest.mark.slow
def test_the_exact_walk_finds_where_shadow_ends(device: Device) -> None:
    found = missing(device, "final", Medium(sigma_t=(0.0, 0.0, 0.0), max_distance=2000.0), held=0.5)
    eye = camera()
    resolved = resolve(Medium(max_distance=2000.0), March(cascades=1, shadow_size=64), "final", RADIUS)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (0, 0.4) for z in (-1, 1)]) * RADIUS
    light = DirectionalLight((1.0, 1.0, 1.0), tuple(TO_SUN))
    (view,) = light.shadow_views(eye.view_matrix, eye.projection_matrix, corners[None], resolved)

    def left(places: np.ndarray) -> np.ndarray:
        at = np.column_stack([places, np.ones(len(places))]) @ view.matrix.T
        return ~((at[:, :2] >= 0).all(axis=1) & (at[:, :2] <= 64).all(axis=1) & (at[:, 2] < 0.5))[:, None]

    truth = expected(left, 20_000, 3e4)
    assert truth.max() > 1e-3
    assert np.abs(at_pixels(found) - truth).max() < 0.02 * truth.max()


def test_what_steps_add() -> None:
    rng = np.random.default_rng(3)
    x, n = rng.uniform(-0.3, 0.3, (500, 3)), rng.integers(8, 64, 500).astype(float)
    x[:100] *= 1e-4
    found = call("scatter/march/air_steps.wgsl", "sum_of_exponentials", [x, n])
    np.testing.assert_allclose(found, march_air.sum_of_exponentials(x, n), rtol=1e-3)
    first, second = rng.uniform(0, 1, (2, 500, 3)) ** 4
    found = call("scatter/march/air_steps.wgsl", "change_of_steps", [first, second, n])
    np.testing.assert_allclose(found, march_air.change_of_steps(first, second, n), atol=1e-5)


def test_pieces_lie_in_the_parts_of_a_segment() -> None:
    rng = np.random.default_rng(4)
    ends = np.sort(rng.uniform(0, 100, (300, 4)), axis=1)
    counts = rng.integers(1, 9, (300, 3)).astype(float)
    k = rng.uniform(0, 1, 300) * counts.sum(axis=1)
    segment, inside = ends[:, [0, 3]], ends[:, 1:3]
    found = call("scatter/march/air_walk.wgsl", "piece_place", [k, segment, inside, counts])
    np.testing.assert_allclose(found, march_air.piece_place(k, segment, inside, counts), atol=1e-3)
