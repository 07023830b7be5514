"""The march: the exact texel walk and its steps, against float64 sums over the same shadow maps and against scenes with known answers."""

import math
from typing import Any

import numpy as np
import pytest
from written import depth_texture

from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.lamps import Lamp
from airlight.medium import Settled, settle
from airlight.parameters import March as Marching
from airlight.parameters import Medium
from airlight.reference import medium as twin
from airlight.scatter.march.march import March
from airlight.shadows import Shadow, View

SIZE = 24, 16
RGB = (0.1, 0.2, 0.05)
SUN = np.array([0.3, 0.6, 0.74]) / np.linalg.norm([0.3, 0.6, 0.74])
PLACE = np.array([1.0, 0.5, -6.0])
SPOT = {"position": tuple(PLACE), "direction": (-0.6, 0.0, -0.8), "inner": 0.3, "outer": 0.5}


def projection(fov: float = 50.0) -> np.ndarray:
    near, far, slope = 0.1, 100.0, math.tan(math.radians(fov) / 2)
    out = np.zeros((4, 4))
    out[0, 0], out[1, 1] = SIZE[1] / SIZE[0] / slope, 1 / slope
    out[2, 2], out[2, 3], out[3, 2] = -far / (far - near), -far * near / (far - near), -1
    return out


def depths(values: Any) -> Any:
    """A depth texture array that holds (layers, H, W) values."""
    return depth_texture(open_device(), values)


def air(radius: float = 10.0, **values: Any) -> Settled:
    """max_distance 20 times a tenth of the radius, exact, unless told otherwise."""
    values = {"sigma_t": RGB, "max_distance": 2 * radius, **values}
    medium = {k: v for k, v in values.items() if k in Medium.__struct_fields__}
    marching = {k: v for k, v in values.items() if k in Marching.__struct_fields__}
    return settle(Medium(**medium), Marching(**marching), "final", radius)


def layer(
    lamps: Any, air: Settled, view: Any = None, depth: Any = 1.0, jitter: str = "midpoint", share: float = 1.0, fov: float = 50.0
) -> np.ndarray:
    """(H, W, 4) of the picture."""
    device = open_device()
    march = March(device, SIZE)
    march.aim(np.eye(4) if view is None else view, projection(fov), lamps, air, jitter=jitter, share=share)
    seen = depths(np.broadcast_to(np.asarray(depth, float), (1, SIZE[1], SIZE[0])))
    run_ms(device, lambda encoder: march.record(encoder, seen))
    return np.frombuffer(device.read(march.layer, 16), np.float32).reshape(SIZE[1], SIZE[0], 4)


def rays(fov: float = 50.0) -> np.ndarray:
    """(H, W, 3) unit directions of the pixels' rays, from the origin."""
    p = projection(fov)
    x, y = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2
    out = np.stack([*np.broadcast_arrays(x / p[0, 0], (y / p[1, 1])[:, None], -1.0)], axis=-1)
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def sun_view(side: int = 48, width: float = 20.0) -> View:
    x = np.cross([0, 1, 0], SUN)
    x /= np.linalg.norm(x)
    texel, matrix = width / side, np.zeros((4, 4))
    matrix[0, :3], matrix[1, :3], matrix[2, :3] = x / texel, -np.cross(SUN, x) / texel, SUN / 30
    matrix[:, 3] = side / 2, side / 2 + 7, 0.5, 1
    return View(matrix, texel=texel, depth_scale=30.0)


def lamp_view(ahead: Any, half: float, side: int = 48, margin: int = 0, near: float = 0.05) -> View:
    ahead = np.asarray(ahead, float)
    right = np.cross(ahead, [0, 0, 1] if abs(ahead[1]) > 0.5 else [0, 1, 0])
    right /= np.linalg.norm(right)
    scale, matrix = (side / 2 - margin) / half, np.zeros((4, 4))
    matrix[0, :3] = scale * right + side / 2 * ahead
    matrix[1, :3] = -scale * np.cross(right, ahead) + side / 2 * ahead
    matrix[3, :3] = ahead
    matrix[:, 3] = -matrix[:, :3] @ PLACE
    matrix[2, 3] = near
    return View(matrix, texel=1 / scale, depth_scale=near)


def faces() -> list[View]:
    return [lamp_view(sign * axis, 1.0, margin=1) for axis in np.eye(3) for sign in (1, -1)]


def lit(views: list[View], heights: np.ndarray, points: np.ndarray, pcf: bool = False) -> np.ndarray:
    """(...) 0..1 of points (..., 3) that are seen by the light; by the view with the greatest w, beyond a map everything is."""
    found = np.ones(points.shape[:-1])
    best = np.full(points.shape[:-1], -np.inf)

    def clear(held: np.ndarray, x: np.ndarray, y: np.ndarray, depth: np.ndarray) -> np.ndarray:
        side = held.shape[0]
        there = held[np.clip(y, 0, side - 1).astype(int), np.clip(x, 0, side - 1).astype(int)]
        inside = (x >= 0) & (x < side) & (y >= 0) & (y < side)
        return np.where(inside & (there > 0), depth >= there, True).astype(float)  # 0: nothing casts there

    for view, held in zip(views, heights, strict=True):
        at = points @ view.matrix[:, :3].T + view.matrix[:, 3]
        w = np.where(at[..., 3] > 0, at[..., 3], 1e-30)
        x, y, depth = (np.clip(at[..., k] / w, -1e6, 1e6) for k in range(3))
        if pcf:
            u, v = np.floor(x - 0.5), np.floor(y - 0.5)
            a, b = x - 0.5 - u, y - 0.5 - v
            rows = [(1 - a) * clear(held, u, v + k, depth) + a * clear(held, u + 1, v + k, depth) for k in (0, 1)]
            seen = (1 - b) * rows[0] + b * rows[1]
        else:
            seen = clear(held, np.floor(x), np.floor(y), depth)
        found = np.where(at[..., 3] > best, np.where(at[..., 3] > 0, seen, 1.0), found)
        best = np.maximum(best, at[..., 3])
    return found


def brute(lamp: Lamp, air: Settled, views: list[View], heights: np.ndarray, steps: int = 5000, pcf: bool = False) -> np.ndarray:
    """(H, W, 3) by steps so fine that they are the truth."""
    t = (np.arange(steps) + 0.5) / steps * air.max_distance
    out = np.zeros((SIZE[1], SIZE[0], 3))
    for row, line in zip(out, rays(), strict=True):
        points = line[:, None] * t[:, None]
        seen = lit(views, heights, points, pcf) if views else np.ones(points.shape[:-1])
        row[:] = (twin.scattered(lamp, air, line[:, None], points, t) * seen[..., None]).sum(axis=1) * air.max_distance / steps
    return out


CASES = {
    "sun": (Lamp("sun", (3, 2, 1), direction=tuple(SUN)), lambda: [sun_view()]),
    "spot": (Lamp("spot", (5, 4, 3), **SPOT), lambda: [lamp_view(SPOT["direction"], math.tan(0.5))]),
    "point": (Lamp("point", (5, 4, 3), tuple(PLACE), range=9.0), faces),
}


def heights_for(kind: str, count: int, seed: int = 1) -> np.ndarray:
    """(count, 48, 48): half of the texels hold something."""
    rng = np.random.default_rng(seed)
    held = rng.random((count, 48, 48))
    held = held if kind == "sun" else 0.05 / (1 + 4 * held)
    return np.where(rng.random(held.shape) < 0.5, held, 0).astype(np.float32)


@pytest.mark.parametrize(
    ("kind", "phase"), [("sun", "henyey-greenstein"), ("sun", "rayleigh"), ("spot", "two-lobe"), ("point", "cornette-shanks")]
)
def test_the_walk_is_the_integral_over_the_map(kind: str, phase: str) -> None:
    lamp, made = CASES[kind]
    views = made()
    heights = heights_for(kind, len(views))
    medium = air(phase=phase, anisotropy=0.4)
    truth = brute(lamp, medium, views, heights)
    found = layer([(lamp, Shadow(depths(heights), 48, views))], medium)[..., :3]
    assert np.sqrt(np.mean((found - truth) ** 2)) < 5e-3 * truth.mean()
    assert abs(found.mean() / truth.mean() - 1) < 3e-4
    steps = layer([(lamp, Shadow(depths(heights), 48, views))], air(phase=phase, anisotropy=0.4, steps=1500))[..., :3]
    assert np.sqrt(np.mean((steps - truth) ** 2)) < 2e-2 * truth.mean()
    assert abs(steps.mean() / truth.mean() - 1) < 1e-3


@pytest.mark.parametrize("kind", CASES)
def test_a_map_without_casters_is_no_map(kind: str) -> None:
    lamp, made = CASES[kind]
    views = made()
    medium = air()
    open = layer([(lamp, None)], medium)[..., :3]
    found = layer([(lamp, Shadow(depths(np.zeros((len(views), 48, 48))), 48, views))], medium)[..., :3]
    assert np.abs(found - open).max() < 2e-4 * open.max()
    assert np.abs(open - brute(lamp, medium, [], np.zeros(0))).max() < 1e-3 * open.max()


def test_slab_and_its_ambient_light() -> None:
    medium = air(ambient=(0.5, 0.25, 1.0), albedo=(0.9, 0.8, 0.7), phase="isotropic")
    found = layer([], medium)
    expected = medium.sigma_s * medium.ambient / medium.sigma_t
    assert np.allclose(found[..., :3], expected * (1 - np.exp(-medium.sigma_t * 20)), rtol=1e-5)
    assert np.allclose(found[..., 3], 20)
    sun = layer([(CASES["sun"][0], None)], medium)[..., :3] - found[..., :3]
    share = (1 - np.exp(-medium.sigma_t * 20)) / (4 * np.pi)
    assert np.allclose(sun, medium.sigma_s / medium.sigma_t * np.array([3, 2, 1]) * share, rtol=1e-4)


@pytest.mark.parametrize("steps", ["exact", 16])
def test_empty_air_and_albedo_zero_give_no_light(steps: Any) -> None:
    lamps = [(lamp, None) for lamp, _ in CASES.values()]
    for values in ({"sigma_t": (0.0, 0.0, 0.0)}, {"albedo": (0.0, 0.0, 0.0)}):
        assert not layer(lamps, air(steps=steps, ambient=(1.0, 1.0, 1.0), **values))[..., :3].any()


@pytest.mark.parametrize("phase", ["henyey-greenstein", "cornette-shanks"])
@pytest.mark.parametrize("g", [0.99, -0.99, 0.9])
def test_a_narrow_peak_has_every_digit(phase: str, g: float) -> None:
    """Within a degree of the light, and of its opposite."""
    towards = np.array([0.004, -0.003, -1.0]) * math.copysign(1, g)
    lamp, medium = Lamp("sun", (3, 2, 1), direction=tuple(towards / np.linalg.norm(towards))), air(phase=phase, anisotropy=g)
    found = layer([(lamp, None)], medium, fov=1.0)[..., :3]
    there = twin.phase(rays(1.0) @ np.array(lamp.direction), *medium.lobes(lamp))
    expected = medium.sigma_s * lamp.intensity * there[..., None] * twin.until(20.0, medium.sigma_t)
    assert np.abs(found / expected - 1).max() < 1e-4


def test_lights_add() -> None:
    medium, lamps = air(), [(lamp, None) for lamp, _ in CASES.values()]
    apart = sum(layer([one], medium)[..., :3] for one in lamps)
    assert np.allclose(layer(lamps, medium)[..., :3], apart, rtol=1e-5)


def test_lengths_times_a_thousand_are_the_same_picture() -> None:
    lamp, made = CASES["sun"]
    heights, small = heights_for("sun", 1), made()
    big = sun_view(width=20e3)
    big.matrix[2, :3] /= 1e3
    big.depth_scale *= 1e3
    near = layer([(lamp, Shadow(depths(heights), 48, small))], air())
    thick = air(radius=1e4, sigma_t=tuple(v / 1e3 for v in RGB))
    far = layer([(lamp, Shadow(depths(heights), 48, [big]))], thick)
    assert np.allclose(far[..., :3], near[..., :3], rtol=1e-3, atol=1e-5)


def test_a_turned_camera_sees_the_turned_world() -> None:
    """The camera's place and turn are in the matrices alone."""
    lamp, made = CASES["point"]
    turn = np.eye(4)
    turn[[0, 0, 2, 2], [0, 2, 0, 2]] = math.cos(0.4), math.sin(0.4), -math.sin(0.4), math.cos(0.4)
    turn[:3, 3] = 3, -1, 2
    heights = heights_for("point", 6)
    views = [View(v.matrix @ np.linalg.inv(turn), texel=v.texel, depth_scale=v.depth_scale) for v in made()]
    moved = Lamp("point", lamp.intensity, tuple((turn @ np.append(PLACE, 1))[:3]), range=lamp.range)
    plain = layer([(lamp, Shadow(depths(heights), 48, made()))], air())
    found = layer([(moved, Shadow(depths(heights), 48, views))], air(), view=np.linalg.inv(turn))
    assert np.abs(found - plain)[..., :3].max() < 2e-3 * plain[..., :3].max()


def test_surfaces_end_rays_and_smaller_marches_stop_at_their_edges() -> None:
    """Half the picture is 2 m away: at a smaller size the near half takes nothing from the far one."""
    p, depth = projection(), np.ones((SIZE[1], SIZE[0]))
    depth[:, : SIZE[0] // 2] = (p[2, 2] * -2 + p[2, 3]) / 2
    lamp, medium = CASES["sun"][0], air()
    whole = layer([(lamp, None)], medium, depth=depth)
    assert np.allclose(whole[:, : SIZE[0] // 2, 3], 2 / -rays()[:, : SIZE[0] // 2, 2], rtol=1e-4)
    half = layer([(lamp, None)], medium, depth=depth, share=0.5)
    assert np.allclose(half[..., 3], whole[..., 3], rtol=1e-6)
    assert np.abs(half / whole - 1)[..., :3].max() < 0.08


@pytest.mark.parametrize("share", [0.5, 1 / 3, 0.7, 0.05])
@pytest.mark.parametrize("pixels", [(37, 23), (40, 21)])
def test_a_smaller_march_is_put_on_the_picture_as_its_twin_does(share: float, pixels: tuple[int, int]) -> None:
    """Over edges of depth, and over what is so thin that nothing marched is as far away."""
    device, (lamp, made) = open_device(), CASES["sun"]
    rng = np.random.default_rng(pixels[0])
    held = np.kron(rng.choice([0.9, 0.97, 0.99, 1.0], (8, 8)), np.ones((6, 6)))[: pixels[1], : pixels[0]]
    held[rng.random(held.shape) < 0.06] = 0.95
    march, medium = March(device, pixels), air(steps=16)
    march.aim(np.eye(4), projection(), [(lamp, Shadow(depths(heights_for("sun", 1)), 48, made()))], medium, jitter="blue", share=share)
    seen = depths(held)
    run_ms(device, lambda encoder: march.record(encoder, seen))
    found, small = (
        np.frombuffer(device.read(texture, 16), np.float32).reshape(size[1], size[0], 4)
        for texture, size in ((march.layer, pixels), (march._layers[0], march.size))
    )
    assert small.shape[:2] == (max(1, round(share * pixels[1])), max(1, round(share * pixels[0]))) and np.ptp(small[..., 0]) > 0.01
    rows, columns = (twin.taken_at(n, of) for n, of in zip(march.size[::-1], pixels[::-1], strict=True))
    assert np.array_equal(found[np.ix_(rows, columns)][..., 3], small[..., 3])
    expected = twin.upsampled(small, found[..., 3].astype(float), medium.sigma_t)
    np.testing.assert_allclose(found[..., :3], expected, rtol=1e-3, atol=1e-5)


def test_bias_lets_light_behind_what_hides_it() -> None:
    lamp, made = CASES["spot"]
    held = np.full((1, 48, 48), 0.05 / 7, np.float32)  # a wall 7 m away
    sums = [layer([(lamp, Shadow(depths(held), 48, made()))], air(shadow_bias=bias))[..., :3].sum() for bias in (0.0, 1.0, 100.0)]
    open = layer([(lamp, None)], air())[..., :3].sum()
    assert sums[0] < 0.999 * sums[1] < sums[2]
    assert sums[2] == pytest.approx(open, rel=1e-4)


@pytest.mark.parametrize("kind", CASES)
def test_pcf_is_the_mean_of_four_comparisons(kind: str) -> None:
    lamp, made = CASES[kind]
    views = made()
    heights = heights_for(kind, len(views))
    medium = air(steps=1000, shadow_filter="pcf")
    found = layer([(lamp, Shadow(depths(heights), 48, views))], medium)[..., :3]
    truth = brute(lamp, medium, views, heights, pcf=True)
    assert np.sqrt(np.mean((found - truth) ** 2)) < 5e-3 * truth.mean()


def test_snapped_to_texels_a_filter_is_one_of_them() -> None:
    lamp, made = CASES["sun"]
    pairs = [(lamp, Shadow(depths(heights_for("sun", 1)), 48, made()))]
    plain, filtered, snapped = (
        layer(pairs, air(steps=64, **values))[..., :3] for values in ({}, {"shadow_filter": "pcf"}, {"shadow_filter": "pcf", "snap": True})
    )
    assert np.allclose(snapped, plain, rtol=1e-4, atol=1e-6) and not np.allclose(filtered, plain, rtol=1e-2)


def test_soft_edges_keep_the_light_and_smooth_them() -> None:
    lamp, made = CASES["sun"]
    pairs = [(lamp, Shadow(depths(np.kron(heights_for("sun", 1)[:, :12, :12], np.ones((4, 4), np.float32))), 48, made()))]
    found = {size: layer(pairs, air(steps=400, shadow_filter="soft", sun_size=size))[..., :3] for size in (0.01, 5.0)}
    plain = layer(pairs, air(steps=400))[..., :3]
    assert np.abs(found[0.01] - plain).mean() < 0.02 * plain.mean()
    assert found[5.0].mean() == pytest.approx(plain.mean(), rel=0.06)
    assert np.abs(np.diff(found[5.0], axis=1)).mean() < 0.9 * np.abs(np.diff(plain, axis=1)).mean()


def cascades(ends: tuple[float, ...]) -> list[View]:
    """Of the same place at different sizes: the first holds up to the first of `ends`, metres along the camera's axis."""
    spans = list(zip((0.0, *ends), (*ends, np.inf), strict=True))
    return [View(v.matrix, span, v.texel, v.depth_scale) for span, v in zip(spans, [sun_view(width=60.0) for _ in spans], strict=True)]


def test_cascades_of_one_map_are_that_map_and_blend() -> None:
    lamp, heights = CASES["sun"][0], heights_for("sun", 1)
    one = [(lamp, Shadow(depths(heights), 48, cascades(())))]
    three = [(lamp, Shadow(depths(np.repeat(heights, 3, axis=0)), 48, cascades((3.0, 9.0))))]
    for steps in ("exact", 64):
        medium = air(steps=steps)
        whole, cut = layer(one, medium)[..., :3], layer(three, medium)[..., :3]
        assert np.abs(cut - whole).max() < 2e-3 * whole.max()
    dark = np.concatenate([np.zeros_like(heights), np.ones_like(heights)])  # the second cascade lets no light through
    pair = [(lamp, Shadow(depths(dark), 48, cascades((6.0,))))]
    sums = [layer(pair, air(steps=400, cascade_blend=blend))[..., :3].sum() for blend in (0.0, 0.25, 0.5)]
    assert sums[0] > 1.01 * sums[1] > 1.02 * sums[2] > 0


@pytest.mark.parametrize("jitter", ["fixed", "midpoint", "gradient", "blue"])
def test_jitter_keeps_the_mean(jitter: str) -> None:
    lamp, made = CASES["sun"]
    pairs = [(lamp, Shadow(depths(heights_for("sun", 1)), 48, made()))]
    exact, found = layer(pairs, air())[..., :3], layer(pairs, air(steps=48), jitter=jitter)[..., :3]
    assert found.mean() == pytest.approx(exact.mean(), rel=0.02)
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.2 * exact.mean()
