"""The epipolar gather's triangles: every pixel is written once, by a rasteriser of any precision that Vulkan allows."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from airlight.gpu.device import Device, open_device
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.epipolar.gather import corners
from airlight.scatter.epipolar.grid import QUALITY, Grid
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.screen import Target


def times_covered(position: np.ndarray, size: tuple[int, int], bits: int) -> np.ndarray:
    """Count per pixel (height, width) how many triangles (3 n, 2) cover its centre, corners snapped to 2^-bits px, by the top-left rule."""
    scale = 2**bits
    fixed = np.rint(position.astype(np.float64) * scale).astype(np.int64).reshape(-1, 3, 2)
    y, x = (np.indices((size[1], size[0])) * 2 + 1) * scale // 2
    count = np.zeros((size[1], size[0]), int)
    for triangle in fixed:
        (ax, ay), (bx, by), (cx, cy) = triangle
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        inside = np.ones(count.shape, bool)
        turned = triangle if area > 0 else triangle[::-1]  # clockwise, as y points down
        for (px, py), (qx, qy) in zip(turned, np.roll(turned, -1, axis=0), strict=True):
            side = (qx - px) * (y - py) - (qy - py) * (x - px)
            top_left = qy < py or (qy == py and qx > px)
            inside &= (side > 0) | ((side == 0) & top_left)
        count += inside
    return count


def epipolar_grid(size: tuple[int, int], light: tuple[float, float], quality: str = "normal", density: float = 0.8) -> Grid:
    fine = QUALITY[quality]
    return Grid(size, light, mixture(density, 1.5, fine.tolerance), 1.5, density, fine, "clamp")


def test_the_count_is_a_rasteriser_s() -> None:
    """Two triangles of a square share an edge through centres: once each; snapped corners that leave a gap are seen."""
    square = np.array([(0, 0), (6, 0), (6, 6), (0, 0), (6, 6), (0, 6)], float)
    assert (times_covered(square, (6, 6), 4) == 1).all()
    square[1] += (0, 2 / 3)
    assert times_covered(square, (6, 6), 4).min() == 0
    assert (times_covered(square[::-1], (6, 6), 4) == times_covered(square, (6, 6), 4)).all()


halves = st.integers(-40, 260).map(lambda n: n / 2)
coordinates = st.one_of(halves, st.floats(-20, 120), st.sampled_from([-1e9, -40_000.0, 3e5, 1e8]))


@settings(max_examples=60)
@given(st.tuples(st.integers(1, 100), st.integers(1, 100)), st.tuples(coordinates, coordinates), st.sampled_from([4, 5, 8]))
@example((100, 60), (52.0, 24.6), 4)
@example((64, 64), (32.0, 32.0), 4)
def test_every_pixel_centre_is_covered_once(size: tuple[int, int], light: tuple[float, float], bits: int) -> None:
    found = corners(epipolar_grid(size, light))["position"]
    assert np.array_equal(found, np.rint(found * 16) / 16) and (found >= 0).all() and (found <= size).all()
    assert (times_covered(found, size, bits) == 1).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_driver_writes_every_pixel(seed: int) -> None:
    """Over a layer that holds a large number before; lights on centres and on borders of pixels too, in and outside the picture."""
    device: Device = open_device()
    rng = np.random.default_rng(seed)
    for i in range(6):
        width, height = (int(n) for n in rng.integers(80, 600, 2))
        source, layer = (device.texture(width, height, "rgba16float") for _ in range(2))
        device.write(source, rng.random((height, width, 4)).astype(np.float16), width * 8)
        device.write(layer, np.full((height, width, 4), 60000, np.float16), width * 8)
        light = rng.uniform(-0.3, 1.3, 2) * (width, height)
        x, y = light if i % 2 else np.round(2 * light) / 2
        plan = EpipolarPlan(device, (width, height), (x, y), Target(source, layer), density=0.8, lam=1.5, border="clamp", quality="normal")
        encoder = device.encoder()
        plan.record(encoder)
        device.submit(encoder)
        assert np.frombuffer(device.read(layer, 8), np.float16).max() <= 1.01, (width, height, x, y)
