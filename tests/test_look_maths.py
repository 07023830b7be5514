"""What the look's mathematics promise: the grid of rays, means over angles, drawn rays, light that never clips, contrast that is solved."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from airlight.look import measure
from airlight.look.grid import FARTHEST_LIGHT_DIAGONALS, LINES, RADII, RayGrid, points
from airlight.look.measure import Contrast, Small
from airlight.look.near import check_range, nearness, normalised, subject_nearness
from airlight.reference import look as twin

PLACES = [(0.3, 0.6), (0.999, 0.001), (0.0, 0.4), (1.0, 1.0), (0.5, 0.0), (0.4, -0.05), (-3.0, 0.5), (1.6, 1.3), (40.0, -70.0), (1e6, 1e6)]
SIZES = [(300, 200), (1, 1), (1, 500), (700, 20)]
places = st.tuples(st.floats(-3, 4), st.floats(-3, 4))


@given(places, st.floats(-math.pi, math.pi))
@example((0.0, 0.5), 0.0)
@example((0.5, 0.0), math.pi / 2)
@example((1.0, 1.0), math.pi)
@example((-1.0, 0.5), 0.0)
def test_entry_against_steps_along_the_ray(position: tuple[float, float], angle: float) -> None:
    """The first of many steps that lies in the picture, within a step; rays that only graze it are left out."""
    grid = RayGrid((300, 200), position)
    t = np.linspace(0, 6, 60001)
    x, y = grid.light[0] + t * math.cos(angle), grid.light[1] + t * math.sin(angle)
    within = (x >= 0) & (x <= grid.box[0]) & (y >= 0) & (y <= grid.box[1])
    if within.sum() < 20:
        return
    assert float(grid.entry(np.array(math.cos(angle)), np.array(math.sin(angle)))) == pytest.approx(t[within.argmax()], abs=1.1e-4)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("position", PLACES)
def test_lines_cover_the_whole_picture(position: tuple[float, float], size: tuple[int, int]) -> None:
    """Every pixel's centre, and every corner, lies between the first line and the last, the nearest distance and the farthest."""
    grid = RayGrid(size, position)
    x, y = points(*size)
    for px, py in ((x, y), (np.array([0, grid.box[0], 0, grid.box[0]]), np.array([0, 0, grid.box[1], grid.box[1]]))):
        far = np.hypot(px - grid.light[0], py - grid.light[1]) > 1e-9  # a corner upon the light lies on all of its lines
        distance, line = grid.polar(px[far], py[far])
        assert line.min() > -0.5 - 1e-6 and line.max() < LINES - 0.5 + 1e-6
        assert distance.min() >= grid.nearest - 1e-9 and distance.max() <= grid.farthest + 1e-9
        if not grid.inside and px.ndim == 1 and grid.span < math.pi - 1e-9:  # no more than that: the first and the last line meet corners
            assert line.min() < -0.5 + 1e-6 and line.max() > LINES - 0.5 - 1e-6
    assert grid.inside == all(0 < v < 1 for v in position)
    assert math.hypot(*grid.box) == pytest.approx(1) and grid.step * RADII == pytest.approx(grid.farthest - grid.nearest)


@pytest.mark.parametrize(("position", "span"), [((0.0, 0.4), math.pi), ((1.0, 1.0), math.pi / 2), ((0.5, 0.0), math.pi)])
def test_span_of_a_light_on_the_border(position: tuple[float, float], span: float) -> None:
    assert RayGrid((300, 200), position).span == pytest.approx(span)


def test_lines_and_places_are_inverses() -> None:
    """A point put on a line at a distance is found there; turns of a light in the picture begin anew after the last line."""
    rng = np.random.default_rng(2)
    for position in PLACES[:8]:
        grid = RayGrid((300, 200), position)
        line, distance = rng.uniform(0, LINES - 1, 500), rng.uniform(grid.nearest + 1e-3, grid.farthest, 500)
        angle = grid.start + (line + 0.5) * grid.span / LINES
        found = grid.polar(grid.light[0] + distance * np.cos(angle), grid.light[1] + distance * np.sin(angle))
        np.testing.assert_allclose(found[0], distance, rtol=1e-9)
        np.testing.assert_allclose(found[1], line, atol=1e-6)


def test_far_lights_are_put_where_their_rays_are_parallel() -> None:
    """Beyond 40 diagonals the direction is kept, and the angle that the picture takes is below 1.5 degrees."""
    near, far = RayGrid((300, 200), (50.0, -20.0)), RayGrid((300, 200), (50.0e3, -20.4e3))
    for grid in (near, far):
        middle = [0.5 * side for side in grid.box]
        away = [at - half for at, half in zip(grid.light, middle, strict=True)]
        assert math.hypot(*away) == pytest.approx(FARTHEST_LIGHT_DIAGONALS)
        assert grid.span < math.radians(1.5)
    direction = math.atan2(-(20.4e3 + 0.5) * far.box[1], (50e3 - 0.5) * far.box[0])
    assert math.atan2(far.light[1] - 0.5 * far.box[1], far.light[0] - 0.5 * far.box[0]) == pytest.approx(direction)


def test_the_sum_of_what_emits_all_along_is_one() -> None:
    """C of a picture that emits everywhere: the sum of g over the way, which is its integral; but for half a step, near the border where
    that counts most: a hundredth of a diagonal is added to both."""
    for position in PLACES[:9]:
        grid = RayGrid((300, 200), position)
        lets = np.ones((200, 300))
        weighted, emits = twin.matte(lets, twin.Tones(0.01, 0.5), lets, grid)
        share, dark = twin.scan(weighted, emits, grid)
        angle = grid.start + (np.arange(LINES) + 0.5) * grid.span / LINES
        distance = (grid.nearest + (np.arange(RADII) + 1) * grid.step)[:, None]
        x, y = grid.light[0] + distance * np.cos(angle), grid.light[1] + distance * np.sin(angle)
        within = (x >= 0) & (x <= grid.box[0]) & (y >= 0) & (y <= grid.box[1])
        assert within.mean() > 0.1
        np.testing.assert_allclose(dark, 0.02, atol=1e-9)
        off = np.abs(share[within] - 1)
        assert off.max() < grid.step / twin.STEPS / twin.FIRST_LENGTH and np.quantile(off, 0.99) < 0.05


@pytest.mark.parametrize("position", PLACES[:9])
def test_low_is_nearly_the_exact_mean(position: tuple[float, float]) -> None:
    """Groups of eight lines and lines between groups, against the Gaussian over all lines: of shares between 0 and 1 with hard edges.

    The wide mean within .03. The narrow one is a coarse one for lights in the picture, where its sigma is seven lines: within .08; where
    every edge is one of weights of 1 and .05 too, .3 at the worst of lines, .09 rms.
    """
    grid = RayGrid((300, 200), position)
    rng = np.random.default_rng(4)
    share = np.repeat(rng.random((RADII, LINES // 16)) > 0.5, 16, axis=1) * 0.9 + 0.1 * rng.random((RADII, LINES))
    at = np.arange(LINES)
    away = np.abs(at[:, None] - at)
    if grid.inside:
        away = np.minimum(away, LINES - away)
    for weights, bounds in ((np.ones(share.shape), (0.08, 0.03)), (1.02 - 0.97 * (share > 0.5), (0.3, 0.09))):
        for degrees, (most, rms) in zip(twin.breadths(0.45), (bounds, (0.03, 0.005)), strict=True):
            kernel = np.exp(-0.5 * (away / grid.lines(degrees)) ** 2)
            off = twin.low(share, weights, grid, degrees) - (share * weights) @ kernel / (weights @ kernel)
            assert np.abs(off).max() < most and math.sqrt(np.square(off).mean()) < rms


def test_smooth_keeps_the_even_and_the_mean() -> None:
    for position in PLACES[:9]:
        grid = RayGrid((300, 200), position)
        np.testing.assert_allclose(twin.smooth(np.full((RADII, LINES), 0.7), grid, 0.45), 0.7, atol=1e-12)
        share = np.random.default_rng(1).random((RADII, LINES))
        if grid.inside:
            np.testing.assert_allclose(twin.smooth(share, grid, 2.0).mean(axis=1), share.mean(axis=1), atol=1e-12)
        even = twin.bands(np.full((RADII, LINES), 0.7), np.ones((RADII, LINES)), grid, 0.45)
        np.testing.assert_allclose(even[..., :2], 0, atol=1e-12)  # nothing stands out
        np.testing.assert_allclose(even[..., 2], 0.7, atol=1e-12)


@pytest.mark.parametrize("count", [1, 7, 24, 200])
@pytest.mark.parametrize("inside", [True, False])
def test_drawn_pattern(count: int, inside: bool) -> None:
    """Mean 0 and deviation 1; all the way round without a seam; steady in phase, which changes it, as another seed does."""
    grid = RayGrid((300, 200), (0.4, 0.5) if inside else (0.4, -0.2))
    for seed in range(3):
        pattern = twin.drawn_pattern(count, grid, seed)
        assert pattern.shape == (LINES,) and abs(pattern.mean()) < 1e-12 and pattern.std() == pytest.approx(1)
        steps = np.abs(np.diff(pattern))
        if inside:
            assert abs(pattern[-1] - pattern[0]) <= 1.5 * steps.max()
        for phase in (0.0, 3.7, -250.0):
            one = twin.drawn_pattern(count, grid, seed, phase)
            moved = np.abs(twin.drawn_pattern(count, grid, seed, phase + 1e-3) - one).max()
            assert 0 < moved < 0.08
        assert np.abs(twin.drawn_pattern(count, grid, seed, 1.0) - pattern).max() > 0.3
        assert np.abs(twin.drawn_pattern(count, grid, seed + 1) - pattern).max() > 0.3


unit = st.floats(0, 1)


@given(
    st.tuples(unit, unit, unit), unit, st.tuples(unit, unit), st.tuples(unit, unit, unit), st.floats(0, 2.5), unit,
)  # fmt: skip
def test_a_change_neither_clips_nor_turns_nor_darkens_below_nothing(
    color: tuple[float, ...], base: float, amount: tuple[float, ...], tint: tuple[float, ...], strength: float, shade: float
) -> None:
    """What is added is the tint's multiple and the surface's own, at least 0, and ends at code 254; what was brighter gets no brighter; a
    share is taken, or the surface is lit."""
    pixel, hue = np.array(color), np.array(tint) + 1e-3
    hue /= hue @ twin.REC709
    light, share = twin.change(np.array(base), amount[0] * hue, np.array(amount[1]), strength, shade)
    add, take = twin.put(pixel, light, share, np.array(0.0))
    assert add.min() >= -1e-15 and 0 <= take <= 1
    parts = np.stack([light, pixel * (1 - twin.TINT + twin.TINT * hue)])  # of the air, and of the surface
    np.testing.assert_allclose(parts.T @ np.linalg.lstsq(parts.T, add, rcond=None)[0], add, atol=1e-9)
    after = pixel * (1 - take) + add
    assert np.all(after <= np.maximum(pixel, twin.WHITE) + 1e-12) and after.min() >= 0
    if shade == 0:
        assert take == 0
    if strength == 0 or not any(amount):
        np.testing.assert_allclose(after, pixel, atol=1e-15)


def test_a_change_is_steady() -> None:
    """No step anywhere: neighbouring values of each argument give neighbouring pixels, about white too; from black its slope is 13."""
    fine = np.linspace(0, 1.2, 200001)
    grey = np.repeat(fine[:, None], 3, axis=1)
    ones = np.ones(len(fine))
    for amount in (np.array([0.6, 0.0]), np.array([0.0, 0.8]), np.array([0.3, 0.3])):
        base = np.cbrt(fine)
        light = amount[0] * np.ones((len(fine), 3))
        change = twin.change(base, light, amount[1] * ones, 1.0, 0.8)
        add, take = twin.put(grey, *change, 0 * ones)
        after = grey * (1 - take)[:, None] + add
        assert np.abs(np.diff(after[:, 0])).max() < 1e-4
        add, take = twin.put(0.3 * grey**0, *twin.change(0.6 * ones, fine[:, None] * light, fine * amount[1], 1.0, 0.8), 0 * ones)
        assert np.abs(np.diff((0.3 * (1 - take))[:, None] + add, axis=0)).max() < 1e-4


def noisy(width: int = 120, height: int = 80) -> tuple[Small, np.ndarray, np.ndarray]:
    """A copy of a picture, with warm light added at random to the few pixels of it, and some missing."""
    rng = np.random.default_rng(6)
    small = Small(0.05 + 0.4 * rng.random((height, width, 3)))
    tint = np.array([1.5, 0.95, 0.5])
    added, missing = 0.5 * rng.random((2, *measure.few(small.y).shape)) ** 3
    return small, added[..., None] * tint / (tint @ twin.REC709), missing


@pytest.mark.parametrize("shade", [0.0, 0.8])
def test_contrast_is_solved_where_it_is_reached(shade: float) -> None:
    """Within 5 % of what is wanted; grows with strength; 0 is the identity; beyond the strongest, the strongest is taken, and said."""
    contrast = Contrast(*noisy(), shade)
    asked = [2.0, 4.0, 8.0, 12.8]
    strengths = []
    for wanted in asked:
        strength, given_contrast = contrast.solve(wanted)
        assert given_contrast == pytest.approx(wanted, rel=0.05) and contrast.at(strength) == given_contrast
        strengths.append(strength)
    assert all(np.diff(strengths) > 0)
    assert np.all(np.diff([contrast.at(s) for s in np.linspace(0, measure.STRONGEST, 20)]) > 0)
    assert contrast.at(0.0) == 0 and contrast.solve(0.0) == (0.0, 0.0)
    assert contrast.solve(90.0) == (measure.STRONGEST, contrast.at(measure.STRONGEST)) and contrast.at(measure.STRONGEST) < 90


@pytest.mark.parametrize(
    ("count", "side", "gaps"), [(0, 0, False), (1, 5, False), (4, 5, False), (24, 5, True), (1, 40, True), (1, 10, False), (2, 10, True)]
)
def test_gaps_for_a_light_beyond(count: int, side: int, gaps: bool) -> None:
    """Squares in a dark wall: specks are none unless they are many, nor is one small hole; frames of a clip keep what there is."""
    picture = np.full((200, 300, 3), 0.03)
    for at in np.linspace(20, 270 - side, count).astype(int):
        picture[20 : 20 + side, at : at + side] = 1
    small, grid = Small(picture), RayGrid((300, 200), (0.5, -0.5))
    tone = measure.tones(small, grid)
    parts = measure.parts(small, tone, grid)
    assert parts.any() == gaps
    emits = small.y > 0.5
    assert np.all(parts[emits] == gaps) and np.all(measure.parts(small, tone, grid, held=True)[emits] == 1)
    assert measure.gap_share(emits.astype(float), grid) <= (count * (2 + side / 3)) / 64


def test_oklab_of_known_colours() -> None:
    """Ottosson's table: white, and linear red, green and blue."""
    known = [[1, 0, 0], [0.6280, 0.2249, 0.1258], [0.8664, -0.2339, 0.1795], [0.4520, -0.0325, -0.3115]]
    np.testing.assert_allclose(measure.oklab(np.vstack([np.ones((1, 3)), np.eye(3)])), known, atol=2e-4)


def test_white_of_floats() -> None:
    """1 for what is shown as it is; a picture out of that range, times a factor, has a white times that factor; no step at its ends."""
    picture = np.random.default_rng(0).random((40, 50, 3))
    assert measure.white_of(picture) == measure.white_of(3.5 * picture) == measure.white_of(0.35 * picture) == 1
    assert measure.white_of(1e5 * picture) == pytest.approx(100 * measure.white_of(1e3 * picture))
    assert measure.white_of(1e-5 * picture) == pytest.approx(0.01 * measure.white_of(1e-3 * picture))
    scales = np.geomspace(1e-3, 1e3, 1001)
    whites = [measure.white_of(s * picture) for s in scales]
    assert np.abs(np.diff(np.log(whites))).max() < 0.015 and np.all(np.diff(whites) >= 0)
    assert measure.white_of(np.zeros((3, 3, 3))) == 1


def test_depth_maps_are_normalised() -> None:
    """Relative maps linearly between their 1st and 99th percentiles, metres in logarithms, the infinite far, the flat far."""
    relative = np.linspace(0.2, 0.8, 10000).reshape(100, 100)
    found = normalised(relative)
    assert found.dtype == np.float32 and found.min() == 0 and found.max() == 1
    inner = (found > 0) & (found < 1)
    np.testing.assert_allclose(found[inner], ((relative - 0.206) / 0.588)[inner], atol=2e-4)
    metres = np.geomspace(1, 1000, 10000).reshape(100, 100)
    np.testing.assert_allclose(normalised(metres)[inner], np.linspace(-0.0102, 1.0102, 10000).reshape(100, 100)[inner], atol=3e-4)
    metres[:5] = np.inf
    assert np.all(normalised(metres)[:5] == 1) and np.all(normalised(metres)[5] < 0.1)
    close = np.linspace(2, 3, 10000).reshape(100, 100)  # metres, all much alike: linear
    assert normalised(close)[50, 0] == pytest.approx(0.5, abs=1e-3)
    for flat in (np.full((4, 5), 0.3), np.full((4, 5), 7.0), np.full((4, 5), np.inf), np.full((4, 5), np.nan)):
        assert np.all(normalised(flat) == 1)
    mixed = relative.copy()
    mixed[0, :3] = np.nan, np.inf, -np.inf
    assert normalised(mixed)[0, :3].tolist() == [1, 1, 0]


@given(st.floats(1e-3, 10), st.integers(0, 1000))
def test_metres_in_any_unit_are_the_same(unit_length: float, seed: int) -> None:
    """As long as they are known to be metres: the farthest beyond 1."""
    metres = np.exp(np.random.default_rng(seed).normal(0, 1.5, (60, 60))) * 1e4
    np.testing.assert_allclose(normalised(metres * unit_length), normalised(metres), atol=2e-5)


def test_nearness_is_where_the_map_is_near() -> None:
    depth = np.linspace(0, 1, 10000).reshape(100, 100)
    found = nearness(depth)
    assert np.all(found[:5] == 1) and np.all(found[-39:] == 0) and np.all(np.diff(found.ravel()) <= 0)
    assert np.all(nearness(depth, (0.5, 0.6))[:49] == 1)
    assert check_range((0, 1)) == (0.0, 1.0)


def test_light_wraps_round_a_subject_at_its_edge_only() -> None:
    """None without wrap; with it, half of it at the edge, none farther in than three radii, and the less the smaller wrap is."""
    subject = np.zeros((300, 400), np.float32)
    subject[60:240, 100:300] = 1
    assert np.array_equal(subject_nearness(subject, 0.0), subject)
    full, half = subject_nearness(subject, 1.0), subject_nearness(subject, 0.5)
    assert full.shape == subject.shape and full.dtype == np.float32
    assert np.all(full <= half) and np.all(half <= subject) and np.all(full[subject == 0] == 0)
    np.testing.assert_allclose(subject - half, 0.5 * (subject - full), atol=1e-6)
    deep = 3 * 0.012 * 500
    inner = np.s_[int(60 + deep) : int(240 - deep), int(100 + deep) : int(300 - deep)]
    assert full[inner].min() > 0.99 and full[150, 100] < 0.15
    assert np.all(np.diff(full[150, 100:140]) >= -1e-6)
