"""Light in rooms: none where the sun, however strong, cannot shine, and what a window lets in is where it should be."""

from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")
from rasterising import edge_error  # noqa: E402
from room import camera, in_beam, room, seen  # noqa: E402

from airlight.options import March, Medium, Parameters, SceneOptions  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.scenes.offline import Shot, Studio  # noqa: E402
from airlight.scenes.stage import Stage  # noqa: E402

SIZE = 160, 90
LUX, CANDELA = 68_300.0, 54_351.0
SIGMA, ALBEDO = 0.05, 0.9
WAYS = {
    "exact": March(steps="exact"),
    "steps": March(steps=48),
    "pcf": March(steps=48, shadow_filter="pcf"),
    "coarse": March(steps="exact", shadow_size=512),
}
SUNS = [(0.8336, 0.5523, 0.0), (0.5, 0.8, 0.3), (0.0, 1.0, 0.0), (0.05, 0.2, 1.0), (-0.3, 0.9, 0.6), (0.999, 0.02, 0.01), (1.0, 1.0, 1.0)]
LAMPS = [(4.0, 5.0, 2.0), (0.0, 1.5, -6.0), (-3.5, 3.2, -4.3)]


def spot(position: Any, target: Any) -> SceneLight:
    light = gfx.SpotLight(intensity=CANDELA, angle=0.9, decay=2)
    light.local.position, light.target.local.position = position, target
    return SceneLight(target=light)


def layer(things: list[Any], light: SceneLight, march: March) -> np.ndarray:
    """(H, W, 3) in-scattered radiance."""
    scene, eye = gfx.Scene().add(*things), camera(*SIZE)
    if light.target is not None:
        scene.add(light.target)
    stage = Stage("room", scene, {"eye": eye}, [light], 0.0, lambda t, camera=None: None, np.array([0.0, 1.5, 0.0]), 5.0)
    medium = Medium(sigma_t=(SIGMA,) * 3, albedo=(ALBEDO,) * 3, max_distance=40.0, phase="isotropic")
    studio = Studio(
        stage, Shot(*SIZE, samples=1), Parameters(method="march"), in_scene=SceneOptions(resolution=1.0), medium=medium, march=march
    )
    assert isinstance(studio.shafts, LightShafts)
    found = studio.frame(layer=True).layer
    assert found is not None
    return found[..., :3]


@pytest.mark.parametrize("way", [way if way == "exact" else pytest.param(way, marks=pytest.mark.slow) for way in WAYS])
def test_a_closed_room_is_dark(way: str) -> None:
    """Less than a millionth of what the light would scatter into a metre, but for a pixel on a joint."""
    for towards in SUNS:
        found = layer(room(), SceneLight(direction=towards, color=(LUX,) * 3), WAYS[way])
        assert np.count_nonzero(found.max(axis=-1) > 1e-6 * LUX * SIGMA * ALBEDO / (4 * np.pi)) <= 1, towards
    lamps = [SceneLight(position=place, color=(CANDELA,) * 3) for place in LAMPS]
    for light in [*lamps, spot((4.0, 5.0, 2.0), (0.0, 1.0, 0.0)), spot((-3.5, 3.2, -4.3), (0.0, 0.0, 0.0))]:
        found = layer(room(), light, WAYS[way])
        assert np.count_nonzero(found.max(axis=-1) > 1e-6 * CANDELA * SIGMA * ALBEDO / (4 * np.pi * 25)) <= 1, light


@pytest.mark.parametrize("way", ["exact", "steps", "pcf"])
@pytest.mark.parametrize("direction", [(0.8336, 0.5523, 0.0), (0.8, 0.4, 0.3), (0.6, 0.3, -0.25)])
def test_light_through_a_window_is_in_its_beam_alone(way: str, direction: Any) -> None:
    """And it is what it should be there, up to the floor and the walls that it falls on."""
    towards = np.array(direction) / np.linalg.norm(direction)
    found = layer(room(window=True), SceneLight(direction=direction, color=(LUX,) * 3), WAYS[way])[..., 0]
    eye = camera(*SIZE)
    ends, reach = seen(eye, *SIZE)
    place, steps = np.asarray(eye.world.position, float), 600
    t = (np.arange(steps) + 0.5) / steps * reach[..., None]
    points = place + (ends - place)[..., None, :] * (t / reach[..., None])[..., None]
    beside = ~in_beam(points, towards, 0.02).any(axis=-1) & (ends[..., 0] < 2.99)
    assert beside.sum() > 3000 and np.count_nonzero(found[beside] > 1e-6 * LUX * SIGMA * ALBEDO / (4 * np.pi)) <= 1
    lit = in_beam(points, towards) * np.exp(-SIGMA * t)
    truth = LUX * SIGMA * ALBEDO / (4 * np.pi) * lit.mean(axis=-1) * reach
    inside = ends[..., 0] < 2.99  # whose ends are not seen through the window
    off_by_rows = 3.6e-3 + 0.12 * edge_error()  # of texels, where an edge lies along them
    assert found[inside].mean() == pytest.approx(truth[inside].mean(), rel=off_by_rows)
    if way == "exact":
        assert np.sqrt(np.mean((found - truth)[inside] ** 2)) < 0.025 * truth[inside].mean()
