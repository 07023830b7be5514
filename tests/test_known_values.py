"""Known values and limits of float64 formulas where both sides of a comparison would share a fault, or no comparison reaches."""

import math
from typing import Any

import numpy as np
import pytest

from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.spot import SpotLight
from airlight.look.grid import LINES
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.reference import colour, jitter, radial, rays, tone
from airlight.reference.medium import in_scattered, mean_transmittance
from airlight.shadows.fit import MARGIN_TEXELS

RNG = np.random.default_rng(17)
WHITE = (1.0, 1.0, 1.0)


def medium(**values: Any) -> Any:
    return resolve(Medium(sigma_t=(0.1, 0.2, 0.05), max_distance=20.0, **values), March(shadow_size=64), "normal", 5.0)


def test_a_spot_is_full_at_its_inner_angle_and_dark_at_its_outer() -> None:
    light = SpotLight(WHITE, inner=0.4, outer=1.1, direction=(0.0, -1.0, 0.0))
    angles = np.array([0, 0.2, 0.4, math.acos((math.cos(0.4) + math.cos(1.1)) / 2), 1.1, 1.5, 3])
    points = 2 * np.stack([np.sin(angles), -np.cos(angles), 0 * angles], axis=-1)
    np.testing.assert_allclose(light.incident(points)[2], np.array([1, 1, 1, 0.25, 0, 0, 0]) / 4, atol=1e-12)
    np.testing.assert_allclose(light.kink_cosines(), (math.cos(1.1), math.cos(0.4)), rtol=1e-12)
    assert light.cone_cosine() == math.cos(1.1) and light.shadow_layers(medium()) == 1


def test_a_range_and_a_distance_dim_a_light() -> None:
    light = PointLight(WHITE, range=4.0)
    to_light, way, factor = light.incident(np.array([[0.0, 2, 0], [0, 0, -4], [5, 0, 0]]))
    np.testing.assert_allclose(factor, [(1 - 1 / 16) / 4, 0, 0])
    np.testing.assert_allclose(way, [2, 4, 5])
    np.testing.assert_allclose(to_light, [[0, -1, 0], [0, 0, 1], [-1, 0, 0]])


@pytest.mark.parametrize(("fade", "away", "factor"), [
    (0.5, 2.0, 1), (0.5, 4.0, 1), (0.5, 6.0, 0.5), (0.5, 5.0, 27 / 32), (0.5, 8.0, 0), (0.5, 9.0, 0),
    (0.0, 8.0, 1), (0.0, 8.01, 0), (1.0, 4.0, 0.5),
])  # fmt: skip
def test_a_lamp_fades_over_the_last_share_of_its_distance(fade: float, away: float, factor: float) -> None:
    light, eye = PointLight(WHITE, (3.0, -1.0, 2.0)), np.array([3.0, -1 - 0.6 * away, 2 + 0.8 * away])
    assert math.isclose(light.fade(eye, medium(lamp_distance=8.0, lamp_fade=fade)), factor, abs_tol=1e-12)
    assert light.fade(eye, medium(lamp_fade=fade)) == 1


@pytest.mark.parametrize("shape", [(), (5,), (3, 4)])
def test_a_sun_is_the_same_everywhere(shape: tuple[int, ...]) -> None:
    to_light, way, factor = DirectionalLight(WHITE, (0.0, 0.6, 0.8)).incident(RNG.normal(size=(*shape, 3)))
    assert way.shape == factor.shape == shape and (way == 0).all() and (factor == 1).all()
    assert np.array_equal(to_light, np.broadcast_to([0.0, 0.6, 0.8], (*shape, 3)))


def test_the_faces_of_a_cube_hold_every_direction_once_and_meet_at_their_margins() -> None:
    air = medium()
    light = PointLight(WHITE, (1.0, -2.0, 0.5), near=0.1)
    views = light.shadow_views(np.eye(4), np.eye(4), np.zeros((0, 8, 3)), air)
    assert len(views) == light.shadow_layers(air) == 6
    directions = RNG.normal(size=(500, 3))
    points = np.append(directions + light.position, np.ones((500, 1)), axis=1)
    mapped = np.stack([points @ view.matrix.T for view in views])
    held = mapped[:, :, :2] / mapped[:, :, 3:]
    share = np.abs(held - 32).max(axis=2) / (32 - MARGIN_TEXELS)
    inside = (mapped[..., 3] > 0) & (share <= 1)
    assert (inside.sum(axis=0) == 1).all()
    assert np.array_equal(mapped[..., 3].argmax(axis=0), inside.argmax(axis=0))


def test_a_light_s_own_anisotropy_shapes_what_it_scatters() -> None:
    air, g = medium(phase="henyey-greenstein", anisotropy=0.1), 0.6
    light = DirectionalLight(WHITE, (0.0, 0.0, 1.0), anisotropy=g)
    ahead, back = (in_scattered(light, air, np.array([0.0, 0.0, z]), np.zeros(3), np.zeros(())) for z in (1.0, -1.0))
    np.testing.assert_allclose(ahead / back, ((1 + g) / (1 - g)) ** 3, rtol=1e-12)
    own = in_scattered(DirectionalLight(WHITE, (0.0, 0.0, 1.0)), air, np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(()))
    np.testing.assert_allclose(own, air.sigma_s * (1 - 0.1**2) / (4 * np.pi * 0.9**3), rtol=1e-12)


def test_mean_transmittance_is_the_mean() -> None:
    depths = np.array([0.0, 1e-9, 0.3, 2.0, 40.0])
    s = (np.arange(20000) + 0.5) / 20000
    np.testing.assert_allclose(mean_transmittance(depths), np.exp(-depths[:, None] * s).mean(axis=1), rtol=1e-6)


def test_noise_lies_in_0_to_1_and_its_offsets_are_those_that_are_named() -> None:
    p = RNG.integers(0, 4000, (2000, 2))
    noise = jitter.interleaved_gradient_noise(p)
    assert 0 <= noise.min() < 0.01 and 0.99 < noise.max() < 1
    x, y = p[0]
    by_hand = 52.9829189 * math.fmod(0.06711056 * (x + 0.5) + 0.00583715 * (y + 0.5), 1)
    assert math.isclose(noise[0], by_hand - math.floor(by_hand), rel_tol=1e-9)
    assert (jitter.offsets(3, 2, "fixed") == np.zeros((2, 3))).all() and (jitter.offsets(3, 2, "midpoint") == 0.5).all()
    field = jitter.offsets(5, 4, "gradient")
    assert field[3, 2] == jitter.interleaved_gradient_noise(np.array([2, 3]))
    tile = jitter.blue_noise()
    side = len(tile)
    blue = jitter.offsets(side + 20, side + 10, "blue")
    assert np.array_equal(blue[:side, :side], tile) and np.array_equal(blue[side:, side:], tile[:10, :20])


@pytest.mark.parametrize(("light", "density", "pixels"), [
    ((0.25, 0.1), 1.0, math.hypot(1500, 900)), ((0.75, 0.9), 1.0, math.hypot(1500, 900)), ((0.25, 0.9), 0.9, 0.9 * math.hypot(1500, 900)),
    ((-0.5, 1.5), 1.0, math.hypot(3000, 1500)), ((0.5, 0.5), 0.1, 0), ((9.0, 9.0), 16.0, 1e4),
])  # fmt: skip
def test_taps_are_four_a_pixel_of_the_longest_ray(light: tuple[float, float], density: float, pixels: float) -> None:
    assert radial.enough_taps((1000, 2000, 3), light, density) == max(3000, 4 * math.ceil(pixels))


def test_what_a_half_float_cannot_hold_is_made_sound() -> None:
    fragment = np.array([[1e6, 2e6, 3e6, 7.0], [-1, -2, -3, -4], [np.nan, np.inf, -np.inf, np.nan], [0.5, 65504, 65505, 0.25]])
    assert np.array_equal(colour.sound(fragment), [[65504, 65504, 65504, 1], [0, 0, 0, 0], [0, 0, 0, 0], [0.5, 65504, 65504, 0.25]])


@pytest.mark.parametrize("curve", [tone.filmic, tone.agx])
def test_a_tone_curve_holds_greys_rises_and_ends(curve: Any) -> None:
    greys = np.append(0, np.geomspace(1e-4, 1e4, 200))[:, None] * np.ones(3)
    shown = curve(greys)
    assert np.ptp(shown, axis=1).max() < 2e-3 and (np.diff(shown[:, 1]) >= 0).all() and shown.min() >= 0 and 0.9 < shown.max() <= 1
    assert np.array_equal(curve(np.array([-1.0, -2, -3])), curve(np.zeros(3)))
    assert np.array_equal(curve(np.array([1e9, 0.2, 1e9])), curve(np.array([65504.0, 0.2, 65504.0])))


@pytest.mark.parametrize("span", [0.7, 2.0])
def test_lines_number_the_angle_from_the_first_to_either_side(span: float) -> None:
    """A light outside the picture has a fan of lines; what lies beside it is before the first or beyond the last, by the shorter way."""
    start, turn = 0.4, np.linspace(span / 2 - np.pi + 1e-3, span / 2 + np.pi - 1e-3, 101)
    points = np.array([-0.3, 0.2]) + 1.5 * np.stack([np.cos(start + turn), np.sin(start + turn)], axis=-1)
    found = rays.polar(points, (-0.3, 0.2), start, span, inside=False)
    np.testing.assert_allclose(found[:, 0], 1.5)
    np.testing.assert_allclose(found[:, 1], turn / span * LINES - 0.5, rtol=1e-9, atol=1e-9)
    round_about = rays.polar(points, (-0.3, 0.2), start, 2 * np.pi, inside=True)
    np.testing.assert_allclose(round_about[:, 1], turn % (2 * np.pi) / (2 * np.pi) * LINES - 0.5, rtol=1e-9, atol=1e-9)
