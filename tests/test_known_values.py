"""Known values and limits of float64 formulas where both sides of a comparison would share a fault, or no comparison reaches."""

import math
from typing import Any

import numpy as np
import pytest

from airlight.alpha import straight_codes
from airlight.composite.adapt import measure_ramp
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.spot import SpotLight
from airlight.look.grid import LINES
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.projection import project
from airlight.reference import colour, jitter, radial, rays, tone, tracer
from airlight.reference.medium import in_scattered, mean_transmittance
from airlight.shadows.fit import (
    MARGIN_TEXELS,
    NEAR_SHARE,
    RUNG_RATIO,
    ball,
    held_half,
    near_plane,
    orthographic_view,
    rung,
    splits,
    with_border,
)

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


@pytest.mark.parametrize(("side", "ahead"), [((2.0, 0.0), 1.0), ((-3.0, 0.3), 1.0), ((0.1, 3.5), 1.0), ((0.0, -1.7), 0.5)])
def test_a_light_beside_the_view_fades_from_the_border_on_its_side(side: tuple[float, float], ahead: float) -> None:
    """The camera's middle is shifted, so that each border has its own angle, that of the point of it that lies towards the light."""
    projection = np.array([[1.5, 0, 0.2, 0], [0, 2.0, -0.3, 0], [0, 0, -1, -0.1], [0, 0, -1, 0]])
    ray = np.array([*side, -ahead])
    ndc = np.array([1.5 * side[0] / ahead - 0.2, 2 * side[1] / ahead + 0.3])
    border = (ndc / np.abs(ndc).max() + (0.2, -0.3)) / (1.5, 2)
    share = ahead / np.linalg.norm(ray) * math.hypot(1, *border)
    found = project(np.append(7 * ray, 1), np.eye(4), projection)
    assert math.isclose(found.fade, share * share * (3 - 2 * share), rel_tol=1e-9) and 0 < found.fade < 1
    np.testing.assert_allclose(found.position, (0.5 + ndc[0] / 2, 0.5 - ndc[1] / 2))
    np.testing.assert_allclose(found.direction, ray / np.linalg.norm(ray))
    assert math.isclose(found.distance, 7 * np.linalg.norm(ray)) and math.isinf(project(np.append(ray, 0), np.eye(4), projection).distance)


@pytest.mark.parametrize(("across", "factor"), [(0.0, 0.0), (0.025, 5 / 32), (0.05, 0.5), (0.075, 27 / 32), (0.1, 1.0), (0.6, 1.0)])
def test_without_perspective_a_direction_along_the_axis_has_no_side(across: float, factor: float) -> None:
    flat = np.diag([0.5, 0.5, -0.1, 1.0])
    found = project((0.0, across, -math.sqrt(1 - across**2), 0.0), np.eye(4), flat)
    assert math.isclose(found.fade, factor, abs_tol=1e-9)
    assert math.isclose(project((1.0, 0.0, -0.05, 0.0), np.eye(4), flat).fade, 0.5, abs_tol=2e-3)  # and none of what shines from beside
    nowhere = project((0.0, 0.0, 0.0, 1.0), np.eye(4), flat)
    assert (nowhere.fade, nowhere.distance, nowhere.position) == (0.0, 0.0, (0.5, 0.5))


def test_a_map_begins_before_what_it_may_not_cut() -> None:
    def cube(middle: float, half: float) -> Any:
        return middle * np.array([1.0, 0, 0]) + half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])

    far = math.hypot(1001, 1, 1)
    at, none = np.zeros(3), np.zeros((0, 8, 3))
    assert near_plane(at, 0.3, cube(1000, 1)[None], 0.5) == 0.3 and near_plane(at, 0, none, 0.5) == 0.01
    assert math.isclose(near_plane(at, 0, cube(1000, 1)[None], 0.5), far * NEAR_SHARE)
    near_by = np.stack([cube(1000, 1), cube(1.001 * far * NEAR_SHARE + 0.01, 0.01)])  # its face is just behind that
    assert math.isclose(near_plane(at, 0, near_by, 0.5), 0.99 * 0.5 * 1.001 * far * NEAR_SHARE, rel_tol=1e-9)
    assert math.isclose(near_plane(at, 0, np.stack([cube(1000, 1), cube(0, 1)]), 0.5), far * NEAR_SHARE)  # the light is in one
    assert math.isclose(near_plane(at, 0, cube(0, 1)[None], 0.5), math.sqrt(3) * NEAR_SHARE)


def test_what_a_map_holds() -> None:
    hulls = np.array([[[x, y, z] for x in (-1, 3) for y in (0, 2) for z in (5, 9)]], float)
    centre, half = held_half(hulls, (np.zeros(3), 50.0))
    assert np.array_equal(centre, [1, 1, 7]) and half == rung(2.0) and 2 <= half < 2 * RUNG_RATIO
    box = (np.array([1.0, 2, 3]), 1.5)
    assert held_half(hulls, box) is box
    centre, radius = ball(hulls)
    assert np.array_equal(centre, [1, 1, 7]) and math.isclose(radius, 3) and ball(np.zeros((0, 8, 3)))[1] == 0
    assert rung(2.0, up=False) <= 2 < rung(2.0, up=False) * RUNG_RATIO
    np.testing.assert_allclose(splits(1, 16, 4, 1.0), [2, 4, 8])
    np.testing.assert_allclose(splits(1, 17, 4, 0.0), [5, 9, 13])
    np.testing.assert_allclose(splits(1, 16, 4, 0.25), 0.25 * np.array([2, 4, 8]) + 0.75 * np.array([4.75, 8.5, 12.25]))


def test_a_border_shrinks_a_map_about_its_middle() -> None:
    matrix, size, texels = RNG.normal(size=(4, 4)), 64, 5.0
    point = np.array([0.3, -0.2, 0.4, 1.0])
    before, after = (m @ point for m in (matrix, with_border(matrix, size, texels)))
    share = (size / 2 - texels) / (size / 2 - MARGIN_TEXELS)
    np.testing.assert_allclose(after[:2] / after[3] - 32, share * (before[:2] / before[3] - 32))
    np.testing.assert_allclose(after[2:], before[2:])


def test_a_scaled_scene_has_the_ambient_light_scaled_alone() -> None:
    air = medium(ambient=(0.1, 0.2, 0.3))
    assert air.exposed(1) is air
    scaled = air.exposed(2.5)
    np.testing.assert_allclose(scaled.ambient, (0.25, 0.5, 0.75))
    assert scaled.max_distance == air.max_distance and scaled.settings is air.settings and np.array_equal(scaled.sigma_t, air.sigma_t)


def test_the_tracer_breaks_a_ray_where_a_lamp_s_light_begins_and_ends() -> None:
    ray, to_light = np.array([[1.0, 0, 0]]), np.array([[2.0, -1.0, 0]])  # the light is a metre under the ray, two metres ahead
    nearest, h = np.array([2.0]), np.array([1.0])
    light = PointLight(WHITE, (2.0, -1.0, 0.0), range=3.0)
    np.testing.assert_allclose(tracer.break_distances(light, ray, to_light, nearest, h), [[2 - math.sqrt(8), 2 + math.sqrt(8)]])
    spot = SpotLight(WHITE, (2.0, -1.0, 0.0), (0.0, 1.0, 0.0), inner=math.atan(0.5), outer=math.atan(1.5))
    found = np.sort(tracer.break_distances(spot, ray, to_light, nearest, h)[0])
    np.testing.assert_allclose(found, [0.5, 1.5, 2.5, 3.5])
    assert tracer.break_distances(PointLight(WHITE, (2.0, -1.0, 0.0)), ray, to_light, nearest, h).shape == (1, 0)


@pytest.mark.parametrize("most", [255, 65535])
def test_codes_are_divided_by_their_alpha_up_to_the_light_that_hides_nothing(most: int) -> None:
    kind = np.uint8 if most == 255 else np.uint16
    codes = np.array([[[0, 0, 0, 0], [most // 5, 0, most // 5, most // 5], [most, most // 2, 0, most], [most // 5, 0, most // 5, 0]]], kind)
    straight = straight_codes(codes)
    assert straight[0, 0].tolist() == [0, 0, 0, 0]
    assert straight[0, 1].tolist() == [most, 0, most, most // 5]  # c = a: full colour of that alpha
    assert straight[0, 2].tolist() == [most, most // 2, 0, most]
    light = colour.srgb_decode(np.array(0.2))
    assert straight[0, 3, 3] == math.ceil(float(light) * most)
    shown = colour.srgb_decode(straight[0, 3, :3] / most) * straight[0, 3, 3] / most
    np.testing.assert_allclose(shown, light * np.array([1, 0, 1]), atol=1 / most)


def test_a_picture_that_leans_to_the_dark_is_shown_darker() -> None:
    """Three quarters of it at 1, a quarter at e^4: the logarithms' average 1 lies half of the way from their middle to the least."""
    ramp = measure_ramp(np.exp(np.repeat([0.0, 4.0], (7500, 2500))).astype(np.float32))
    np.testing.assert_allclose(ramp.scale, 0.18 * 4**-0.5 / math.e, rtol=1e-5)
    np.testing.assert_allclose(ramp.white, max(ramp.scale * math.exp(4), 1.0), rtol=1e-5)


@pytest.mark.parametrize("side", [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
def test_what_lies_beside_a_map_leaves_its_depths_alone(side: tuple[float, float]) -> None:
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 1.0)])
    beside = corners + 30 * np.array([*side, 0.0]) + (0, 0, 50)
    view = orthographic_view(np.eye(3), np.zeros(3), 10.0, 64, np.stack([corners, beside]), (0.0, np.inf))
    assert view.texel < 0.5 and view.depth_scale < 1.1
    over = orthographic_view(np.eye(3), np.zeros(3), 10.0, 64, np.stack([corners, corners + (0, 0, 50)]), (0.0, np.inf))
    assert over.depth_scale > 50
