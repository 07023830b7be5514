"""Shapes of lights: the shader's functions beside their twins, cookies as textures, and what bounds a light."""

import math
from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.projector import FALLOFFS, ProjectorLight
from airlight.lights.shape import Cookie, axes_along
from airlight.lights.spot import SpotLight
from airlight.reference import shape, shaped
from airlight.scatter.march.cookies import SHAPES, even_colour, halved, laid_out, level_corner, shape_of
from airlight.scatter.march.records import FRAME, LIGHT

RAY = struct_dtype("scatter/march/ray.wgsl", "Ray")
RNG = np.random.default_rng(19)
PATH = "scatter/march/walk.wgsl"
COUNT = 2000
WHITE = (1.0, 1.0, 1.0)


def single(*size: int, low: float = -4.0, high: float = 4.0) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *size)).astype(np.float32)


@pytest.mark.parametrize("kind", SHAPES[1:])
def test_places_in_a_shape(kind: str) -> None:
    q, light = single(3), np.zeros((), LIGHT)
    constants = {"SHAPE": SHAPES.index(kind)}
    if kind == "sphere":
        q = q[np.hypot(q[:, 0], q[:, 1]) > 0.05]
        size = single(2, low=4, high=64).round()[: len(q)]
        apart = np.abs(call(PATH, "sphere_place", [q, size]) - shape.sphere_place(q, size))
        assert np.minimum(apart, np.abs(1 - apart)).max() < 1e-5
        return
    q = q[np.abs(q[:, 2]) > 0.05]
    light["shape_size"], light["shape_most"] = (3, 2), 7.5
    found = call(PATH, "cookie_place", [q], constants=constants, bindings={"light": light})
    truth = shape.cookie_place(q, light, kind == "parallel")
    apart = np.abs(found - truth) / np.maximum(np.abs(truth), 1)
    if kind == "parallel":
        apart[:, :2] = np.minimum(apart[:, :2], np.abs(light["shape_size"] - apart[:, :2]))
    assert apart.max() < 1e-5 and np.ptp(truth[:, 0]) > 2.5


def test_levels_of_a_cookie() -> None:
    texels = (2 ** RNG.uniform(-4, 12, COUNT)).astype(np.float32)
    texels[:13] = 2.0 ** np.arange(-4, 9)  # a level begins at a power of two
    last = RNG.integers(0, 10, COUNT).astype(np.uint32)
    found, truth = call(PATH, "level_of", [texels, last]), shape.level_of(texels, last)
    np.testing.assert_array_equal(found, truth)
    assert len(np.unique(truth[:, 1])) == 10
    size = single(2, low=1, high=4096).round()
    found, truth = call(PATH, "level_corner", [truth.astype(np.float32), size]), shape.level_corner(truth, size)
    np.testing.assert_array_equal(found, truth)
    levels = shape.level_of(texels, last)[:, 1].astype(int)
    same = [level_corner(level, int(rows), int(columns)) for level, (columns, rows) in zip(levels.tolist(), size, strict=True)]
    np.testing.assert_array_equal(truth, same)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (16, 16), (37, 21), (3, 500), (256, 100)])
def test_levels_of_a_cookie_lie_apart_in_its_texture(size: tuple[int, int]) -> None:
    pixels = RNG.uniform(1, 2, (*size, 3)).astype(np.float32)
    for repeats in (False, True):
        out = laid_out(pixels, repeats)
        used = np.zeros(out.shape[:2], int)
        for level, one in enumerate(halved(pixels)):
            x, y = level_corner(level, *size)
            around = out[y - 1 : y + len(one) + 1, x - 1 : x + one.shape[1] + 1]
            used[y - 1 : y + len(one) + 1, x - 1 : x + one.shape[1] + 1] += 1
            np.testing.assert_array_equal(around[1:-1, 1:-1], one)
            np.testing.assert_array_equal(around[1:-1, 0], one[:, -1 if repeats else 0])
            np.testing.assert_array_equal(around[-1, 1:-1], one[0 if repeats else -1])
        assert used.max() == 1 and (out[used == 0] == 0).all()


def test_next_whole_number_along_a_line() -> None:
    b, a, w, t = single(low=-20, high=20), single(low=-5, high=5), single(2, low=0.2, high=2), single(low=0, high=5)
    w[: COUNT // 2, 1] = 0
    found, truth = call(PATH, "next_whole", [b, a, w, t]), shape.next_whole(b, a, w, t)
    same = np.abs(found - truth) <= 1e-3 * np.maximum(np.abs(truth), 1)
    assert same.mean() > 0.99  # where a float is this or that side of a whole number
    some = truth < 1e30
    met = (b + truth * a) / (w[:, 0] + truth * w[:, 1])
    np.testing.assert_allclose(met[some], np.round(met[some]), atol=1e-6)
    assert (truth[some] > t[some]).all() and 0.4 < some.mean() < 1


def test_rays_in_what_bounds_a_light() -> None:
    light, frame, ray = np.zeros((), LIGHT), np.zeros((), FRAME), np.zeros(COUNT, RAY)
    light["plane_count"], light["planes"], light["shape_rows"] = 5, RNG.normal(size=(12, 4)), RNG.normal(size=(3, 4))
    light["planes"][:, 3] += 3
    direction = single(3)
    ray["origin"], ray["direction"] = single(3), direction / np.linalg.norm(direction, axis=1, keepdims=True)
    range = np.sort(single(2, low=0, high=20), axis=1)
    own: Any = {"bindings": {"light": light}}
    found, truth = call(PATH, "clip_to_planes", [ray, range], constants={"PLANES": 5}, **own), shape.clip_to_planes(ray, range, light)
    empty = truth[:, 1] <= truth[:, 0]
    assert 0.1 < empty.mean() < 0.95 and ((found[:, 1] <= found[:, 0]) == empty).mean() > 0.998
    some = ~empty & (found[:, 1] > found[:, 0])
    assert (np.abs(found - truth)[some] < 1e-3 * np.maximum(np.abs(truth[some]), 1)).mean() > 0.99
    v, w = single(3), RNG.integers(0, 2, COUNT).astype(np.float32)
    np.testing.assert_allclose(call(PATH, "shape_index", [v, w], **own), shape.shape_index(v, w, light), rtol=1e-4, atol=1e-4)
    for flat in (0.0, 1.0):
        frame["rays"], frame["size"], frame["flat"] = (1.2, -0.7, 0, 0), (64, 36), flat
        width = call(PATH, "pixel_width", [], bindings={"frame": frame})
        np.testing.assert_allclose(width, shape.pixel_width(frame), rtol=1e-6)


def test_a_cookie_interpolates_between_centres_of_pixels() -> None:
    pixels = RNG.uniform(size=(3, 5, 3))
    cookie = Cookie(pixels)
    centres = np.stack(np.meshgrid((np.arange(5) + 0.5) / 5, (np.arange(3) + 0.5) / 3), axis=-1)
    np.testing.assert_allclose(cookie.at(centres), pixels)
    np.testing.assert_allclose(cookie.at([0.2, 0.5]), (pixels[1, 0] + pixels[1, 1]) / 2)
    np.testing.assert_allclose(cookie.at([-7.0, 7.0]), pixels[2, 0])
    np.testing.assert_allclose(cookie.at([0.0, 0.5], repeats=True), (pixels[1, 0] + pixels[1, 4]) / 2)
    np.testing.assert_allclose(cookie.at([3.1, -1.5], repeats=True), cookie.at([0.1, 0.5], repeats=True))


def test_smaller_copies_keep_the_mean_where_sides_are_powers_of_two() -> None:
    pixels = RNG.uniform(size=(16, 64, 3)).astype(np.float32)
    levels = halved(pixels)
    assert [one.shape[:2] for one in levels] == [(16, 64), (8, 32), (4, 16), (2, 8), (1, 4), (1, 2), (1, 1)]
    np.testing.assert_allclose([one.mean((0, 1)) for one in levels], np.tile(pixels.mean((0, 1)), (7, 1)), rtol=1e-5)
    assert [one.shape[:2] for one in halved(pixels[:5, :7])] == [(5, 7), (3, 4), (2, 2), (1, 1)]
    np.testing.assert_allclose(halved(np.ones((5, 7, 3)))[-1], 1)


def test_axes_are_right_up_and_ahead() -> None:
    right, up, ahead = axes_along((0, 0, -2), (0.3, 1, 0.5))
    np.testing.assert_allclose(ahead, (0, 0, -1))
    np.testing.assert_allclose(np.cross(ahead, up), right)
    assert up @ (0.3, 1, 0.5) > 0 and abs(up[2]) < 1e-12
    for straight in ((0, -1, 0), (0, 1, 0)):  # along up
        axes = axes_along(straight, (0, 1, 0))
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


def test_light_of_a_projector_is_in_its_frustum_and_falls_as_it_says() -> None:
    known: Any = {"position": (1.0, 2.0, 3.0), "direction": (0.0, 0.0, -1.0), "near": 0.5, "far": 6.0}
    known["fov"] = math.radians(60), math.radians(40)
    points = RNG.uniform(-4, 4, (COUNT, 3)) + (1, 2, 0)
    away = points - known["position"]
    ahead = -away[:, 2]
    inside = (ahead >= 0.5) & (ahead <= 6) & (np.abs(away[:, 0]) <= math.tan(math.radians(30)) * ahead)
    inside &= np.abs(away[:, 1]) <= math.tan(math.radians(20)) * ahead
    assert 0.02 < inside.mean() < 0.9
    d = np.linalg.norm(away, axis=1)
    for falloff, ambient in zip(FALLOFFS, (0.0, 0.3, 0.0), strict=True):
        light = ProjectorLight(WHITE, falloff=falloff, ambient=ambient, **known)
        truth = {"inverse-square": 1 / d**2, "inverse": 1 / d, "constant": 1 + 0 * d}[falloff] + ambient
        np.testing.assert_allclose(light.incident(points)[2], np.where(inside, truth, 0))
    # A ray's lit part is where its points are lit
    light = ProjectorLight(WHITE, clip=((0.0, 2.0, 0.0, -2.0),), **known)
    origin, ray = RNG.uniform(-5, 5, (COUNT, 3)), RNG.normal(size=(COUNT, 3))
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    which, start, end = shaped.clipped((np.arange(COUNT), np.zeros(COUNT), np.full(COUNT, 20.0)), origin, ray, light)
    assert 0.02 < len(which) / COUNT < 0.9
    for share, lit in ((1e-6, True), (0.5, True), (1 - 1e-6, True), (-1e-6, False), (1 + 1e-6, False)):
        t = start + share * (end - start)
        found = light.incident(origin[which] + t[:, None] * ray[which])[2] > 0
        within = lit | ((start > 1e-9) if share < 0 else (end < 20 - 1e-9))
        assert (found[within] == lit).mean() > 0.99


def test_colours_of_a_light_with_a_cookie() -> None:
    pixels = RNG.uniform(size=(4, 8, 3))
    projector = ProjectorLight(WHITE, fov=(math.radians(90), math.radians(60)), cookie=Cookie(pixels))
    wide, high = 1.0, math.tan(math.radians(30))
    points = 3 * np.array([[-0.875 * wide, 0.75 * high, -1], [0.875 * wide, -0.75 * high, -1], [0, 0, 1]])
    np.testing.assert_allclose(projector.colour(points), [pixels[0, 0], pixels[3, 7], np.zeros(3)], atol=1e-12)
    sun = DirectionalLight(WHITE, (0.0, 1.0, 0.0), cookie=Cookie(pixels, size=4.0))  # from above: right and up are +X and -Z, or turned
    axes = sun.axes()
    np.testing.assert_allclose(axes[2], (0, -1, 0))
    at = axes[0] * 0.25 + axes[1] * 0.25 + RNG.normal(size=(5, 1)) * axes[2]
    np.testing.assert_allclose(sun.colour(at), np.tile(sun.cookie.at([0.5625, 0.375], True), (5, 1)))  # type: ignore[union-attr]
    np.testing.assert_allclose(sun.colour(at + 4 * axes[0] - 2 * axes[1]), sun.colour(at))


def test_what_is_alike_everywhere_is_no_shape() -> None:
    grey = Cookie(np.full((3, 4, 3), 0.25))
    for light in (SpotLight(WHITE, cookie=grey), PointLight(WHITE), DirectionalLight(WHITE)):
        assert shape_of(light) == "none"
    np.testing.assert_array_equal(even_colour(SpotLight(WHITE, cookie=grey)), [0.25] * 3)
    assert even_colour(SpotLight(WHITE, cookie=Cookie(RNG.uniform(size=(3, 4, 3))))) is None
