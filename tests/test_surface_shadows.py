"""Shadows on surfaces by maps of our own: no light through joints, no surface that shades itself, and who casts."""

import gc
import logging
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from calling import call

gfx = pytest.importorskip("pygfx")
import pylinalg as la  # noqa: E402
from prepass_scene import morphed_ball, skinned_bar  # noqa: E402
from room import camera, in_beam, room, seen  # noqa: E402

from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.reference import shadows as twin  # noqa: E402
from airlight.scenes.offline import Shot, make_renderer  # noqa: E402

RNG = np.random.default_rng(5)
SIZE = 160, 90
SUNS = [(0.8336, 0.5523, 0.0), (0.5, 0.8, 0.3), (0.0, 1.0, 0.0), (0.05, 0.2, 1.0), (-0.3, 0.9, 0.6), (0.999, 0.02, 0.01), (1.0, 1.0, 1.0)]
KERNEL = "pygfx/shadow_kernel.wgsl"


@pytest.fixture(autouse=True)
def _no_errors(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    yield
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def sun(direction: Any, intensity: float = 8.0) -> Any:
    light = gfx.DirectionalLight(intensity=intensity, cast_shadow=True)
    light.local.position = 10 * np.array(direction) / np.linalg.norm(direction)
    return light


def spot(position: Any, target: Any, angle: float = 0.9) -> Any:
    light = gfx.SpotLight(intensity=300.0, angle=angle, decay=2, cast_shadow=True)
    light.local.position, light.target.local.position = position, target
    return light


def point(position: Any) -> Any:
    light = gfx.PointLight(intensity=300.0, decay=2, cast_shadow=True)
    light.local.position = position
    return light


class Film:
    """A scene and a camera with a renderer whose surfaces take their shadows from our maps."""

    def __init__(self, things: list[Any], eye: Any, size: tuple[int, int] = SIZE, own: bool = True) -> None:
        self.scene, self.eye = gfx.Scene().add(gfx.AmbientLight(intensity=1.0), *things), eye
        self.renderer = make_renderer(Shot(*size, samples=1))
        self.shafts = LightShafts(self.renderer, self.scene, eye, [SceneLight(position=(0.0, 0.0, 0.0))]) if own else None

    def picture(self) -> np.ndarray:
        """(H, W) linear."""
        self.renderer.render(self.scene, self.eye)
        return np.asarray(self.renderer.snapshot()[..., 0], np.float32)


def test_the_kernel() -> None:
    x = RNG.uniform(-5, 5, (200, 4)).astype(np.float32)
    np.testing.assert_allclose(call(KERNEL, "kernel_weight", [x]), twin.kernel_weight(x), atol=1e-6)
    way = RNG.normal(size=(300, 3)).astype(np.float32)
    np.testing.assert_array_equal(call(KERNEL, "cube_face", [way]), twin.cube_face(way))
    assert set(twin.cube_face(way)) == set(range(6))
    at, step = RNG.uniform(0.5, 3, (200, 4)).astype(np.float32), RNG.normal(size=(200, 4)).astype(np.float32)
    np.testing.assert_allclose(call(KERNEL, "map_derivative", [at, step]), twin.map_derivative(at, step), rtol=1e-4, atol=1e-5)
    u, v, area = RNG.normal(size=(200, 3)).astype(np.float32), RNG.normal(size=(200, 3)).astype(np.float32), np.float32(0.3)
    np.testing.assert_allclose(call(KERNEL, "depth_slope", [u, v, area]), twin.depth_slope(u, v, area), rtol=1e-3, atol=1e-4)
    weight, above = RNG.random((200, 4)).astype(np.float32), RNG.normal(size=(200, 4)).astype(np.float32)
    bias, casts = RNG.uniform(0, 0.3, (200, 4)).astype(np.float32), RNG.random(200) < 0.5
    found, truth = call(KERNEL, "weigh_texels", [weight, above, bias, casts]), twin.weigh_texels(weight, above, bias, casts)
    np.testing.assert_allclose(found, truth, atol=1e-6)
    assert (truth[casts, 1] < truth[~casts, 1].mean()).any() and np.ptp(truth[:, 0]) > 0.5


@pytest.mark.parametrize("light", [*map(sun, SUNS), spot((4, 5, 2), (0, 1, 0)), point((4, 5, 2)), point((0, 1.5, -6))], ids=range(10))
def test_no_light_comes_through_the_joints_of_a_room(light: Any) -> None:
    """A closed room with a light outside is as without it, but for what falls on a joint itself."""
    film = Film([*room(), light], camera(*SIZE))
    found = film.picture()
    light.cast_shadow = False
    full = film.picture()
    light.intensity = 0
    leaking = found - film.picture()
    assert (full - found).max() > 0.4 and leaking.min() >= 0
    assert np.count_nonzero(leaking) <= 4 and leaking.sum() < 0.5 * (full - found).max()


def test_no_dots_along_joints_that_lie_aslant_in_the_map() -> None:
    """A wall's texel within the bias of a joint is taken for the surface: its neighbour tells, though it is not in the kernel's middle."""
    size, dots = (640, 360), 0
    for direction in ((0.3455, 0.8216, 0.3304), (-1.3032, 0.9054, 0.4464), (-0.5370, 0.5811, 0.3646), (-0.7365, 0.1629, -0.4821)):
        light = sun(direction)
        film = Film([*room(), light], camera(*size), size)
        found = film.picture()
        light.cast_shadow = False
        full = film.picture()
        light.intensity = 0
        dots += np.count_nonzero(found - film.picture() > 0.05 * (full - found).max())
    assert dots <= 9


@pytest.mark.parametrize("direction", [(0.8336, 0.5523, 0.0), (0.8, 0.4, 0.3), (0.6, 0.3, -0.25)])
def test_light_through_a_window_falls_where_it_should(direction: Any) -> None:
    way = np.array(direction) / np.linalg.norm(direction)
    light, eye = sun(direction), camera(*SIZE)
    film = Film([*room(window=True), light], eye)
    found = film.picture()
    light.cast_shadow = False
    full = film.picture()
    light.intensity = 0
    dark = film.picture()
    points, _ = seen(eye, *SIZE)
    deep = (np.abs(points[..., 0]) < 2.95) & (full > dark)  # not on the wall of the window, and turned to the sun
    within, around = in_beam(points, way, -0.03) & deep, in_beam(points, way, 0.03)
    assert within.sum() > 50
    np.testing.assert_allclose(found[within], full[within], rtol=2e-3)
    outside = ~around & (np.abs(points[..., 0]) < 2.95)
    assert outside.sum() > 5000 and np.count_nonzero(found[outside] - dark[outside]) <= 3


@pytest.mark.parametrize("casts", [True, False])
@pytest.mark.parametrize(
    "light", [sun((0.3, 1, 0.2)), sun((1, 0.1, 0.3)), sun((0, 1, 0)), spot((1, 3, 1), (0, 0, 0)), point((2, 1, 0.5))], ids=range(5)
)
def test_nothing_that_is_lit_shades_itself(light: Any, casts: bool) -> None:
    """A floor, a ball and a bowl: what is lit is lit in full, whatever its slope."""
    floor = gfx.Mesh(gfx.plane_geometry(8, 8), gfx.MeshStandardMaterial(side="both"))
    floor.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    floor.receive_shadow, floor.cast_shadow = True, casts
    eye = gfx.PerspectiveCamera(50, SIZE[0] / SIZE[1], depth_range=(0.1, 100))
    eye.local.position = (1, 4, 5)
    eye.look_at((0, 0, 0))
    far = gfx.Mesh(gfx.box_geometry(0.1, 0.1, 0.1), gfx.MeshStandardMaterial())  # what the map has to hold in any case
    far.local.position, far.cast_shadow = (-6, 0.1, -6), True
    film = Film([floor, far, light], eye)
    found = film.picture()
    light.cast_shadow = False
    np.testing.assert_allclose(found, film.picture(), rtol=2e-3)


def ball_on_floor(ball: Any, light: Any, size: tuple[int, int] = SIZE) -> tuple[Film, Any]:
    floor = gfx.Mesh(gfx.plane_geometry(8, 8), gfx.MeshStandardMaterial())
    floor.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    ball.cast_shadow = floor.receive_shadow = True
    eye = gfx.PerspectiveCamera(50, size[0] / size[1], depth_range=(0.1, 100))
    eye.local.position = (0, 7, 0.01)
    eye.look_at((0, 0, 0))
    return Film([floor, ball, light], eye, size), eye


def shade(film: Film, light: Any) -> np.ndarray:
    """(H, W) what is missing of the light, 0..1."""
    found = film.picture()
    light.cast_shadow = False
    full = film.picture()
    light.intensity, light.cast_shadow = 0, True
    dark = film.picture()
    return np.clip((full - found) / np.maximum(full - dark, 1e-6), 0, 1)


def test_cut_outs_cast_their_holes() -> None:
    """A sheet with a hole above a floor, which pygfx's own maps have without it."""
    pixels = np.full((64, 64, 4), 255, np.uint8)
    pixels[16:48, 16:48, 3] = 0
    sheet = gfx.Mesh(gfx.plane_geometry(2, 2), gfx.MeshStandardMaterial(map=gfx.Texture(pixels, dim=2), alpha_test=0.5, side="both"))
    sheet.material.alpha_mode = "solid"
    sheet.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    sheet.local.position = (0, 1, 0)
    light = sun((1.0, 1.0, 0.0))
    film, _ = ball_on_floor(sheet, light)
    dark = shade(film, light)
    # the shadow is a square of 2 m around x = -1, its hole one of 1 m; the sheet hides what lies beyond -1.17; 19 pixels are 1 m
    assert dark[45, 55] < 0.02 and dark[45, 47] > 0.98 and dark[45, 38] < 0.02 and dark[45 - 14, 55] > 0.98


def test_skins_and_morphs_cast_in_their_pose() -> None:
    """A ball that a morph target makes larger has a larger shadow."""
    light = sun((1.0, 1.0, 0.0))
    areas = []
    for share in (0.0, 1.0):
        ball = morphed_ball()
        ball.morph_target_influences = [share]
        ball.local.position = (0, 1.5, 0)
        light = sun((1.0, 1.0, 0.0))
        film, _ = ball_on_floor(ball, light)
        areas.append(shade(film, light).sum())
    assert areas[1] > 1.2 * areas[0] > 0 or areas[0] > 1.2 * areas[1] > 0
    shadows = []
    for turn in (0.0, -1.2):
        bar, bone = skinned_bar()
        bone.local.rotation = la.quat_from_euler((0, 0, turn))
        bar.local.position = (0, 1.5, 0)
        light = sun((1.0, 1.0, 0.0))
        film, _ = ball_on_floor(bar, light)
        shadows.append(shade(film, light))
    assert min(dark.sum() for dark in shadows) > 20 and np.abs(shadows[0] - shadows[1]).sum() > 20


def test_what_casts_no_shadow_casts_none_and_a_small_shadow_camera_is_followed() -> None:
    ball, light = gfx.Mesh(gfx.sphere_geometry(0.5), gfx.MeshStandardMaterial()), sun((1.0, 1.0, 0.0))
    ball.local.position = (0, 1.5, 0)
    film, _ = ball_on_floor(ball, light)
    there = shade(film, light)
    assert there.max() > 0.99 and 350 < there[:, :66].sum() < 450
    light = sun((1.0, 1.0, 0.0))
    film, _ = ball_on_floor(ball, light)
    light.cast_shadow, ball.cast_shadow = True, False
    assert shade(film, light)[:, :66].max() < 0.01
    ball.cast_shadow = True
    light = sun((1.0, 1.0, 0.0))
    light.local.position = (10, 10, 8)
    light.target.local.position = (0, 0, 8)
    light.shadow.camera.width = light.shadow.camera.height = 0.4
    film, _ = ball_on_floor(ball, light)
    assert shade(film, light)[:, :66].max() < 0.01


def test_a_renderer_without_shafts_draws_as_pygfx_does() -> None:
    """Whatever is drawn by ours before and after."""
    ball, light = gfx.Mesh(gfx.sphere_geometry(0.5), gfx.MeshStandardMaterial()), sun((1.0, 1.0, 0.0))
    light.shadow.camera.width = light.shadow.camera.height = 20
    ball.local.position = (0, 1.5, 0)
    film, eye = ball_on_floor(ball, light)
    ours = film.picture()
    plain = Film([], eye, own=False)
    plain.scene = film.scene
    first = plain.picture()
    assert np.abs(first - ours).max() > 0.01  # edges of a shadow
    again = film.picture()
    assert np.array_equal(ours, again) and np.array_equal(first, plain.picture())
    film.shafts = None  # nobody draws our maps any more
    gc.collect()
    assert np.array_equal(film.picture(), first)
