"""Shadow-mapped in-scattering of an unpublished article, as its code and as its prose have it: the GPU against its float64 twins, and
against sums by hand."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from calling import call
from hypothesis import given, settings
from hypothesis import strategies as st
from written import depth_texture

from airlight.errors import AirlightError
from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.lights.directional import DirectionalLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March, Medium, Parameters
from airlight.reference import article as twin
from airlight.reference import jitter as jittered
from airlight.scatter.article.article import Article, ArticleProse
from airlight.scatter.methods import METHODS
from airlight.shadows import Shadow, ShadowView

PIXELS, SIDE, DEEP = (13, 9), 32, 60.0
JITTERS = st.sampled_from(["fixed", "midpoint", "gradient", "blue"])
SUN = np.array([0.3, 0.8, -0.4]) / np.linalg.norm([0.3, 0.8, -0.4])


def projection(near: float = 0.1, far: float = 1000.0, flat: bool = False) -> np.ndarray:
    """(4, 4) with depths from 0 to 1, off its axis."""
    if flat:
        return np.array([[0.1, 0, 0, 0.1], [0, 0.15, 0, 0], [0, 0, -1 / (far - near), -near / (far - near)], [0, 0, 0, 1.0]])
    return np.array([[1.2, 0, 0.1, 0], [0, 1.7, -0.05, 0], [0, 0, far / (near - far), near * far / (near - far)], [0, 0, -1, 0.0]])


def camera(seed: int) -> np.ndarray:
    """(4, 4), world to view space."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    out = np.eye(4)
    out[:3, :3] = turn * np.sign(np.linalg.det(turn))
    out[:3, 3] = rng.normal(size=3) * 3
    return out


def rays(matrix: np.ndarray, size: tuple[int, int] = PIXELS) -> tuple[np.ndarray, np.ndarray]:
    """Of pixel centres, in view space: begins and unit directions (height, width, 3); by unprojection."""
    u, v = np.meshgrid((np.arange(size[0]) + 0.5) / size[0], (np.arange(size[1]) + 0.5) / size[1])
    ends = [np.stack([2 * u - 1, 1 - 2 * v, np.full_like(u, d), np.ones_like(u)], -1) @ np.linalg.inv(matrix).T for d in (0.2, 0.7)]
    near, far = (e[..., :3] / e[..., 3:] for e in ends)
    along = (far - near) / np.linalg.norm(far - near, axis=-1, keepdims=True)
    return near - along * (near[..., 2:] / along[..., 2:]), along


def depth_of(matrix: np.ndarray, places: np.ndarray) -> np.ndarray:
    at = np.concatenate([places, np.ones_like(places[..., :1])], -1) @ matrix.T
    return at[..., 2] / at[..., 3]


def cascades(count: int, towards: np.ndarray, eye: np.ndarray, width: float = 20.0) -> list[ShadowView]:
    """Maps of 20 m, 60 m, ... around the eye, so shallow that rays leave them."""
    x = np.cross(towards, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(towards, x), towards / DEEP])
    out = []
    for i in range(count):
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.array([SIDE / (width * 3**i), SIDE / (width * 3**i), 1])[:, None]
        matrix[:3, 3] = [SIDE / 2, SIDE / 2, 0.5] - matrix[:3, :3] @ eye
        out.append(ShadowView(matrix, texel=width * 3**i / SIDE, depth_scale=DEEP))
    return out


def run(
    kind: type[Article],
    view: np.ndarray,
    matrix: np.ndarray,
    depths: np.ndarray,
    lamps: Sequence[tuple[PunctualLight, Shadow | None]],
    march: March | None = None,
    jitter: str = "fixed",
    **air: Any,
) -> np.ndarray:
    """(height, width, 4)"""
    device = open_device()
    made = kind(device, (depths.shape[1], depths.shape[0]))
    made.update(view, matrix, lamps, made.resolve(resolved(march, **air)), jitter=jitter)
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, depths))
    device.submit(encoder)
    return np.frombuffer(device.read(made.layer, 16), np.float32).reshape(*depths.shape, 4)


def resolved(march: March | None = None, **air: Any) -> ResolvedMedium:
    return resolve(Medium(**air), march or March(), "normal", 10.0)


def scene(seed: int, flat: bool, count: int) -> tuple[Any, ...]:
    """A camera, what it sees, and maps full of holes: (view, projection, depths, shadow), and for the twins (origins, directions,
    surfaces, towards, matrices, maps)."""
    rng = np.random.default_rng(seed)
    matrix, view = projection(flat=flat), camera(seed)
    origins, directions = rays(matrix)
    surfaces = rng.uniform(0.1, 60, PIXELS[::-1])
    depths = depth_of(matrix, origins + surfaces[..., None] * directions)
    surfaces[rng.random(surfaces.shape) < 0.3] = np.inf
    depths[np.isinf(surfaces)] = 1
    into = np.linalg.inv(view)
    maps = np.where(rng.random((count, SIDE, SIDE)) < 0.5, 0, rng.uniform(0.3, 0.7, (count, SIDE, SIDE))).astype(np.float32)
    shadow = Shadow(depth_texture(open_device(), maps), SIDE, cascades(count, SUN, into[:3, 3])) if count else None
    matrices = [v.matrix @ into for v in shadow.views] if shadow else []
    return (view, matrix, depths, shadow), (origins, directions, surfaces, view[:3, :3] @ SUN, matrices, maps)


def check(out: np.ndarray, want: np.ndarray) -> None:
    """A step on the border of a texel, or a ray that ends on a step, may fall to either side in f32."""
    assert np.all(out[..., 3] == 0)
    off = np.abs(out[..., :3] - want)
    assert np.quantile(off, 0.97) <= 1e-5 and off.mean() <= 2e-3


# as its code has it


@settings(max_examples=8)
@given(st.integers(0, 2**31), st.booleans(), st.integers(0, 4))
def test_the_code_is_its_twin(seed: int, flat: bool, count: int) -> None:
    (view, matrix, depths, shadow), seen = scene(seed, flat, count)
    out = run(Article, view, matrix, depths, [(DirectionalLight((0.5, 1.0, 2.0), direction=tuple(SUN)), shadow)], max_distance=9.0)
    check(out, np.broadcast_to(twin.article(*seen)[..., None], (*depths.shape, 3)))


def test_a_stage_is_its_twin() -> None:
    """With the maps that are drawn of it, and the depths of its picture."""
    from airlight.pygfx.casters import Casters
    from airlight.pygfx.punctual import punctual_lights
    from airlight.scenes import open_scene
    from airlight.scenes.offline import FAR_METRES, Shot, Studio

    stage = open_scene("foliage-view")
    air, march = Medium(max_distance=3.0), March(shadow_size=256)
    studio = Studio(stage, Shot(64, 36, samples=1), Parameters(method="article"), medium=air, march=march)
    frame = studio.frame(depth=True, layer=True)
    shafts, (sun,) = studio.shafts, punctual_lights(stage.lights)
    view, matrix = np.asarray(studio.camera.view_matrix), np.asarray(studio.camera.projection_matrix)
    assert shafts.resolved_medium is not None and frame.layer is not None
    (shadow,) = Casters(shafts.device, stage.scene, stage.lights).draw(view, matrix, [sun], shafts.resolved_medium)
    maps = [
        shafts.device.queue.read_texture({"texture": shadow.texture, "origin": (0, 0, k)}, {"bytes_per_row": 1024}, (256, 256, 1))
        for k in range(len(shadow.views))
    ]
    origins, directions = rays(matrix, (64, 36))
    ahead = frame.distance().astype(float)
    surfaces = np.where(ahead == FAR_METRES, np.inf, ahead / -directions[..., 2])
    held = np.array([np.frombuffer(one, np.float32).reshape(256, 256) for one in maps])
    want = twin.article(
        origins, directions, surfaces, view[:3, :3] @ sun.direction, [v.matrix @ np.linalg.inv(view) for v in shadow.views], held
    )
    off = np.abs(frame.layer[..., 0] - want)
    assert len(maps) == 3 and np.ptp(want) > 0.005 and np.quantile(off, 0.99) <= 1e-6 and off.mean() <= 1e-5
    assert np.all(frame.layer[..., :3] == frame.layer[..., :1])


ACROSS = np.diag([1e-6, 1e-6, -1e-4, 1.0])  # rays along -Z, depths of 0.0001 a metre
FIRST = np.arctan(0.8)  # I at 0.8 m, at right angles to the sun; from 1.6 m on it is above 1


def added(x: float) -> float:
    return 0.1 * (2 * x * x - 1)


def held(value: Any, towards: tuple[float, float, float] = (0.0, 1.0, 0.0), width: float = 2000.0) -> Shadow:
    """A map of one value, or of one value for each cascade, the first of them `width` metres."""
    values = np.atleast_1d(np.asarray(value, np.float32))
    maps = np.broadcast_to(values[:, None, None], (len(values), SIDE, SIDE))
    return Shadow(depth_texture(open_device(), maps), SIDE, cascades(len(values), np.array(towards), np.zeros(3), width))


def along(
    length: float, shadow: Shadow | None, towards: tuple[float, float, float] = (0.0, 1.0, 0.0), kind: type[Article] = Article
) -> float:
    """What the layer has where a surface is `length` ahead; without one from 10,000 m on."""
    lamp = DirectionalLight((0.3, 0.2, 0.1), direction=towards)
    return float(run(kind, np.eye(4), ACROSS, np.full((1, 1), min(1e-4 * length, 1.0)), [(lamp, shadow)])[0, 0, 0])


@pytest.mark.parametrize(("length", "last"), [(1.9, 0.0), (2.5, 0.0), (3.0, FIRST), (3.5, FIRST), (3.7, 1.0), (100.0, 1.0), (1e4, 1.0)])
def test_where_all_is_lit_only_the_last_step_is_left(length: float, last: float) -> None:
    assert along(length, None) == pytest.approx(added(1 + last / 750), abs=5e-7)
    assert along(length, held(0.0)) == pytest.approx(added(1 + last / 750), abs=5e-7)


@pytest.mark.parametrize(
    ("length", "taken"), [(1.9, 0.0), (3.7, FIRST), (4.5, FIRST + 1), (5.1, FIRST + 1), (5.3, FIRST + 2), (1e4, FIRST + 597)]
)
def test_where_all_is_dark_each_step_takes_what_the_one_before_would_have_given(length: float, taken: float) -> None:
    assert along(length, held(1.0)) == pytest.approx(added(1 - taken / 750), abs=2e-6)


@pytest.mark.parametrize(
    ("values", "x"), [((1.0, 0.0), 1 + (1 - FIRST - 11) / 750), ((0.0, 1.0), 1 - 9 / 750), ((0.0, 0.0, 1.0), 1 + 1 / 750)]
)
def test_a_cascade_ends_at_a_hundredth_before_its_border(values: tuple[float, ...], x: float) -> None:
    """The first holds 9.8 m of the ray, 13 samples; the second 29.4 m. A surface at 20 m lets 23 samples be, the last at 17.6 m."""
    assert along(20.0, held(values, width=20.0)) == pytest.approx(added(x), abs=2e-6)


def test_what_is_as_deep_as_the_map_is_dark() -> None:
    """Each sample is at depth 0.5 of its map, and the bias is 0.0005 of it. Today's reading of the prose has it lit."""
    equal = np.float32(0.5) + np.float32(0.0005)
    lit = added(1 + 1 / 750)
    assert along(1e4, held(np.nextafter(equal, np.float32(0)))) == pytest.approx(lit, abs=5e-7)
    assert along(1e4, held(equal)) == along(1e4, held(1.0)) < 0
    assert along(1e4, held(equal), kind=ArticleProse) > along(1e4, held(1.0), kind=ArticleProse)


def test_towards_the_sun_and_away_from_it_the_code_stays_finite() -> None:
    assert along(1e4, None, (0.0, 0.0, -1.0)) == pytest.approx(added(1 + 1 / 750), abs=5e-7)
    assert along(1e4, None, (0.0, 0.0, 1.0)) == pytest.approx(added(1 + 479.2 / 480.2 / 750), abs=5e-7)
    dark = sum(min(1.0, 0.8 * i / (1 + 0.8 * i)) for i in range(599))
    assert along(1e4, held(1.0, (1e-5, 0.0, 1.0)), (1e-5, 0.0, 1.0)) == pytest.approx(added(1 - dark / 750), abs=2e-6)


def test_the_code_fixes_cascades_and_reach_and_the_prose_nothing() -> None:
    air = resolved(March(cascades=1, shadow_size=64), max_distance=7.0)
    fixed = Article.resolve(air)
    assert (fixed.march.cascades, fixed.max_distance, fixed.shadow_size) == (3, 482.0, 64)
    assert ArticleProse.resolve(air) is air


# as its prose has it


@settings(max_examples=12)
@given(st.integers(0, 2**31), st.booleans(), st.integers(0, 4), JITTERS, st.booleans(), st.booleans())
def test_the_prose_is_its_twin(seed: int, flat: bool, count: int, jitter: str, by_length: bool, plain: bool) -> None:
    (view, matrix, depths, shadow), seen = scene(seed, flat, count)
    intensity = (0.5, 1.0, 2.0)
    march = March()
    if not plain:
        share = "prose" if by_length else "code"
        march = March(shadow_bias=0.3, article_share=share, article_absorption=(0.01, 0.03, 0.06), article_cap=0.3, article_steps=90)
    lamps = [(DirectionalLight(intensity, direction=tuple(SUN)), shadow)]
    out = run(ArticleProse, view, matrix, depths, lamps, march, jitter, max_distance=70.0)
    origins, directions, surfaces, towards, matrices, maps = seen
    want = twin.prose(
        origins,
        directions,
        surfaces,
        towards,
        intensity,
        matrices,
        maps,
        biases=[0.0005 if plain else 0.3 / DEEP] * count,
        max_distance=70.0,
        offsets=jittered.offsets(*PIXELS, jitter),
        by_length=march.article_share == "prose",
        absorption=march.article_absorption,
        cap=march.article_cap,
        least=np.tan(np.radians(march.sun_size)),
        **{} if plain else {"steps": 90, "step": 0.5},
    )
    check(out, want)


@given(st.floats(0.02, 3.12), st.floats(0.01, 900))
def test_the_angle_is_macklins_integral(angle: float, distance: float) -> None:
    direction, towards = np.array([0, 0, -1.0]), np.array([np.sin(angle), 0, -np.cos(angle)])
    out = twin.inscatter(direction, towards, distance, 1e-3)
    np.testing.assert_allclose(out, twin.macklin(direction, -towards, distance), rtol=1e-9)
    t = distance * (1 - np.cos(np.pi * (np.arange(20000) + 0.5) / 20000)) / 2
    weights = distance * np.sin(np.pi * (np.arange(20000) + 0.5) / 20000) * np.pi / 40000
    places = t[:, None] * direction - towards
    np.testing.assert_allclose(out, (weights / (places * places).sum(axis=1)).sum(), rtol=2e-2 if angle < 0.2 else 1e-3)


def test_functions_are_their_twins() -> None:
    """At the pole least is all that counts; borders of maps are held or not by STRICT."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions[:2] = SUN, -SUN
    distances, least = rng.uniform(0, 480, 200), rng.uniform(1e-3, 0.1, 200)
    out = call("scatter/article/article.wgsl", "inscatter", [directions, SUN, distances, least])
    np.testing.assert_allclose(out, twin.inscatter(directions, SUN, distances, least), rtol=2e-4)
    texels = np.append(rng.uniform(-2, SIDE + 2, (200, 2)), [[0.5 * SIDE, 0.0], [0.5, 0.5]], axis=0)
    light = np.zeros((), struct_dtype("scatter/article/article.wgsl", "Light"))
    light["side"] = SIDE
    for strict in (False, True):
        held = call("scatter/article/article.wgsl", "holds", [texels], constants={"STRICT": strict}, bindings={"light": light})
        assert np.array_equal(held, twin.holds(texels, SIDE, strict)) and 0.5 < held.mean() < 1


def test_towards_the_sun_and_away_it_stays_finite() -> None:
    ahead = np.array([0, 0, -1.0])
    least = np.tan(np.radians(0.27))
    np.testing.assert_allclose(twin.inscatter(ahead, -ahead, 30.0, least), 30 / 31, rtol=1e-4)  # the limit: 1 - 1 / (1 + T)
    np.testing.assert_allclose(twin.inscatter(ahead, ahead, 30.0, least), np.pi / least, rtol=2e-3)
    with np.errstate(divide="ignore", invalid="ignore"):
        assert not np.isfinite(twin.macklin(ahead, -ahead, 30.0))  # as the article has it
    depths = np.ones((8, 8))
    for strength in (1.0, 1e-6):
        lamp = DirectionalLight((1.0, 1.0, 1.0), direction=(0.0, 0.0, -1.0), strength=strength)
        out = run(ArticleProse, np.eye(4), projection(), depths, [(lamp, None)], max_distance=30.0)
        assert np.isfinite(out).all() and out[..., :3].min() >= -0.1 - 1e-6 and out[..., :3].max() <= 0.1 + 1e-6


def test_the_numbers_of_the_prose() -> None:
    """600 steps of 0.8 over 750, squared; at right angles to the sun's direction the integral is atan T."""
    lamps: Any = [(DirectionalLight((0.7, 0.7, 0.7), direction=(0.0, 1.0, 0.0)), None)]
    flat, nothing = np.diag([1e-6, 1e-6, -1e-4, 1.0]), np.ones((1, 1))
    for distance, sum_ in ((1000.0, 480.0), (100.0, 126 * 0.8)):
        out = run(ArticleProse, np.eye(4), flat, nothing, lamps, max_distance=distance)
        light = 0.7 * (np.arctan(min(distance, 480)) * sum_ / 750) ** 2
        np.testing.assert_allclose(out[0, 0, :3], (2 * light - 1) * 0.1, atol=5e-6)
        out = run(ArticleProse, np.eye(4), flat, nothing, lamps, March(article_share="prose"), max_distance=distance)
        np.testing.assert_allclose(out[0, 0, :3], 0.1, atol=1e-6)  # more than 1 is cut off
    for steps in (500, 2000):
        lit = March(article_steps=steps, article_share="prose")
        fading = March(article_steps=steps, article_absorption=(0.01, 0.02, 0.03))
        out, faded = (run(ArticleProse, np.eye(4), flat, nothing, lamps, march, max_distance=4000.0) for march in (lit, fading))
        np.testing.assert_allclose(out[0, 0, :3], 0.1, atol=1e-6)
        kept = [0.5 * (1 - np.exp(-0.5 * a * steps)) / (1 - np.exp(-0.5 * a)) for a in (0.01, 0.02, 0.03)]
        light = 0.7 * (np.arctan(0.5 * steps) * np.array(kept) / 750) ** 2
        np.testing.assert_allclose(faded[0, 0, :3], (2 * light - 1) * 0.1, atol=5e-6)


def test_one_number_of_absorption_is_three() -> None:
    assert March(article_absorption=0.02).article_absorption == (0.02, 0.02, 0.02)


@pytest.mark.parametrize("kind", [Article, ArticleProse])
def test_both_take_one_sun_or_none(kind: type[Article]) -> None:
    made = kind(open_device(), (4, 4))
    sun, spot = DirectionalLight((1.0, 1.0, 1.0)), SpotLight((1.0, 1.0, 1.0))
    for lamps in ([(spot, None)], [(sun, None), (sun, None)], [(sun, None), (spot, None)]):
        with pytest.raises(AirlightError, match=f"method {kind.name} takes one light, a sun"):
            made.update(np.eye(4), projection(), lamps, resolved())
    none = run(kind, np.eye(4), projection(), np.ones((2, 3)), [])
    np.testing.assert_allclose(none[..., :3], -0.1, atol=1e-7)


def test_the_methods_offsets() -> None:
    assert [Parameters(method=name).offset for name in ("article", "article-prose", "march")] == ["fixed", "fixed", "blue"]


@pytest.mark.parametrize("name", ["article", "article-prose"])
def test_its_light_is_what_its_layer_was_made_of(name: str) -> None:
    """The composite is picture + 0.1 (2 x - 1): comparisons measure x."""
    x = np.linspace(0, 1, 5)
    factor, offset = METHODS[name].light_of_layer
    np.testing.assert_allclose(factor * 0.1 * (2 * x - 1) + offset, x, atol=1e-12)
