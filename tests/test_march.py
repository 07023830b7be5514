"""The march: the exact texel walk and its steps, against float64 sums over the same shadow maps and against scenes with known answers."""

import math
from typing import Any

import numpy as np
import pytest
from written import depth_texture

from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March as Marching
from airlight.options import Medium
from airlight.reference import march as march_twin
from airlight.reference import medium as twin
from airlight.reference.tracer import in_scattered
from airlight.scatter.march.march import March
from airlight.shadows import Shadow, ShadowView

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


def flat(height: float = 8.0, middle: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """The projection of a camera without perspective: metres of its picture's height, and where its middle is."""
    near, far, out = 0.1, 100.0, np.eye(4)
    out[0, 0], out[1, 1], out[2, 2], out[2, 3] = 2 * SIZE[1] / SIZE[0] / height, 2 / height, -1 / (far - near), -near / (far - near)
    out[:2, 3] = -np.array(middle) * np.diag(out)[:2]
    return out


def depths(values: Any) -> Any:
    """A depth texture array that holds (layers, H, W) values."""
    return depth_texture(open_device(), values)


def air(radius: float = 10.0, **values: Any) -> ResolvedMedium:
    """max_distance 20 times a tenth of the radius, exact, unless told otherwise."""
    values = {"sigma_t": RGB, "max_distance": 2 * radius, **values}
    medium = {k: v for k, v in values.items() if k in Medium.__struct_fields__}
    marching = {k: v for k, v in values.items() if k in Marching.__struct_fields__}
    return resolve(Medium(**medium), Marching(**marching), "final", radius)


def layer(
    lamps: Any,
    air: ResolvedMedium,
    view: Any = None,
    depth: Any = 1.0,
    jitter: str = "midpoint",
    share: float = 1.0,
    seen: np.ndarray | None = None,
    march: March | None = None,
    size: tuple[int, int] = SIZE,
) -> np.ndarray:
    """(H, W, 4) of the picture that a projection `seen` makes, by a march that may have been used before. Its transmittance is checked."""
    device = open_device()
    march = march or March(device, size)
    march.update(np.eye(4) if view is None else view, projection() if seen is None else seen, lamps, air, jitter=jitter, share=share)
    ends = depths(np.broadcast_to(np.asarray(depth, float), (1, *size[::-1])))
    run_ms(device, lambda encoder: march.record(encoder, ends))
    found, transmittance = (
        np.frombuffer(device.read(texture, 16), np.float32).reshape(*size[::-1], 4) for texture in (march.layer, march.transmittance)
    )
    np.testing.assert_allclose(transmittance[..., :3], twin.transmittance(found[..., 3], air.sigma_t), rtol=1e-5)
    return found


def rays(seen: np.ndarray | None = None, size: tuple[int, int] = SIZE) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) origins and unit directions of the pixels' rays."""
    p = projection() if seen is None else seen
    x, y = (np.arange(size[0]) + 0.5) / size[0] * 2 - 1, 1 - (np.arange(size[1]) + 0.5) / size[1] * 2
    at = np.stack([*np.broadcast_arrays((x - p[0, 3]) / p[0, 0], (y[:, None] - p[1, 3]) / p[1, 1], 0.0)], axis=-1)
    ahead = np.broadcast_to([0.0, 0.0, -1.0], at.shape)
    if p[3, 3]:
        return at, ahead
    return np.zeros_like(at), (at + ahead) / np.linalg.norm(at + ahead, axis=-1, keepdims=True)


def sun_view(side: int = 48, width: float = 20.0) -> ShadowView:
    x = np.cross([0, 1, 0], SUN)
    x /= np.linalg.norm(x)
    texel, matrix = width / side, np.zeros((4, 4))
    matrix[0, :3], matrix[1, :3], matrix[2, :3] = x / texel, -np.cross(SUN, x) / texel, SUN / 30
    matrix[:, 3] = side / 2, side / 2 + 7, 0.5, 1
    return ShadowView(matrix, texel=texel, depth_scale=30.0)


def lamp_view(ahead: Any, half: float, side: int = 48, margin: int = 0, near: float = 0.05) -> ShadowView:
    ahead = np.asarray(ahead, float)
    right = np.cross(ahead, [0, 0, 1] if abs(ahead[1]) > 0.5 else [0, 1, 0])
    right /= np.linalg.norm(right)
    scale, matrix = (side / 2 - margin) / half, np.zeros((4, 4))
    matrix[0, :3] = scale * right + side / 2 * ahead
    matrix[1, :3] = -scale * np.cross(right, ahead) + side / 2 * ahead
    matrix[3, :3] = ahead
    matrix[:, 3] = -matrix[:, :3] @ PLACE
    matrix[2, 3] = near
    return ShadowView(matrix, texel=1 / scale, depth_scale=near)


def faces(side: int = 48) -> list[ShadowView]:
    return [lamp_view(sign * axis, 1.0, side, margin=1) for axis in np.eye(3) for sign in (1, -1)]


def lit(views: list[ShadowView], heights: np.ndarray, points: np.ndarray, pcf: bool = False) -> np.ndarray:
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


def brute(
    lamp: PunctualLight,
    air: ResolvedMedium,
    views: list[ShadowView],
    heights: Any,
    steps: int = 5000,
    pcf: bool = False,
    seen: np.ndarray | None = None,
    reach: Any = None,
    size: tuple[int, int] = SIZE,
) -> np.ndarray:
    """(H, W, 3) by steps so fine that they are the truth, of rays that are `reach` long; before a surface the last four texels of them are
    lit as they begin."""
    ways = np.broadcast_to(air.max_distance if reach is None else reach, size[::-1])
    out = np.zeros((*size[::-1], 3))
    for row, start, line, way in zip(out, *rays(seen, size), ways, strict=True):
        t = (np.arange(steps) + 0.5) / steps * way[:, None]
        points = start[:, None] + line[:, None] * t[..., None]
        share = np.ones(points.shape[:-1])
        if views:
            assert len(views) == 1 or reach is None
            far = 1.0 if lamp.directional else (start + line * way[:, None]) @ views[0].matrix[3, :3] + views[0].matrix[3, 3]
            last = np.where(way < air.max_distance, np.maximum(way - 4 * views[0].texel * np.maximum(far, 0), 0), way)
            share = lit(views, heights, start[:, None] + line[:, None] * np.minimum(t, last[:, None])[..., None], pcf)
        row[:] = (twin.in_scattered(lamp, air, line[:, None], points, t) * share[..., None]).sum(axis=1) * way[:, None] / steps
    return out


CASES = {
    "sun": (DirectionalLight((3, 2, 1), direction=tuple(SUN)), lambda side=48: [sun_view(side)]),
    "spot": (SpotLight((5, 4, 3), **SPOT), lambda side=48: [lamp_view(SPOT["direction"], math.tan(0.5), side)]),
    "point": (PointLight((5, 4, 3), tuple(PLACE), range=9.0), faces),
}


def heights_for(kind: str, count: int, seed: int = 1) -> np.ndarray:
    """(count, 48, 48): half of the texels hold something."""
    rng = np.random.default_rng(seed)
    held = rng.random((count, 48, 48))
    held = held if kind == "sun" else 0.05 / (1 + 4 * held)
    return np.where(rng.random(held.shape) < 0.5, held, 0).astype(np.float32)


@pytest.mark.parametrize(
    ("kind", "phase"),
    [
        ("sun", "henyey-greenstein"),
        pytest.param("sun", "rayleigh", marks=pytest.mark.slow),
        pytest.param("spot", "two-lobe", marks=pytest.mark.slow),
        ("point", "cornette-shanks"),
    ],
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


def blocks_for(kind: str, count: int, seed: int = 2) -> np.ndarray:
    """(count, 150, 150): half of the blocks of 13 texels hold something; one tile of 64 texels is empty, and one is full and the same."""
    rng = np.random.default_rng(seed)
    held = rng.random((count, 12, 12))
    held[:, 9:, 9:] = 0.3
    held = 0.4 + 0.6 * held if kind == "sun" else 0.05 / (0.5 + 2 * held)
    there = rng.random(held.shape) < 0.5
    there[:, :5, :5], there[:, 9:, 9:] = False, True
    return np.kron(np.where(there, held, 0), np.ones((13, 13)))[:, :150, :150].astype(np.float32)


@pytest.mark.parametrize("kind", ["sun", pytest.param("spot", marks=pytest.mark.slow), "point"])
def test_the_walk_passes_over_tiles_as_over_their_texels(kind: str) -> None:
    lamp, made = CASES[kind]
    views = made(150)
    heights = blocks_for(kind, len(views))
    medium = air()
    truth = brute(lamp, medium, views, heights)
    found = layer([(lamp, Shadow(depths(heights), 150, views))], medium)[..., :3]
    assert np.sqrt(np.mean((found - truth) ** 2)) < 3e-3 * truth.mean()
    assert abs(found.mean() / truth.mean() - 1) < 3e-4


@pytest.mark.parametrize("held", [0.7003, 0.3003, 0.0501, 8e-5, 3e-5])
def test_tiles_part_what_lies_a_digit_before_and_behind_them(held: float) -> None:
    """Each row of the picture has one depth in the map, which holds another a ten thousandth off, and between two half floats."""
    medium, matrix = air(phase="isotropic"), np.zeros((4, 4))
    matrix[0, 0], matrix[1, 2], matrix[2, 1] = 5, 5, 1 / 30
    matrix[:, 3] = 147, 149, held, 1
    heights = np.zeros((1, 150, 150))
    heights[..., 144:] = held  # the last tile of a row has six texels
    shadow = Shadow(depths(heights), 150, [ShadowView(matrix, texel=0.2, depth_scale=30.0)])
    found = layer([(DirectionalLight((3, 2, 1)), shadow)], medium, seen=flat(30 * held * 2e-3))[..., :3]
    full = medium.sigma_s * np.array([3, 2, 1]) / (4 * np.pi) * twin.transmittance_integral(20.0, medium.sigma_t)
    assert np.allclose(found, np.where(np.arange(SIZE[1])[:, None, None] < SIZE[1] // 2, full, 0), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_a_camera_without_perspective(kind: str) -> None:
    """Whole, in steps, and from a smaller march; the left of its picture is 7 m away."""
    lamp, made = CASES[kind]
    values = {"radius": 5.0, "phase": "two-lobe", "anisotropy": 0.4}
    views, seen, medium = made(150), flat(5.0, (-0.5, 0.3)), air(**values)
    heights = blocks_for(kind, len(views))
    depth, reach = np.ones(SIZE[::-1]), np.full(SIZE[::-1], medium.max_distance)
    depth[:, :8], reach[:, :8] = -seen[2, 2] * 7 + seen[2, 3], 7
    truth = brute(lamp, medium, views, heights, 8000, seen=seen, reach=reach)
    pairs = [(lamp, Shadow(depths(heights), 150, views))]
    found = layer(pairs, medium, depth=depth, seen=seen)
    assert np.allclose(found[..., 3], reach, rtol=1e-4)
    assert np.sqrt(np.mean((found[..., :3] - truth) ** 2)) < 3e-3 * truth.mean()
    steps = layer(pairs, air(steps=1500, **values), depth=depth, seen=seen)[..., :3]
    assert np.sqrt(np.mean((steps - truth) ** 2)) < 2e-2 * truth.mean()
    chosen = np.ix_(*(march_twin.sampled_pixel(np.arange(n // 2), n // 2, n) for n in SIZE[::-1]))
    small = np.concatenate([truth, reach[..., None]], axis=-1)[chosen]
    half = layer(pairs, medium, depth=depth, seen=seen, share=0.5)[..., :3]
    expected = march_twin.upsampled(small, reach, medium.sigma_t)
    assert np.sqrt(np.mean((half - expected) ** 2)) < 3e-3 * truth.mean()


@pytest.mark.parametrize("steps", ["exact", 400])
@pytest.mark.parametrize("seen", [flat(), projection()], ids=["flat", "perspective"])
@pytest.mark.parametrize("less", [0.0, 5e-4, 2e-3])
def test_a_spot_lights_half_of_all_places(less: float, seen: np.ndarray, steps: Any) -> None:
    """Straight down: rays at right angles to it, in the middle of the picture, lie in its light, or out of it where they begin above."""
    medium, size = air(steps=steps), (24, 17)
    for height in (0.6, -0.6):
        lamp = SpotLight((5, 4, 3), (1.0, height, -6.0), (0.0, -1.0, 0.0), inner=1.0, outer=math.pi / 2 - less)
        found = layer([(lamp, None)], medium, seen=seen, size=size)[..., :3]
        truth = brute(lamp, medium, [], [], 2500, seen=seen, size=size)
        assert (truth[8].min() > 0) == (height > 0)
        assert np.abs(found - truth).max() < 2e-3 * truth.max()


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
    lamp, medium = DirectionalLight((3, 2, 1), direction=tuple(towards / np.linalg.norm(towards))), air(phase=phase, anisotropy=g)
    found = layer([(lamp, None)], medium, seen=projection(1.0))[..., :3]
    kind, *lobes = medium.lobes(lamp.anisotropy)
    there = twin.phase(rays(projection(1.0))[1] @ np.array(lamp.direction), lobes, kind)
    expected = medium.sigma_s * lamp.intensity * there[..., None] * twin.transmittance_integral(20.0, medium.sigma_t)
    assert np.abs(found / expected - 1).max() < 1e-4


@pytest.mark.parametrize("fov", [50.0, 5.0])
@pytest.mark.parametrize("g", [0.99, 0.95, 0.9, 0.0, -0.8, -0.9, -0.99])
@pytest.mark.parametrize("kind", ["spot", "point"])
def test_a_lamp_that_one_looks_into_has_its_narrow_peak(kind: Any, g: float, fov: float) -> None:
    """Rays pass close to it, and behind it the cosine is the other way round."""
    towards = np.array([0.1, -0.05, 1.0]) / np.linalg.norm([0.1, -0.05, 1.0])
    position = (0.07, 0.05, -6.0)
    spot = SpotLight((5, 4, 3), position, tuple(towards), inner=0.3, outer=0.5)
    lamp = spot if kind == "spot" else PointLight((5, 4, 3), position)
    medium = air(phase="henyey-greenstein", anisotropy=g)
    found = layer([(lamp, None)], medium, seen=projection(fov))[..., :3].reshape(-1, 3)
    line = rays(projection(fov))[1].reshape(-1, 3)
    ways = np.full(len(line), medium.max_distance)
    truth = in_scattered(np.zeros_like(line), line, np.arange(len(line)), 0 * ways, ways, lamp, medium)
    bright = truth.max(axis=1) > 0.01 * truth.max()
    assert bright.sum() > 4
    assert np.abs(found / truth - 1)[bright].max() < 5e-3


def test_a_march_used_again_is_as_a_new_one() -> None:
    def pairs(side: int, *kinds: str) -> Any:
        out = []
        for kind in kinds:
            lamp, made = CASES[kind]
            heights = heights_for(kind, len(made())) if side == 48 else blocks_for(kind, len(made()))
            out.append((lamp, Shadow(depths(heights), side, made(side))))
        return out

    exact, steps, march = air(), air(steps=16), March(open_device(), SIZE)
    sun, both, other, large = pairs(48, "sun"), pairs(48, "sun", "spot"), pairs(48, "spot", "sun"), pairs(150, "spot", "sun")
    asked = [(sun, exact), (sun, steps), (sun, exact), (both, exact), (sun, exact), (both, exact), (both, steps), (other, exact)]
    asked += [(large, exact), (other, exact), (large, steps), ([], exact), (large, exact)]
    for share in (1.0, 0.5, 1.0):
        for lamps, medium in asked:
            assert np.array_equal(layer(lamps, medium, share=share, march=march), layer(lamps, medium, share=share))


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
    views = [ShadowView(v.matrix @ np.linalg.inv(turn), texel=v.texel, depth_scale=v.depth_scale) for v in made()]
    moved = PointLight(lamp.intensity, tuple((turn @ np.append(PLACE, 1))[:3]), range=lamp.range)
    plain = layer([(lamp, Shadow(depths(heights), 48, made()))], air())
    found = layer([(moved, Shadow(depths(heights), 48, views))], air(), view=np.linalg.inv(turn))
    assert np.abs(found - plain)[..., :3].max() < 2e-3 * plain[..., :3].max()


def test_surfaces_end_rays_and_smaller_marches_stop_at_their_edges() -> None:
    """Half the picture is 2 m away: at a smaller size the near half takes nothing from the far one."""
    p, depth = projection(), np.ones((SIZE[1], SIZE[0]))
    depth[:, : SIZE[0] // 2] = (p[2, 2] * -2 + p[2, 3]) / 2
    lamp, medium = CASES["sun"][0], air()
    whole = layer([(lamp, None)], medium, depth=depth)
    assert np.allclose(whole[:, : SIZE[0] // 2, 3], 2 / -rays()[1][:, : SIZE[0] // 2, 2], rtol=1e-4)
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
    march.update(np.eye(4), projection(), [(lamp, Shadow(depths(heights_for("sun", 1)), 48, made()))], medium, jitter="blue", share=share)
    seen = depths(held)
    run_ms(device, lambda encoder: march.record(encoder, seen))
    found, small = (
        np.frombuffer(device.read(texture, 16), np.float32).reshape(size[1], size[0], 4)
        for texture, size in ((march.layer, pixels), (march.marched_layers[0], march.size))
    )
    assert small.shape[:2] == (max(1, round(share * pixels[1])), max(1, round(share * pixels[0]))) and np.ptp(small[..., 0]) > 0.01
    rows, columns = (march_twin.sampled_pixel(np.arange(n), n, of) for n, of in zip(march.size[::-1], pixels[::-1], strict=True))
    assert np.array_equal(found[np.ix_(rows, columns)][..., 3], small[..., 3])
    expected = march_twin.upsampled(small, found[..., 3].astype(float), medium.sigma_t)
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


def cascades(ends: tuple[float, ...]) -> list[ShadowView]:
    """Of the same place at different sizes: the first holds up to the first of `ends`, metres along the camera's axis."""
    spans = list(zip((0.0, *ends), (*ends, np.inf), strict=True))
    one = sun_view(width=60.0)
    return [ShadowView(one.matrix, span, one.texel, one.depth_scale) for span in spans]


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
