"""The shadow-map article's march: the GPU against its float64 twin, and the twin against what is known."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from written import depth_texture

from airlight.errors import AirlightError
from airlight.gpu.device import open_device
from airlight.lamps import Lamp
from airlight.medium import settle
from airlight.options import March, Medium, Parameters
from airlight.reference import article as twin
from airlight.reference import jitter as jittered
from airlight.scatter.article.article import Article
from airlight.shadows import Shadow, View

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


def cascades(count: int, towards: np.ndarray, eye: np.ndarray) -> list[View]:
    """Maps of 20 m, 60 m, ... around the eye, so shallow that rays leave them."""
    x = np.cross(towards, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(towards, x), towards / DEEP])
    out = []
    for i in range(count):
        matrix = np.eye(4)
        matrix[:3, :3] = turn * np.array([SIDE / (20 * 3**i), SIDE / (20 * 3**i), 1])[:, None]
        matrix[:3, 3] = [SIDE / 2, SIDE / 2, 0.5] - matrix[:3, :3] @ eye
        out.append(View(matrix, texel=20 * 3**i / SIDE, depth_scale=DEEP))
    return out


def run(
    view: np.ndarray,
    matrix: np.ndarray,
    depths: np.ndarray,
    lamp: Lamp,
    shadow: Shadow | None,
    march: March,
    jitter: str = "fixed",
    **air: Any,
) -> np.ndarray:
    """(height, width, 4)"""
    device = open_device()
    made = Article(device, (depths.shape[1], depths.shape[0]))
    made.aim(view, matrix, [(lamp, shadow)], settle(Medium(**air), march, "normal", 10.0), jitter=jitter)
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, depths))
    device.submit(encoder)
    return np.frombuffer(device.read(made.layer, 16), np.float32).reshape(*depths.shape, 4)


@settings(max_examples=12)
@given(st.integers(0, 2**31), st.booleans(), st.integers(0, 4), JITTERS, st.booleans(), st.booleans())
def test_the_gpu_is_its_twin(seed: int, flat: bool, count: int, jitter: str, prose: bool, plain: bool) -> None:
    rng = np.random.default_rng(seed)
    matrix, view = projection(flat=flat), camera(seed)
    origins, directions = rays(matrix)
    surfaces = rng.uniform(0.1, 60, PIXELS[::-1])
    depths = depth_of(matrix, origins + surfaces[..., None] * directions)
    surfaces[rng.random(surfaces.shape) < 0.3] = np.inf
    depths[np.isinf(surfaces)] = 1
    eye = np.linalg.inv(view)[:3, 3]
    maps = np.where(rng.random((count, SIDE, SIDE)) < 0.5, 0, rng.uniform(0.3, 0.7, (count, SIDE, SIDE))).astype(np.float32)
    device = open_device()
    shadow = Shadow(depth_texture(device, maps), SIDE, cascades(count, SUN, eye)) if count else None
    intensity = (0.5, 1.0, 2.0)
    march = (
        March() if plain else March(shadow_bias=0.3, article_share="prose" if prose else "code", article_absorption=0.02, article_cap=0.3)
    )
    out = run(view, matrix, depths, Lamp("sun", intensity, direction=tuple(SUN)), shadow, march, jitter, max_distance=70.0)
    into = np.linalg.inv(view)
    want = twin.layer(
        origins,
        directions,
        surfaces,
        view[:3, :3] @ SUN,
        intensity,
        [v.matrix @ into for v in shadow.views] if shadow else [],
        maps,
        biases=[0.0005 if plain else 0.3 / DEEP] * count,
        max_distance=70.0,
        offsets=jittered.offsets(*PIXELS, jitter),
        prose=march.article_share == "prose",
        absorption=march.article_absorption,
        cap=march.article_cap,
        least=np.tan(np.radians(march.sun_size)),
    )
    assert np.all(out[..., 3] == 0)
    off = np.abs(out[..., :3] - want)
    # a step on the border of a texel, or a ray that ends on a step, may fall to either side in f32
    assert np.quantile(off, 0.97) <= 1e-5 and off.mean() <= 2e-3


@given(st.floats(0.02, 3.12), st.floats(0.01, 900))
def test_the_angle_is_macklins_integral(angle: float, distance: float) -> None:
    direction, towards = np.array([0, 0, -1.0]), np.array([np.sin(angle), 0, -np.cos(angle)])
    out = twin.inscatter(direction, towards, distance, 1e-3)
    np.testing.assert_allclose(out, twin.macklin(direction, -towards, distance), rtol=1e-9)
    t = distance * (1 - np.cos(np.pi * (np.arange(20000) + 0.5) / 20000)) / 2
    weights = distance * np.sin(np.pi * (np.arange(20000) + 0.5) / 20000) * np.pi / 40000
    places = t[:, None] * direction - towards
    np.testing.assert_allclose(out, (weights / (places * places).sum(axis=1)).sum(), rtol=2e-2 if angle < 0.2 else 1e-3)


def test_towards_the_sun_and_away_it_stays_finite() -> None:
    ahead = np.array([0, 0, -1.0])
    least = np.tan(np.radians(0.27))
    np.testing.assert_allclose(twin.inscatter(ahead, -ahead, 30.0, least), 30 / 31, rtol=1e-4)  # the limit: 1 - 1 / (1 + T)
    np.testing.assert_allclose(twin.inscatter(ahead, ahead, 30.0, least), np.pi / least, rtol=2e-3)
    with np.errstate(divide="ignore", invalid="ignore"):
        assert not np.isfinite(twin.macklin(ahead, -ahead, 30.0))  # as the article has it
    depths = np.ones((8, 8))
    for strength in (1.0, 1e-6):
        lamp = Lamp("sun", (1.0, 1.0, 1.0), direction=(0.0, 0.0, -1.0), strength=strength)
        out = run(np.eye(4), projection(), depths, lamp, None, March(), max_distance=30.0)
        assert np.isfinite(out).all() and out[..., :3].min() >= -0.1 - 1e-6 and out[..., :3].max() <= 0.1 + 1e-6


def test_its_numbers() -> None:
    """600 steps of 0.8 over 750, squared; at right angles to the sun's direction the integral is atan T."""
    lamp = Lamp("sun", (0.7, 0.7, 0.7), direction=(0.0, 1.0, 0.0))
    flat = np.diag([1e-6, 1e-6, -1e-4, 1.0])
    for distance, sum_ in ((1000.0, 480.0), (100.0, 126 * 0.8)):
        out = run(np.eye(4), flat, np.ones((1, 1)), lamp, None, March(), max_distance=distance)
        light = 0.7 * (np.arctan(min(distance, 480)) * sum_ / 750) ** 2
        np.testing.assert_allclose(out[0, 0, :3], (2 * light - 1) * 0.1, atol=5e-6)
        out = run(np.eye(4), flat, np.ones((1, 1)), lamp, None, March(article_share="prose"), max_distance=distance)
        np.testing.assert_allclose(out[0, 0, :3], 0.1, atol=1e-6)  # more than 1 is cut off
    dark = run(np.eye(4), flat, np.ones((1, 1)), Lamp("sun", (0.0, 0.0, 0.0)), None, March())
    np.testing.assert_allclose(dark[0, 0, :3], -0.1, atol=1e-7)


def test_only_one_sun() -> None:
    made = Article(open_device(), (4, 4))
    air = settle(Medium(), March(), "normal", 1.0)
    sun, spot = Lamp("sun", (1.0, 1.0, 1.0)), Lamp("spot", (1.0, 1.0, 1.0))
    for lamps in ([(spot, None)], [(sun, None), (sun, None)], [(sun, None), (spot, None)]):
        with pytest.raises(AirlightError, match="one light, a sun"):
            made.aim(np.eye(4), projection(), lamps, air)
    made.aim(np.eye(4), projection(), [], air)  # as dark as a sun without strength
    assert Parameters(method="article").offset == "fixed" and Parameters(method="march").offset == "blue"
