"""Functions of the look's rays, each over random arrays against its float64 twin."""

import math

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.look.grid import LINES, RADII, RayGrid
from airlight.reference import colour, look, rays

RNG = np.random.default_rng(8)
GRIDS = {
    "inside": RayGrid((300, 200), (0.3, 0.6)),
    "above": RayGrid((300, 200), (0.6, -0.3)),
    "diagonal": RayGrid((180, 130), (1.4, 1.7)),
    "on the border": RayGrid((200, 300), (1.0, 0.3)),
}
TONES = look.Tones(0.08, 0.7)


@pytest.fixture(params=GRIDS)
def grid(request: pytest.FixtureRequest) -> RayGrid:
    return GRIDS[request.param]


def record(grid: RayGrid) -> np.ndarray:
    """The uniform of a grid's light."""
    v = np.zeros((), struct_dtype("look/rays.wgsl", "Rays"))
    v["box"], v["light"], v["start"], v["span"] = grid.box, grid.light, grid.start, grid.span
    v["nearest"], v["step"] = grid.nearest, grid.step
    v["surroundings"], v["tone_span"] = TONES.surroundings, TONES.span
    return v


def points_of(grid: RayGrid, count: int = 2000) -> np.ndarray:
    return (RNG.random((count, 2)) * grid.box).astype(np.float32)


def test_direction_of(grid: RayGrid) -> None:
    line = np.arange(LINES)
    found = call("look/bands.wgsl", "direction_of", [line], bindings={"rays": record(grid)})
    expected = rays.direction_of(line, grid.start, grid.span)
    np.testing.assert_allclose(found, expected, atol=2e-6)


def test_is_within(grid: RayGrid) -> None:
    p = RNG.uniform(-0.2, 1.2, (2000, 2)).astype(np.float32)
    v = record(grid)
    found = call("look/bands.wgsl", "is_within", [p], bindings={"rays": v})
    expected = rays.is_within(p, v["box"])
    assert np.array_equal(found, expected) and 0 < expected.mean() < 1


def test_entry_distance(grid: RayGrid) -> None:
    """Along lines of the light, and as the grid of the host finds it; rays that graze a border are left out."""
    direction = rays.direction_of(np.arange(LINES), grid.start, grid.span)
    found = call("look/rays.wgsl", "entry_distance", [direction, record(grid)], constants={"INSIDE": grid.inside})
    expected = rays.entry_distance(direction, grid.light, grid.box, grid.inside)
    np.testing.assert_allclose(expected, grid.entry(direction[:, 0], direction[:, 1]), atol=1e-12)
    np.testing.assert_allclose(found[2:-2], expected[2:-2], atol=2e-3)
    assert np.median(np.abs(found - expected)) < 1e-6


def test_polar(grid: RayGrid) -> None:
    """Lines to a hundredth, which is 1e-5 of a turn times how far an angle is amplified."""
    p = points_of(grid)
    p = p[np.hypot(*(p - grid.light).T) > 0.01]
    found = call("look/rays.wgsl", "polar", [p, record(grid)], constants={"INSIDE": grid.inside})
    expected = rays.polar(p.astype(float), grid.light, grid.start, grid.span, grid.inside)
    np.testing.assert_allclose(expected, np.stack(grid.polar(p[:, 0].astype(float), p[:, 1].astype(float)), axis=-1), atol=1e-9)
    np.testing.assert_allclose(found[:, 0], expected[:, 0], atol=1e-6)
    off = np.abs(found[:, 1] - expected[:, 1])
    assert np.minimum(off, LINES - off if grid.inside else off).max() < 0.02


def test_band_uv(grid: RayGrid) -> None:
    at = np.stack([RNG.uniform(0, 1.2 * grid.farthest, 1000), RNG.uniform(-0.5, LINES, 1000)], axis=-1).astype(np.float32)
    found = call("look/rays.wgsl", "band_uv", [at, record(grid)])
    expected = rays.band_uv(at.astype(float), grid.nearest, grid.step)
    np.testing.assert_allclose(found, expected, atol=2e-5)
    assert (expected[:, 1] == 0.5 / RADII).any() and (expected[:, 1] == 1 - 0.5 / RADII).any()


def test_emission() -> None:
    y = np.append(np.exp(RNG.uniform(-12, 4, 1000)), 0).astype(np.float32)
    found = call("look/rays.wgsl", "emission", [y, record(GRIDS["inside"])])
    expected = look.emission(y.astype(float), TONES)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert (expected == 0).any() and (expected == 1).any()


def test_nearness_weight() -> None:
    distance = RNG.uniform(0, 40, 1000).astype(np.float32)
    found = call("look/rays.wgsl", "nearness_weight", [distance])
    np.testing.assert_allclose(found, look.nearness_weight(distance.astype(float)), rtol=2e-6)


def test_falloff() -> None:
    """The three members, and that stepping them gives a Gaussian's weights."""
    sigma = np.append(RNG.uniform(0.3, 20, 300), 0).astype(np.float32)
    found = call("look/bands.wgsl", "falloff", [sigma])
    expected = rays.falloff(sigma.astype(float))
    for i, name in enumerate(("weight", "factor", "shrinks")):
        np.testing.assert_allclose(found[name], expected[:, i], rtol=2e-6, atol=1e-30)
    weight, factor, shrinks = expected[0]
    for k in range(1, 5):
        weight, factor = weight * factor, factor * shrinks
        assert weight == pytest.approx(math.exp(-0.5 * (k / float(sigma[0])) ** 2))


@pytest.mark.parametrize("inside", [True, False])
def test_neighbour_weight(inside: bool) -> None:
    at = np.arange(-40, 80)
    found = call("look/bands.wgsl", "neighbour_weight", [at, 32], constants={"INSIDE": inside})
    assert np.array_equal(found, rays.neighbour_weight(at, np.array(32), inside))
    assert found.sum() == (120 if inside else 32)


def test_linear_root() -> None:
    """The polynomial, its slope, and how near it comes to the root of the decoded code."""
    codes = np.linspace(0, 1, 256)
    t = ((codes + 0.055) / 1.055).astype(np.float32)
    found = call("look/codes.wgsl", "linear_root", [t[:, None].repeat(3, 1)])
    expected = rays.linear_root(t.astype(float))
    np.testing.assert_allclose(found, expected[:, None].repeat(3, 1), atol=1e-6)
    root = np.sqrt(colour.srgb_decode(codes[20:]))
    assert np.abs(expected[20:] / root - 1).max() < 0.015
    slope = call("look/codes.wgsl", "linear_root_slope", [t[:, None].repeat(3, 1)])
    np.testing.assert_allclose(slope[:, 0], rays.linear_root_slope(t.astype(float)), atol=2e-6)


def test_approximate_srgb_decode() -> None:
    """To 0.3 %, and 0.0008 at black, as its comment says."""
    codes = np.linspace(0, 1, 511).astype(np.float32)
    found = call("look/matte_codes.wgsl", "approximate_srgb_decode", [codes[:, None].repeat(3, 1)])
    expected = rays.approximate_srgb_decode(codes.astype(float))
    np.testing.assert_allclose(found[:, 1], expected, atol=2e-6)
    exact = colour.srgb_decode(codes.astype(float))
    assert (np.abs(expected - exact) < 0.003 * exact + 0.0009).all()


def test_change() -> None:
    settings = np.zeros((), struct_dtype("look/field.wgsl", "Look"))
    settings["strength"], settings["shade"], settings["dark"] = 0.7, 0.8, (0.12, 0.35)
    base, sums = RNG.uniform(0, 1.1, 3000).astype(np.float32), RNG.uniform(0, 1.5, (3000, 4)).astype(np.float32)
    sums[:200, :3], sums[200:400, 3], base[400:500] = 0, 0, 0
    found = call("look/field.wgsl", "change", [base, sums], bindings={"look": settings})
    b, s = base.astype(float), sums.astype(float)
    add, take = look.change(b, s[:, :3], s[:, 3], 0.7, 0.8, (0.12, 0.35))
    np.testing.assert_allclose(found[:, :3], add, atol=5e-6)
    np.testing.assert_allclose(found[:, 3], take, atol=1e-5)
    assert add.max() > 0.1 and take.max() > 0.1 and take.min() < 0
