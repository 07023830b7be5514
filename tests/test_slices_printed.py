"""Slices as a chapter of 2004 prints them: the GPU against its float64 twin, and what is known without it."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_article import camera, depth_of, projection, rays
from written import depth_texture

from airlight.errors import AirlightError
from airlight.gpu.device import open_device
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March, Medium, Parameters
from airlight.options.presets import load
from airlight.reference import slices as twin
from airlight.scatter.slices.noise_maps import noise_maps
from airlight.scatter.slices.printed import FALLOFFS, MOST, Diced, Extruded, Printed, Thickness, planes_at
from airlight.scatter.slices.records import view_box
from airlight.shadows import Shadow

PIXELS, SIDE = (19, 13), 32


def medium(march: March, **air: Any) -> ResolvedMedium:
    return resolve(Medium(max_distance=60.0, **air), march, "normal", 10.0)


def projector(view: np.ndarray, seed: int, **more: Any) -> ProjectorLight:
    """Before the camera, across its view."""
    into = np.linalg.inv(view)
    rng = np.random.default_rng(seed)
    direction = into[:3, :3] @ np.array([1.0, *rng.uniform(-0.3, 0.3, 2)])
    up = np.cross(np.cross(direction, [0.1, 1.0, 0.3]), direction)
    place = (into @ [-4.0, *rng.uniform(-1, 1, 1), -9.0, 1.0])[:3]
    unit = [tuple((v / np.linalg.norm(v)).tolist()) for v in (direction, up)]
    return ProjectorLight(
        (3.0, 2.0, 1.0), tuple(place.tolist()), *unit, fov=(0.7, 0.5), near=0.5, far=9.0, cookie=Cookie(rng.random((7, 9, 3))), **more
    )


def pictured(
    march: March, view: np.ndarray, light: PunctualLight, depths: np.ndarray, shadow: Shadow | None = None, time: float = 0.0
) -> np.ndarray:
    """(height, width, 3)"""
    device = open_device()
    made = Printed(device, (depths.shape[1], depths.shape[0]))
    air = dataclasses.replace(medium(march), time=time)
    made.update(view, projection(), [(light, shadow)], made.resolve(air))
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, depths))
    device.submit(encoder)
    out = np.frombuffer(device.read(made.layer, 16), np.float32).reshape(*depths.shape, 4)
    assert np.all(out[..., 3] == 0) and made.transmittance is None
    return out[..., :3]


def scene(seed: int, size: tuple[int, int] = PIXELS) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """A camera, the depths it sees, and its rays in the world: begins, directions, lengths."""
    rng = np.random.default_rng(seed)
    view = camera(seed)
    origins, directions = rays(projection(), size)
    lengths = rng.uniform(3, 30, size[::-1])
    depths = depth_of(projection(), origins + lengths[..., None] * directions)
    into = np.linalg.inv(view)
    return view, depths, (origins @ into[:3, :3].T + into[:3, 3], directions @ into[:3, :3].T, lengths)


def shadow_of(light: PunctualLight, view: np.ndarray, seed: int, march: March) -> Shadow:
    """A map full of holes."""
    rng = np.random.default_rng(seed)
    air = dataclasses.replace(medium(march), shadow_size=SIDE)
    views = light.shadow_views(view, projection(), np.linalg.inv(view)[:3, 3] + rng.uniform(-20, 20, (3, 8, 3)), air)
    maps = np.where(rng.random((len(views), SIDE, SIDE)) < 0.6, 0, rng.uniform(0.05, 0.3, (len(views), SIDE, SIDE))).astype(np.float32)
    shadow = Shadow(depth_texture(open_device(), maps), SIDE, views)
    shadow.maps = maps  # type: ignore[attr-defined]
    return shadow


def of_projector(view: np.ndarray, seed: int) -> tuple[Any, Any]:
    one = projector(view, seed)
    return one.position, one.direction


LIGHTS = {
    "projector": projector,
    "spot": lambda view, seed: SpotLight((1.0, 2.0, 0.5), *of_projector(view, seed), outer=0.4, range=8.0),
    "point": lambda view, seed: PointLight((2.0, 1.0, 1.0), projector(view, seed).position, range=5.0),
    "sun": lambda view, seed: DirectionalLight((1.0, 1.0, 0.5), (0.3, 0.9, 0.1)),
}


@pytest.mark.parametrize("kind", LIGHTS)
@settings(max_examples=4)
@given(st.integers(0, 2**31), st.booleans(), st.booleans(), st.sampled_from([*FALLOFFS]), st.sampled_from([None, 13, 100]))
def test_the_passes_are_their_twin(kind: str, seed: int, noisy: bool, mask: bool, falloff: str, planes: int | None) -> None:
    view, depths, (origins, directions, lengths) = scene(seed)
    march = March(plane_noise=noisy, plane_mask=mask, plane_falloff=falloff, planes=planes, plane_noise_seed=seed % 5)
    light = LIGHTS[kind](view, seed)
    shadow = shadow_of(light, view, seed, march)
    out = pictured(march, view, light, depths, shadow, time=3.0)
    count = planes or MOST
    ways = [np.array(way) / np.linalg.norm(way) * speed * 3.0 for way, speed in (((1, 0.35), 0.02), ((-0.6, 0.8), 0.013))]
    want = twin.printed(
        origins, directions, np.minimum(lengths, 60.0), view, light, view_box(light, view, medium(march)), count,
        falloff=FALLOFFS["none" if light.directional else falloff], mask=mask,
        maps=noise_maps(seed % 5).astype(float) if noisy else None, scroll=np.concatenate(ways),
        shadows=list(zip((v.matrix for v in shadow.views), shadow.maps, strict=True)),
    )  # fmt: skip
    expected = want[..., None] * np.array(light.intensity) / max(light.intensity)
    off = np.abs(out - expected).max(axis=-1) * 255 * (4 if mask else 1)
    # A sample near the border of a code, a texel or a part of the volume may fall to either side in f32
    assert np.quantile(off, 0.9) <= 2 and off.mean() < 3
    assert expected.max() > 0.05 or kind == "sun"


def test_what_is_cut_off_is_dark() -> None:
    """Clipping saves time, and changes nothing."""
    view, depths, _ = scene(3, (64, 40))
    light = projector(view, 3)
    cut, whole = (pictured(March(plane_clip=clip), view, light, depths) for clip in (True, False))
    assert cut.max() > 0.1 and (cut != whole).any(axis=2).mean() < 0.02


def test_fewer_planes_are_as_bright() -> None:
    view, _, _ = scene(5, (64, 40))
    light, depths = dataclasses.replace(projector(view, 5), cookie=None), np.ones((40, 64))
    means = [pictured(March(planes=n, plane_falloff="none", plane_unit=1.0), view, light, depths).mean() for n in (25, 50, 100)]
    assert means == pytest.approx([means[2]] * 3, rel=0.12) and means[2] > 0.01  # without the scale a quarter, and a half


def test_the_mask_has_two_more_bits() -> None:
    """Of light that falls slowly, four channels show more of its levels, and are nearer the truth."""
    view, _, _ = scene(5, (64, 40))
    light, depths = dataclasses.replace(projector(view, 5), cookie=None), np.ones((40, 64))
    air = medium(March())
    origins, directions = rays(projection(), (64, 40))
    into = np.linalg.inv(view)
    seen = origins @ into[:3, :3].T + into[:3, 3], directions @ into[:3, :3].T, np.full((40, 64), 60.0)
    out = {}
    for mask in (False, True):
        march = March(plane_mask=mask, plane_falloff="inverse-square", plane_unit=100.0)
        out[mask] = pictured(march, view, light, depths)[..., 0]
    falls = FALLOFFS["inverse-square"]
    fine = twin.printed(*seen, view, light, view_box(light, view, air), MOST, falloff=falls, unit=100.0, mask=False, codes=1e9)
    off = {mask: float(np.sqrt(np.mean((out[mask] - fine) ** 2))) for mask in out}
    assert fine.max() > 0.1 and off[True] < 0.4 * off[False]


def test_each_switch_makes_its_shader() -> None:
    """The chapter's three booleans, and the cookie that is white where there is none."""
    view, depths, _ = scene(4, (48, 32))
    light = projector(view, 4)
    shadow = shadow_of(light, view, 4, March())
    plain = pictured(March(plane_shadow=False, plane_cookie=False), view, light, depths, shadow)
    white = dataclasses.replace(light, cookie=Cookie(np.ones((3, 3, 3))))
    assert np.array_equal(plain, pictured(March(plane_shadow=False), view, white, depths, shadow))
    dark = pictured(March(), view, light, depths, shadow)
    assert (dark <= plain + 1e-6).all() and dark.mean() < 0.8 * plain.mean()
    noisy = pictured(March(plane_shadow=False, plane_cookie=False, plane_noise=True), view, light, depths, shadow)
    assert noisy.std() > 0 and not np.array_equal(noisy, plain)
    assert noisy.mean() == pytest.approx(plain.mean(), rel=0.3)  # 0.05 / 4 of both maps' means, for 0.015


def test_fewer_planes_lie_far_away() -> None:
    assert [planes_at((0, 0, z), 100, 10.0) for z in (3, 10, 20, 1e9)] == [100, 100, 50, 4]
    assert planes_at((0, 0, 50.0), 100, None) == 100 and planes_at((0, 0, math.inf), 100, 1.0) == 100
    assert planes_at((0, 0, 1e9), 3, 1.0) == 3


def test_noise_maps_are_tiles() -> None:
    """Their borders go on at each other, another seed is another map, and both halves differ."""
    one, other = noise_maps(0), noise_maps(1)
    assert one.min() >= 0 and one.max() <= 1 and one.mean() == pytest.approx(0.5, abs=0.02)
    inner = np.abs(np.diff(one, axis=0)).mean()
    assert np.abs(one[0] - one[-1]).mean() < 1.3 * inner and np.abs(one[:, 0] - one[:, -1]).mean() < 1.3 * inner
    assert np.abs(one - other).mean() > 0.1 and np.abs(one[..., 0] - one[..., 1]).mean() > 0.1


def test_the_blur_is_its_twin() -> None:
    view, depths, _ = scene(8, (40, 26))
    light = projector(view, 8)
    sharp, soft = (pictured(March(plane_blur=n, plane_blur_radius=3.0), view, light, depths) for n in (1, 7))
    np.testing.assert_allclose(soft, twin.blurred(sharp.astype(float), (40, 26), 7, 3.0), atol=1e-5)
    assert np.abs(np.diff(soft, axis=1)).mean() < 0.7 * np.abs(np.diff(sharp, axis=1)).mean()


def test_two_lights_add() -> None:
    view, depths, _ = scene(9, (32, 20))
    device, lights = open_device(), [projector(view, 9), LIGHTS["point"](view, 9)]
    made = Printed(device, (32, 20))
    made.update(view, projection(), [(one, None) for one in lights], medium(March()))
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, depths))
    device.submit(encoder)
    both = np.frombuffer(device.read(made.layer, 16), np.float32).reshape(20, 32, 4)[..., :3]
    np.testing.assert_allclose(both, sum(pictured(March(), view, one, depths) for one in lights), atol=1e-6)


def test_the_preset_is_the_chapter() -> None:
    values = load("shaderx3")
    assert values["method"] == "slices-printed" and Parameters(method=values["method"]).method == "slices-printed"
    assert [values[name] for name in ("planes", "plane_falloff", "plane_mask", "plane_noise")] == [100, "ambient", True, True]


def test_boxes_hold_the_volume() -> None:
    """A projector's corners lie in its box, and on its sides."""
    view, _, _ = scene(2)
    light = projector(view, 2)
    low, high = view_box(light, view, medium(March()))
    rng = np.random.default_rng(2)
    places = light.origin() + rng.uniform(-12, 12, (20000, 3))
    inside = places[np.all(places @ light.planes()[:, :3].T + light.planes()[:, 3] >= 0, axis=1)]
    seen = (inside @ view[:3, :3].T + view[:3, 3]) * (1, 1, -1)
    assert len(seen) > 100 and (seen >= low - 1e-9).all() and (seen <= high + 1e-9).all()
    assert (seen.min(axis=0) - low).max() < 1.5 and (high - seen.max(axis=0)).max() < 1.5


# ---------------------------------------------------------------- earlier practice


def earlier(kind: type[Printed], view: np.ndarray, light: PunctualLight, depths: np.ndarray, shadow: Shadow | None = None) -> np.ndarray:
    """(height, width, 3)"""
    device = open_device()
    made = kind(device, (depths.shape[1], depths.shape[0]))
    made.update(view, projection(), [(light, shadow)], made.resolve(medium(March())))
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, depths))
    device.submit(encoder)
    return np.frombuffer(device.read(made.layer, 16), np.float32).reshape(*depths.shape, 4)[..., :3]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_earlier_practice_is_its_twin(seed: int) -> None:
    view, depths, (origins, directions, lengths) = scene(seed, (40, 26))
    light = projector(view, seed)
    tint = np.array(light.intensity) / max(light.intensity)
    maps = noise_maps(0).astype(float)
    for kind, dices in ((Extruded, 1), (Diced, 12)):
        want = twin.polygons(origins, directions, lengths, light, (light.near, light.far), dices, maps)
        off = np.abs(earlier(kind, view, light, depths) - want[..., None] * tint).max(axis=-1)
        assert np.quantile(off, 0.97) < 1e-3 and want.max() > 0.05
    want = twin.thickness(origins, directions, lengths, light)
    np.testing.assert_allclose(earlier(Thickness, view, light, depths), np.repeat(want[..., None], 3, axis=2), atol=2e-4)


def test_earlier_practice_fails_where_the_chapter_says() -> None:
    """It knows no shadow; and thickness no colour, nor cookie."""
    view, depths, _ = scene(4, (40, 26))
    light = projector(view, 4)
    shadow = shadow_of(light, view, 4, March())
    for kind in (Extruded, Diced, Thickness):
        assert np.array_equal(earlier(kind, view, light, depths), earlier(kind, view, light, depths, shadow))
    thick = earlier(Thickness, view, dataclasses.replace(light, intensity=(1.0, 0.0, 0.0), cookie=None), depths)
    assert np.array_equal(thick, earlier(Thickness, view, light, depths)) and np.ptp(thick, axis=2).max() == 0


@pytest.mark.parametrize("kind", ["sun", "point"])
def test_earlier_practice_needs_a_window(kind: str) -> None:
    view, depths, _ = scene(4, (8, 8))
    for one in (Extruded, Diced, Thickness):
        with pytest.raises(AirlightError, match=rf"method {one.name} takes projectors and spots \(here: {kind}\)"):
            earlier(one, view, LIGHTS[kind](view, 4), depths)
