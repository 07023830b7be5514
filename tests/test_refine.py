"""Pixels that are marched by themselves after the upsampling of a smaller march."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import test_march
from calling import call
from test_march import RGB, depths, projection

from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie
from airlight.medium.resolve import ResolvedMedium
from airlight.reference import march as march_twin
from airlight.reference import refine
from airlight.scatter.march.march import March
from airlight.scatter.march.refine import STEPS, Refinement
from airlight.shadows import Shadow

PIXELS = 96, 64
MARKED, PUT = "scatter/march/upsample_marked.wgsl", "scatter/march/put_refined.wgsl"
RNG = np.random.default_rng(4)


def pair(kind: str, seed: int = 1) -> tuple[PunctualLight, Shadow]:
    lamp, made = test_march.CASES[kind]
    views = made(150)
    return lamp, Shadow(depths(test_march.blocks_for(kind, len(views), seed)), 150, views)


def scene(near: float = 2.0, pixels: tuple[int, int] = PIXELS) -> np.ndarray:
    """Depths of a picture: a near block, and a farther one, before nothing."""
    p = projection()
    at = [(p[2, 2] * -metres + p[2, 3]) / metres for metres in (near, 5.0)]
    out = np.ones(pixels[::-1])
    out[pixels[1] // 4 : pixels[1] // 2, : pixels[0] // 3], out[pixels[1] // 2 :, pixels[0] // 2 :] = at
    return out


def marched(lights: Any, medium: ResolvedMedium, share: float, pixels: tuple[int, int] = PIXELS) -> tuple[np.ndarray, March]:
    """(H, W, 4), and by which march."""
    device = open_device()
    march, seen = March(device, pixels), depths(scene(pixels=pixels)[None])
    march.update(np.eye(4), projection(), lights, medium, jitter="blue", share=share)
    run_ms(device, lambda encoder: march.record(encoder, seen))
    return np.frombuffer(device.read(march.layer, 16), np.float32).reshape(*pixels[::-1], 4), march


def listed(march: March) -> np.ndarray:
    """(H, W) bool: the pixels that were marched by themselves."""
    held: Refinement | None = march.refinement
    assert held is not None
    found = np.frombuffer(march.device.queue.read_buffer(held.chosen), np.uint32)
    out = np.zeros(march.pixels[::-1], bool)
    x, y = refine.unpack_pixel(found[1 : 1 + found[0]]).T
    out[y, x] = True
    assert out.sum() == found[0]
    return out


def test_functions() -> None:
    light, bend, deviation, span = RNG.uniform(0, 3, (200, 3)), *RNG.uniform([[-1], [0], [0]], [[1], [6], [24]], (3, 200))
    np.testing.assert_allclose(call(MARKED, "grey", [light]), refine.grey(light), rtol=1e-5)
    np.testing.assert_allclose(
        call(MARKED, "upsampling_error", [bend, deviation, span]), refine.upsampling_error(bend, deviation, span), rtol=1e-4, atol=1e-5
    )
    times = 2 ** RNG.uniform(-5, 6, 200)
    assert np.array_equal(call(MARKED, "error_bin", [times]), refine.error_bin(times))
    pixel = RNG.integers(0, 1 << 16, (200, 2))
    packed = call(MARKED, "pack_pixel", [pixel])
    assert np.array_equal(packed, refine.pack_pixel(pixel)) and np.array_equal(call(PUT, "unpack_pixel", [packed]), pixel)
    assert np.array_equal(refine.unpack_pixel(packed), pixel)


@pytest.mark.parametrize("kinds", [("point",), pytest.param(("sun", "spot", "point"), marks=pytest.mark.slow)])
@pytest.mark.parametrize("share", [0.5, pytest.param(0.3, marks=pytest.mark.slow)])
def test_unsure_pixels_are_as_in_a_march_of_the_whole_picture(kinds: tuple[str, ...], share: float) -> None:
    lights, least = [pair(kind) for kind in kinds], 1.0
    found, march = marched(lights, test_march.air(steps=16, refine=least), share)
    before, plain = marched(lights, test_march.air(steps=16, refine=0.0), share)
    whole, _ = marched(lights, test_march.air(steps=16 * STEPS), 1.0)
    chosen = listed(march)
    assert plain.refinement is None and 0.01 < chosen.mean() < 0.15
    assert np.array_equal(found, np.where(chosen[..., None], whole, before))
    small = np.frombuffer(march.device.read(march.marched_layers[0], 16), np.float32).reshape(*march.size[::-1], 4)
    errors = refine.upsampling_errors(small, found[..., 3].astype(float)) / (least * refine.mean_of_grid(small))
    assert (errors[chosen] > 1 - 1e-3).all() and (errors[~chosen] < 1 + 1e-3).all()


def test_where_too_many_are_unsure_the_most_unsure_are_marched() -> None:
    lights, values = [pair("point")], {"steps": 8, "refine": 1e-3}
    found, march = marched(lights, test_march.air(**values), 0.5)
    held, chosen = march.refinement, listed(march)
    assert held is not None and 0.1 * held.capacity < chosen.sum() <= held.capacity < chosen.size
    small = np.frombuffer(march.device.read(march.marched_layers[0], 16), np.float32).reshape(*march.size[::-1], 4)
    errors = refine.upsampling_errors(small, found[..., 3].astype(float))
    assert errors[chosen].min() > 0.999 * errors[~chosen].max()
    again, _ = marched(lights, test_march.air(**values), 0.5)
    assert np.array_equal(found, again)


@pytest.mark.slow
@pytest.mark.parametrize("values", [{"fog": "exponential"}, {"noise_amount": 0.6}])
def test_thicker_air_is_marched_as_in_the_whole_picture(values: dict[str, Any]) -> None:
    lights = [pair("point"), pair("spot")]
    found, march = marched(lights, test_march.air(steps=16, ambient=RGB, **values), 0.5)
    whole, _ = marched(lights, test_march.air(steps=16 * STEPS, ambient=RGB, **values), 1.0)
    chosen = listed(march)
    assert chosen.sum() > 20
    np.testing.assert_allclose(found[chosen], whole[chosen], rtol=0.15 if "noise_amount" in values else 1e-6)


@pytest.mark.slow
def test_a_cookie_is_as_fine_as_the_pictures_pixels() -> None:
    spot, shadow = pair("spot")
    lights = [(replace(spot, cookie=Cookie(RNG.random((256, 256, 3)))), shadow)]
    found, march = marched(lights, test_march.air(steps=16), 0.5)
    whole, _ = marched(lights, test_march.air(steps=16 * STEPS), 1.0)
    chosen = listed(march)
    assert chosen.sum() > 20 and np.array_equal(found[chosen], whole[chosen])


@pytest.mark.slow
def test_the_exact_walk_is_refined_too() -> None:
    lights = [pair("spot")]
    found, march = marched(lights, test_march.air(), 0.5)
    whole, _ = marched(lights, test_march.air(), 1.0)
    chosen = listed(march)
    assert chosen.sum() > 20 and np.array_equal(found[chosen], whole[chosen])


@pytest.mark.slow
def test_nothing_is_refined_where_there_are_no_lamps_or_light_is_soft() -> None:
    for kinds, values in ((("sun",), {}), (("point",), {"soften": 1}), ((), {})):
        _, march = marched([pair(kind) for kind in kinds], test_march.air(steps=8, **values), 0.5)
        assert march.refinement is None


@pytest.mark.slow
def test_a_lamp_in_view_is_right() -> None:
    """As far as a smaller march can be told from one of the whole picture: before, the lamp was wrong by more than all of the light."""
    lamp = test_march.CASES["point"][0]
    errors = []
    whole = marched([(lamp, None)], test_march.air(), 1.0)[0][..., :3].astype(float)
    for least in (0.0, 0.5):
        found = marched([(lamp, None)], test_march.air(steps=64, refine=least), 0.5)[0][..., :3]
        errors.append(np.sqrt(np.mean((found - whole) ** 2)) / whole.mean())
    assert errors[1] < 0.03 < 0.2 < errors[0]


def test_positions_are_those_of_the_march() -> None:
    y, x = march_twin.positions((23, 30), (64, 96))
    rows, columns = march_twin.sampled_pixel(11, 23, 64), march_twin.sampled_pixel(15, 30, 96)
    assert y[rows, columns] == pytest.approx(11) and x[rows, columns] == pytest.approx(15)
