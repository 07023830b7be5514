"""Each pass of the look on the GPU is its float64 twin in reference/look.py, and planes.shrink: over random and structured arrays.

Each twin is given what the pass was given, read back from the GPU, so that a tolerance is that of one pass: textures hold halves, to
which drivers may cut floats off instead of rounding them: by up to 2^-10 of their value (HALF).
"""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import airlight
from airlight.colour import encode_codes, srgb_decode, srgb_encode
from airlight.files import to_linear
from airlight.lights import Light
from airlight.look.apply import apply
from airlight.look.grid import LINES, RADII, RayGrid, points
from airlight.look.measure import few, small_copy
from airlight.look.plan import FIELDS, LookPlan
from airlight.noise import dither
from airlight.options import Look
from airlight.planes import shrink
from airlight.reference import look as twin

HALF = 2.0**-10
SIZE = (180, 130)
PLACES = {
    "inside": (0.42, 0.55),
    "in the corner": (0.01, 0.02),
    "on the border": (1.0, 0.3),
    "above": (0.6, -0.3),
    "left": (-0.8, 0.5),
    "diagonal": (1.4, 1.7),
    "far away": (-3e4, -9e4),
}
TONES = twin.Tones(0.08, 0.7)


@pytest.fixture(scope="module")
def renderer() -> Iterator[airlight.Renderer]:
    yield airlight.Renderer()


def structured(width: int, height: int, seed: int = 0) -> np.ndarray:
    """(H, W, 3) float32 linear: a bright sky through a random lattice, with texture from pixel to pixel."""
    rng = np.random.default_rng(seed)
    cells = np.kron(rng.random((-(-height // 9), -(-width // 7), 1)) > 0.45, np.ones((9, 7, 1)))[:height, :width]
    return ((0.04 + 0.7 * cells) * (0.8 + 0.4 * rng.random((height, width, 3)))).astype(np.float32)


@dataclass
class Passes:
    """One light's passes over a picture, and what they left, as float64 arrays."""

    plan: LookPlan
    grid: RayGrid
    parts: np.ndarray
    seen: tuple[np.ndarray, np.ndarray]
    number: int = 0

    def texture(self, name: str) -> np.ndarray:
        found = getattr(self.plan.lights[self.number], name)
        width, height, _ = found.size
        return np.frombuffer(self.plan.device.read(found, 8), np.float16).reshape(height, width, 4).astype(float)

    def lines(self, index: int) -> np.ndarray:
        """raw, smoothed, grouped, means: (RADII, n, 2)."""
        data = self.plan.device.queue.read_buffer(self.plan.lines[index])
        return np.frombuffer(data, np.float32).reshape(RADII, -1, 2).astype(float)

    @property
    def level(self) -> np.ndarray:
        """(h, w): L of the small copy, to a half's precision."""
        return self.texture("matte")[..., 2]


def floats(picture: np.ndarray) -> np.ndarray:
    return np.concatenate([picture, np.ones_like(picture[..., :1])], axis=2)


def run(renderer: Any, place: tuple[float, float], pattern: bool = False, fineness: float = 0.45) -> Passes:
    """Run the passes over a structured picture. The parts that may emit are smooth noise."""
    plan = renderer.look_plan(SIZE, False, False, "normal")
    picture = structured(*SIZE)
    small = small_copy(picture)
    plan.upload(floats(picture), small.guide, None)
    grid = RayGrid(SIZE, place)
    parts = np.random.default_rng(5).random(small.y.shape).astype(np.float16).astype(float)
    drawn = twin.drawn_pattern(24, grid, 3) if pattern else None
    return Passes(plan, grid, parts, plan.see(0, grid, TONES, parts, fineness, drawn))


@pytest.fixture(scope="module", params=PLACES)
def passes(request: pytest.FixtureRequest, renderer: airlight.Renderer) -> Passes:
    return run(renderer, PLACES[request.param])


@pytest.mark.parametrize(("size", "quality"), [((1501, 67), "normal"), ((37, 1407), "draft"), ((90, 60), "normal"), ((1, 700), "draft")])
@pytest.mark.parametrize("codes", [False, True])
def test_shrink(renderer: airlight.Renderer, size: tuple[int, int], quality: str, codes: bool) -> None:
    """L, a half, of means whose borders among 1,500 px are floats, to 1.2e-4 px each; of codes, filtered in 8 bits, to one of them."""
    picture = structured(*size)
    given: Any = np.rint(255 * srgb_encode(np.minimum(floats(picture), 1))).astype(np.uint8) if codes else 3 * floats(picture)
    plan = renderer.look_plan(size, codes, False, quality)
    plan.upload(given, np.zeros((plan.small_size[1], plan.small_size[0], 2)), None, 1.0 if codes else 3.0)
    if codes:
        mean = srgb_decode(twin.mean_codes(given[..., :3] / 255.0, *plan.field_size))
    else:
        mean = shrink(given[..., :3] / 3, FIELDS[quality])
    grid, lets = RayGrid(size, (0.5, 0.4)), np.ones(plan.small_size[::-1])
    found = Passes(plan, grid, lets, plan.see(0, grid, TONES, lets, 0.45)).level
    y = mean @ twin.REC709
    assert found.shape == y.shape
    np.testing.assert_allclose(found**3, y, rtol=4 * HALF + (3e-3 if codes else 0), atol=1e-2 if codes else 3e-4)


def test_matte(passes: Passes) -> None:
    """The emission's slope, 1.5 / (0.4 ln(.7 / .08)), raises float errors of the logarithm little; the rest is that of halves."""
    height, width = passes.level.shape
    y = structured(*SIZE).astype(float) @ twin.REC709
    np.testing.assert_allclose(passes.level, twin.lightness(y), rtol=HALF, atol=1e-5)
    expected = twin.matte(y, TONES, twin.resized(passes.parts, width, height), passes.grid)
    found = passes.texture("matte")
    for index in (0, 1):
        np.testing.assert_allclose(found[..., index], expected[index], rtol=HALF, atol=2e-5)
    assert expected[0].max() > 0.3 and (expected[1] == 0).mean() > 0.2


def test_emission_and_nearness_of_a_ramp(renderer: airlight.Renderer) -> None:
    """Each luminance from black to ten times the light's, before a light so near that the weight is known."""
    plan = renderer.look_plan((256, 2), False, False, "normal")
    ramp = np.repeat(np.geomspace(1e-7, 7, 256)[None, :, None], 2, axis=0).repeat(3, axis=2).astype(np.float32)
    plan.upload(floats(ramp), np.zeros((2, 256, 2)), None)
    grid, lets = RayGrid((256, 2), (0.5, 0.5)), np.ones((2, 256))
    found = Passes(plan, grid, lets, plan.see(0, grid, TONES, lets, 0.45))
    emits, weighted = found.texture("matte")[..., 1], found.texture("matte")[..., 0]
    y = ramp.astype(float) @ twin.REC709
    np.testing.assert_allclose(emits, twin.emission(y, TONES), rtol=HALF, atol=2e-5)
    assert emits[0, 0] == 0 and emits[0, -1] == 1
    x, rows = points(256, 2)
    distance = np.hypot(x - grid.light[0], rows - grid.light[1])
    np.testing.assert_allclose(weighted, twin.emission(y, TONES) * twin.nearness_weight(distance), rtol=HALF, atol=2e-5)


def test_scan(passes: Passes) -> None:
    """All but one in a thousand within 1e-3; where a sample falls upon the border itself, floats may count it or not: one step of light.

    At 40 diagonals floats are 4e-6 diagonals apart, where a step is 1e-3 and lines are 1e-3 apart: places are off by a hundredth of them.
    """
    matte = passes.texture("matte")
    share, dark = twin.scan(matte[..., 0], matte[..., 1], passes.grid)
    found = passes.lines(0)
    off = np.abs(found[..., 0] - share)
    assert share.max() > 0.2
    assert np.quantile(off, 0.999) < (5e-3 if passes.grid.nearest > 10 else 1e-3)
    assert off.max() < 1.05 * passes.grid.step / twin.STEPS / twin.FIRST_LENGTH
    np.testing.assert_allclose(found[..., 1], dark, atol=2e-3)


def test_smooth(passes: Passes) -> None:
    """A sum of some twenty floats."""
    expected = twin.smooth(passes.lines(0)[..., 0], passes.grid, 0.45)
    found = passes.lines(1)
    np.testing.assert_allclose(found[..., 0], expected, atol=3e-6)
    assert np.array_equal(found[..., 1], passes.lines(0)[..., 1])


def test_low(passes: Passes) -> None:
    """A quotient of sums of some hundred floats."""
    smoothed, means = passes.lines(1), passes.lines(3)
    for index, degrees in enumerate(twin.breadths(0.45)):
        expected = twin.low(smoothed[..., 0], smoothed[..., 1], passes.grid, degrees)
        np.testing.assert_allclose(twin.between_groups(means[..., index], passes.grid.inside), expected, atol=1e-5)
        assert np.ptp(expected, axis=1).max() > 0.01


@pytest.mark.parametrize("pattern", [False, True])
@pytest.mark.parametrize("place", PLACES)
def test_bands(renderer: airlight.Renderer, place: str, pattern: bool) -> None:
    """Of the same lines within halves, of values below 1."""
    passes = run(renderer, PLACES[place], pattern, 0.9)
    raw, found = passes.lines(0), passes.texture("bands")
    drawn = twin.drawn_pattern(24, passes.grid, 3) if pattern else None
    expected = twin.bands(raw[..., 0], raw[..., 1], passes.grid, 0.9, drawn)
    np.testing.assert_allclose(found[:, 1:-1, :3], expected, rtol=HALF, atol=2e-5)
    beyond = (found[:, -2], found[:, 1]) if passes.grid.inside else (found[:, 1], found[:, -2])
    assert np.array_equal(found[:, 0], beyond[0]) and np.array_equal(found[:, -1], beyond[1])
    assert np.abs(expected[..., 1]).max() > 0.005


def test_glance(passes: Passes) -> None:
    """Polar places and the lookup among bands, whose place between neighbours is off by a hundredth; far away by some more, see scan."""
    bands = passes.texture("bands")[:, 1:-1, :3]
    expected, distance = twin.at_points(bands, passes.grid, *map(few, points(*passes.plan.small_size)))
    np.testing.assert_allclose(passes.seen[1], distance, rtol=1e-6, atol=1e-6)
    off = np.abs(passes.seen[0] - expected)
    steps = max(np.abs(np.diff(bands, axis=axis)).max() for axis in (0, 1))
    assert off.max() < (0.05 if passes.grid.nearest > 10 else 0.01) * steps


COLORS = np.array([(1.6, 0.9, 0.5), (0.4, 1.1, 1.8), (1.0, 1.0, 1.0)])
COLORS /= (COLORS @ twin.REC709)[:, None]  # the GPU takes missing light from a colour of luminance 1


def settings_of(grid: RayGrid, number: int) -> twin.RaySettings:
    return twin.RaySettings(grid, TONES, 0.04 + 0.02 * number, 0.05, 0.4, 0.3 * number, 0.02, 1 - 0.3 * number, tuple(COLORS[number]))


def fields(renderer: Any, codes: bool, near: bool, places: list[str], picture: np.ndarray) -> tuple[LookPlan, Any, list[Passes]]:
    """A plan whose lights are seen and settled, at strength .7 and shade .8."""
    plan = renderer.look_plan(SIZE, codes, near, "normal")
    linear = to_linear(picture)[0] if codes else picture[..., :3]
    small = small_copy(linear)
    hidden = np.random.default_rng(8).random(SIZE[::-1] if near else small.y.shape)
    plan.upload(picture, small.guide, hidden)
    seen = []
    for number, name in enumerate(places):
        grid, parts = RayGrid(SIZE, PLACES[name]), np.ones(small.y.shape)
        seen.append(Passes(plan, grid, parts, plan.see(number, grid, TONES, parts, 0.45), number))
    plan.set_lights([settings_of(one.grid, one.number) for one in seen], 0.7, 0.8, (0.12, 0.35))
    return plan, (small, hidden.astype(np.float16).astype(float)), seen


def test_amounts(renderer: airlight.Renderer) -> None:
    """At the grid's own places: halves of values below 1, of bands whose errors are raised by .45 / deviation."""
    _, _, seen = fields(renderer, False, False, ["inside", "above"], floats(structured(*SIZE)))
    for one in seen:
        one.plan.read()
        bands, s = one.texture("bands"), settings_of(one.grid, one.number)
        distance = (s.grid.nearest + (np.arange(RADII) + 1) * s.grid.step)[:, None] * np.ones(bands.shape[1])
        angle = s.grid.start + (np.arange(bands.shape[1]) - 0.5) * (s.grid.span / LINES)
        entry = s.grid.entry(np.cos(angle), np.sin(angle))
        expected = twin.ray_amount(bands, distance, entry, np.zeros_like(distance), dataclasses.replace(s, weight=1.0))
        np.testing.assert_allclose(one.texture("amounts")[..., 0], expected, rtol=2 * HALF, atol=2e-4)
        assert np.ptp(expected) > 0.2


@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("places", [["inside"], ["above"], ["left", "inside", "diagonal"]])
def test_field(renderer: airlight.Renderer, places: list[str], near: bool) -> None:
    """The change by one light and by three, over amounts read back. What is near counts here only where it is known coarsely."""
    plan, (small, hidden), seen = fields(renderer, False, near, places, floats(structured(*SIZE)))
    plan.read()
    added, missing = np.zeros((SIZE[1], SIZE[0], 3)), np.zeros(SIZE[::-1])
    for one in seen:
        s = settings_of(one.grid, one.number)
        amounts, emits = one.texture("amounts")[:, 1:-1, :1], one.texture("matte")[..., 1]
        amount = s.weight * twin.at_points(amounts, one.grid, *points(*SIZE))[0][..., 0] * (1 - twin.EMITTER * emits)
        added += np.maximum(amount, 0)[..., None] * np.array(s.color)
        missing += np.maximum(-amount, 0)
    guide = twin.resized(small.guide.astype(np.float16).astype(float), *SIZE)
    add, take = twin.change(guide[..., 0] * seen[0].level + guide[..., 1], added, missing, 0.7, 0.8, (0.12, 0.35))
    if not near:
        coarse = twin.resized(hidden, *SIZE)
        add, take = add * (1 - coarse)[..., None], take * (1 - coarse)
    found = seen[-1].texture("field")
    assert add.max() > 0.1 and take.max() > 0.1
    off = np.abs(found - np.concatenate([add, take[..., None]], axis=-1))
    assert off.max() < 4e-3 and off.mean() < 3e-4


def expected_put(near: np.ndarray | None, field: np.ndarray, linear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`put` over the field that the GPU has made: (added, taken)."""
    hidden = np.zeros(SIZE[::-1]) if near is None else near
    return twin.put(linear, field[..., :3], field[..., 3], hidden)


@pytest.mark.parametrize("near", [False, True])
def test_put_as_a_layer(renderer: airlight.Renderer, near: bool) -> None:
    """Halves of what is added, below 1, and of what is taken; nearness is halves as well."""
    picture = floats(structured(*SIZE))
    picture[:20] *= 3  # brighter than white
    picture[-20:] *= 0.02
    plan, (_, hidden), seen = fields(renderer, False, near, ["inside", "above"], picture)
    found = plan.read().astype(float)
    added, taken = expected_put(hidden if near else None, seen[-1].texture("field"), picture[..., :3].astype(float))
    assert added.max() > 0.05 and taken.max() > 0.1
    np.testing.assert_allclose(found[..., :3], added, rtol=2 * HALF, atol=2e-4)
    np.testing.assert_allclose(found[..., 3], taken, rtol=2 * HALF, atol=2e-4)


@pytest.mark.parametrize("near", [False, True])
def test_put_as_codes(renderer: airlight.Renderer, near: bool) -> None:
    """A change is right to 2 % and a tenth of a code, by roots instead of powers; what is changed by less than 1e-3 codes keeps them."""
    picture = np.rint(255 * srgb_encode(np.minimum(floats(structured(*SIZE)), 1))).astype(np.uint8)
    plan, (_, hidden), seen = fields(renderer, True, near, ["inside", "above"], picture)
    found = plan.read()
    linear = to_linear(picture)[0].astype(float)
    added, taken = expected_put(hidden if near else None, seen[-1].texture("field"), linear)
    rise = 255 * srgb_encode(np.clip(linear * (1 - taken)[..., None] + added, 0, 1)) - picture[..., :3]
    grain = (np.minimum(np.floor(256 * dither()), 255) + 0.5)[: SIZE[1], : SIZE[0]] / 256
    slack = 0.1 + 0.02 * np.abs(rise)
    low, high = (np.floor(picture[..., :3] + rise + way * slack + grain) for way in (-1, 1))
    within = (found[..., :3] >= low) & (found[..., :3] <= high)
    still = np.abs(rise) < 5e-4
    assert within[~still].mean() > 0.999 and np.abs(rise).max() > 20
    assert np.array_equal(found[..., :3][still], picture[..., :3][still]) and still.sum() > 20
    assert np.array_equal(found[..., 3], picture[..., 3])


@pytest.mark.parametrize("place", ["inside", "above"])
@pytest.mark.parametrize("codes", [False, True])
def test_the_whole_look_without_a_gpu(renderer: airlight.Renderer, place: str, codes: bool) -> None:
    """All passes with all that is measured between them: .02 codes on average, one at most; of codes, which are dithered, half a code."""
    picture: Any = np.clip(0.1 + 0.9 * structured(300, 200), 0, 1)
    if codes:
        picture = encode_codes(picture, np.uint8)
    linear = to_linear(picture)[0] if codes else picture
    lights = [Light(PLACES[place], kind="glow")]
    one = apply(renderer, picture, linear, lights, Look(), float_output=False)
    other = apply(None, picture, linear, lights, Look(), float_output=False)
    assert one.resolved.strength == pytest.approx(other.resolved.strength, rel=2e-3)
    assert one.resolved.changes and other.added is not None and other.taken is not None
    expected = 255 * srgb_encode(np.clip(linear * (1 - other.taken)[..., None] + other.added, 0, 1))
    if codes:
        found = one.codes.astype(float)
    else:
        found = 255 * srgb_encode(np.clip(linear * (1 - one.taken)[..., None] + one.added, 0, 1))
    off = np.abs(found - expected)
    assert off.mean() < (0.5 if codes else 0.02) and off.max() < (2 if codes else 1)
