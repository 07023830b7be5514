"""The look on scenes whose answer is known: as strong as it is asked for, in the light's colour, in the gaps, nothing where nothing is."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from look_scenes import BLUE, GREY, HEIGHT, LIGHT, WARM, WIDTH, Change, bar_columns, barred, shone, sky

import airlight
from airlight.colour import encode_codes
from airlight.lights import Light
from airlight.look.apply import apply
from airlight.look.grid import points
from airlight.look.measure import oklab
from airlight.look.near import nearness, subject_nearness
from airlight.options import Look
from airlight.planes import shrink
from airlight.reference.look import REC709, WHITE

DISC = Light(LIGHT, kind="disc")


@pytest.fixture(scope="module")
def renderer() -> Iterator[airlight.Renderer]:
    yield airlight.Renderer()


@pytest.fixture(scope="module")
def bars(renderer: airlight.Renderer) -> Change:
    return shone(renderer, barred(), DISC)


def hue(colour: np.ndarray) -> float:
    """Degrees, in OKLab."""
    _, a, b = oklab(colour)
    return math.degrees(math.atan2(b, a))


def distances(light: tuple[float, float] = LIGHT) -> np.ndarray:
    """(H, W) from the light, diagonals."""
    x, y = points(WIDTH, HEIGHT)
    return np.hypot(x - light[0] * WIDTH / math.hypot(WIDTH, HEIGHT), y - light[1] * HEIGHT / math.hypot(WIDTH, HEIGHT))


@pytest.mark.parametrize("codes", [False, True])
def test_a_disc_in_a_clear_sky_is_left_as_it_is(renderer: airlight.Renderer, codes: bool) -> None:
    """Nothing stands before it, and a line says so."""
    picture = encode_codes(sky(), np.uint8) if codes else sky()
    change = shone(renderer, picture, DISC)
    assert np.array_equal(change.after, change.before) and not change.applied.resolved.changes
    assert change.applied.resolved.message.startswith("nothing stands before the light")


@pytest.mark.parametrize("colour", [WARM, BLUE, GREY])
@pytest.mark.parametrize(("strength", "contrast", "brighter"), [(0.5, 4.0, 0.08), (1.0, 8.0, 0.08), (1.6, 12.8, 0.10)])
def test_bars_before_a_disc(
    renderer: airlight.Renderer, colour: tuple[float, ...], strength: float, contrast: float, brighter: float
) -> None:
    """The contrast that is asked for, within 5 %, in a picture that is hardly brighter, and nowhere newly above code 254."""
    change = shone(renderer, barred(colour), DISC, Look(strength=strength))
    assert change.contrast == pytest.approx(contrast, rel=0.05)
    assert change.applied.resolved.contrast == pytest.approx(contrast, rel=0.02)
    assert abs(change.brightening) < brighter
    assert np.all(change.after <= np.maximum(change.before, WHITE) + 1e-6) and change.after.min() >= 0


def test_codes_change_by_as_much(renderer: airlight.Renderer) -> None:
    """Dither adds little to the asked contrast; no code goes above 254 anew, and those of the disc stay there."""
    picture = encode_codes(barred(), np.uint8)
    change = shone(renderer, picture, DISC)
    assert change.contrast == pytest.approx(8, rel=0.05)
    assert change.applied.codes is not None
    assert not np.any((change.applied.codes > 254) & (picture <= 254)) and np.all(change.applied.codes[picture == 255] >= 254)


def test_strength_is_monotone_and_none_is_the_identity(renderer: airlight.Renderer) -> None:
    strengths = (0.25, 0.5, 0.75, 1.0, 1.4, 2.0)
    changes = [shone(renderer, barred(), DISC, Look(strength=s)) for s in strengths]
    assert [c.contrast for c in changes[:-1]] == pytest.approx([8 * s for s in strengths[:-1]], rel=0.05)
    assert np.all(np.diff([c.contrast for c in changes]) > 0)
    assert np.all(np.diff([np.abs(c.codes).mean() for c in changes]) > 0)
    for look, light in ((Look(strength=0.0), DISC), (Look(), Light(LIGHT, strength=0.0, kind="disc"))):
        none = shone(renderer, barred(), light, look)
        assert np.array_equal(none.after, none.before) and not none.applied.resolved.changes


def test_black_stays_black(renderer: airlight.Renderer) -> None:
    """A hill of luminance .0005 in front of all: 99 % of it within a code."""
    picture = barred()
    hill = (distances((0.5, 1.5)) < 0.5)[..., None]
    picture = np.where(hill, np.float32(0.0005), picture)
    change = shone(renderer, picture, DISC)
    assert 0.1 < hill.mean() < 0.5 and change.contrast > 7.5
    inner = distances((0.5, 1.5)) < 0.47  # beside the edge, the smoothed lightness is that of the sky
    assert np.percentile(np.abs(change.codes[hill[..., 0]]), 99) < 1
    assert np.abs(change.codes[inner]).max() < 1


RINGS = [WARM, BLUE, (1.0, 0.4, 0.2), (1.0, 0.75, 0.35), (0.7, 0.8, 1.0), (1.0, 0.5, 0.65), (0.6, 1.0, 0.6)]


@pytest.mark.parametrize("warmth", [None, 0.0])
@pytest.mark.parametrize("colour", RINGS)
def test_the_light_has_the_hue_of_its_ring(renderer: airlight.Renderer, colour: tuple[float, ...], warmth: float | None) -> None:
    """Within 20 degrees in all; what it lights has a part in its own."""
    change = shone(renderer, barred(colour), DISC, Look(warmth=warmth))
    added = change.added.reshape(-1, 3).sum(axis=0)
    assert abs((hue(added) - hue(np.array(colour)) + 180) % 360 - 180) < 20


def test_blue_light_has_blue_shafts(renderer: airlight.Renderer) -> None:
    added = shone(renderer, barred(BLUE), DISC).added.reshape(-1, 3).sum(axis=0)
    assert added[2] > 1.3 * added[0] and added[2] > added[1]
    warmed = shone(renderer, barred(BLUE), DISC, Look(warmth=1.0)).added.reshape(-1, 3).sum(axis=0)
    assert warmed[0] > warmed[1] > warmed[2]
    cooled = shone(renderer, barred(WARM), DISC, Look(warmth=-1.0)).added.reshape(-1, 3).sum(axis=0)
    assert cooled[2] > cooled[0]


def test_a_given_colour_is_the_light_s(renderer: airlight.Renderer) -> None:
    added = shone(renderer, barred(), Light(LIGHT, color=(0.2, 1.0, 0.4), kind="disc")).added.reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(added / added[1], (0.2, 1.0, 0.4), atol=0.25)  # on warm surfaces
    assert added[1] > 1.8 * max(added[0], added[2])


@pytest.mark.parametrize("kind", ["disc", "opening"])
@pytest.mark.parametrize("name", ["even", "noise", "coarse noise", "a square on black", "a square on grey"])
def test_pictures_without_shafts_are_declined(renderer: airlight.Renderer, name: str, kind: str) -> None:
    rng = np.random.default_rng(1)
    picture = np.full((HEIGHT, WIDTH, 3), 0.3, np.float32)
    if "noise" in name:
        picture += rng.normal(0, 0.02 if name == "noise" else 0.1, picture.shape).astype(np.float32)
    if "square" in name:
        picture[:] = 0 if name == "a square on black" else 0.02
        picture[120:160, 220:260] = 1
    change = shone(renderer, picture, Light((0.5, 0.44), kind=kind))
    assert np.array_equal(change.after, change.before)
    black = name == "a square on black"
    assert change.applied.resolved.message.endswith("--look classic draws on black" if black else "draws some")


def evening(specks: float = 0.0) -> np.ndarray:
    """(H, W, 3) float32: a glow over dark ground, fading into an even sky above. specks: how much brighter three spots are."""
    rows = ((np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None, None]
    picture = (0.12 + 0.8 * np.exp(-np.square((rows - 0.55) / 0.25))) * np.ones((1, WIDTH, 3))
    picture[rows[:, 0, 0] > 0.55] = 0.05
    for x, y in ((90, 30), (250, 50), (330, 40)):
        picture[y : y + 5, x : x + 5] += specks
    return picture.astype(np.float32)


@pytest.mark.parametrize("specks", [0.0, 0.24, 0.7])
@pytest.mark.parametrize("light", [(0.4, -0.1), (0.6, -0.3), (0.1, -0.05)])
def test_specks_in_an_open_sky_throw_no_bars(renderer: airlight.Renderer, specks: float, light: tuple[float, float]) -> None:
    """Faint or bright, they are no gaps for a light beyond the picture: its rays are drawn as without them, or it has none."""
    change, clean = (shone(renderer, evening(s), Light(light)) for s in (specks, 0.0))
    assert change.applied.resolved.lights[0].rays == 24 and "24 rays drawn" in change.applied.resolved.message
    assert np.abs(change.codes - clean.codes).mean() < 0.3
    none = shone(renderer, evening(specks), Light(light), Look(rays=0))
    assert np.array_equal(none.after, none.before) and none.applied.resolved.message.startswith("nothing stands before the light")


def test_rays_asked_for_are_drawn_beneath_an_open_sky(renderer: airlight.Renderer) -> None:
    """As the line says that tells of nothing before the light: `--rays 24 draws some`."""
    change = shone(renderer, evening(), Light((0.4, -0.1)), Look(rays=24))
    assert change.contrast == pytest.approx(8, rel=0.05)


def test_half_the_size_is_the_half(renderer: airlight.Renderer) -> None:
    """Pictures of 960 and 480 px: within a code on average, five in 99 of 100 values; the rest lies on edges of bars, mixed otherwise."""
    full = barred(size=(2 * WIDTH, 2 * HEIGHT))
    one = shrink(shone(renderer, full, DISC).after, WIDTH)
    half = shone(renderer, shrink(full, WIDTH), DISC)
    off = np.abs(Change(one, half.after, half.applied).codes)
    assert off.mean() < 1 and np.percentile(off, 99) < 5


@pytest.mark.parametrize("light", [(0.3, 0.3), (0.7, -0.15), (1.2, 0.4)])
def test_the_mirrored_is_mirrored(renderer: airlight.Renderer, light: tuple[float, float]) -> None:
    """Half a code on average; left to right, since what lies above a light counts otherwise than what lies below."""
    picture = barred(light=light)
    one = shone(renderer, picture, Light(light, kind="disc"))
    other = shone(renderer, np.ascontiguousarray(picture[:, ::-1]), Light((1 - light[0], light[1]), kind="disc"))
    off = np.abs(Change(one.after, other.after[:, ::-1], one.applied).codes)
    assert one.contrast > 1 and off.mean() < 0.5


def test_shafts_lie_in_the_gaps(bars: Change) -> None:
    """On the ground, on lines from the light: what is added through gaps is some times that behind bars, which is darkened instead."""
    x, y = points(WIDTH, HEIGHT)
    diagonal = math.hypot(WIDTH, HEIGHT)
    rows = y > 0.62 * HEIGHT / diagonal
    # where the line to the light crosses the lower part of the bars
    share = (0.42 - LIGHT[1]) * HEIGHT / diagonal / (y - LIGHT[1] * HEIGHT / diagonal)
    crossing = LIGHT[0] + (x * diagonal / WIDTH - LIGHT[0]) * share
    barred_at = bar_columns(WIDTH)[np.clip((crossing * WIDTH).astype(int), 0, WIDTH - 1)]
    reach = rows & (np.abs(crossing - 0.5) < 0.2)
    light, taken = bars.added @ REC709, bars.applied.taken
    assert taken is not None
    gaps, behind = reach & (barred_at < 0.05), reach & (barred_at > 0.95)
    assert light[gaps].mean() > 3 * light[behind].mean()
    assert taken[behind].mean() > 1.5 * taken[gaps].mean()


def test_nothing_is_put_before_what_is_near(renderer: airlight.Renderer, bars: Change) -> None:
    """By a depth map, and by a subject's mask: in a part that is near all stays, elsewhere shafts are shown."""
    depth = np.ones((HEIGHT, WIDTH), np.float32)
    depth[180:300, 100:220] = 0.01
    near = nearness(depth)
    subject = subject_nearness((depth < 0.5).astype(np.float32), 0.0)
    inner = np.s_[181:299, 101:219]
    assert np.abs(bars.codes[inner]).mean() > 1
    for plane in (near, subject):
        change = shone(renderer, barred(), DISC, near=plane)
        assert np.all(change.added[inner] == 0) and np.all(change.applied.taken[inner] == 0)  # type: ignore[index]
        assert change.contrast == pytest.approx(8, rel=0.05)


def test_light_wraps_round_a_subject_s_edge(renderer: airlight.Renderer) -> None:
    """A little at its edge, by as much as wrap says, nothing within."""
    mask = np.zeros((HEIGHT, WIDTH), np.float32)
    mask[180:300, 100:220] = 1
    totals = []
    for wrap in (0.0, 0.5, 1.0):
        change = shone(renderer, barred(), DISC, near=subject_nearness(mask, wrap))
        moved = np.abs(change.codes).sum(axis=2)
        deep = moved[204:276, 124:196]  # 3.5 radii of the wrap within
        edge = np.concatenate([moved[181:184, 101:219].ravel(), moved[181:299, 101:104].ravel(), moved[181:299, 216:219].ravel()])
        totals.append(edge.mean())
        assert deep.max() < 0.3
    assert totals[0] == 0 and 0.3 < totals[1] < totals[2]


def test_a_mask_says_what_may_emit(renderer: airlight.Renderer) -> None:
    """Nothing emits where the mask is 0: no shafts at all, or those of the left half only."""
    none = shone(renderer, barred(), DISC, masked=np.zeros((HEIGHT, WIDTH), np.float32))
    assert np.array_equal(none.after, none.before)
    left = np.zeros((HEIGHT, WIDTH), np.float32)
    left[:, : WIDTH // 2] = 1
    change = shone(renderer, barred(), DISC, masked=left)
    light = change.added @ REC709
    assert light[:, : WIDTH // 2 - 10].mean() > 5 * light[:, WIDTH // 2 + 10 :].mean()


@pytest.mark.parametrize("gpu", [True, False])
def test_floats_are_only_added_to(renderer: airlight.Renderer, gpu: bool) -> None:
    """out = in + added where no shade is asked for: nothing is taken anywhere. With a shade something is."""
    picture = barred()
    for shade in (None, 0.5):
        found = apply(renderer if gpu else None, picture, picture, [DISC], Look(shade=shade), float_output=True)
        assert found.added is not None and found.taken is not None and found.codes is None
        assert found.added.dtype == np.float32 and found.added.min() >= 0 and found.added.max() > 0.02
        assert np.all(found.taken == 0) if shade is None else found.taken.max() > 0.02


@pytest.mark.parametrize("factors", [(20.0, 1000.0), (0.02, 1e-3)])
def test_floats_of_any_scale(renderer: airlight.Renderer, factors: tuple[float, float]) -> None:
    """A picture out of the range that is shown as it is, times 1,000 or a thousandth: its layer times that, within halves' rounding."""
    base, factor = barred() * np.float32(factors[0]), np.float32(factors[1])
    one, other = (apply(renderer, p, p, [DISC], Look(), float_output=True) for p in (base, base * factor))
    assert one.added is not None and other.added is not None and one.added.max() > 0.01 * factors[0]
    off = np.abs(other.added / factor - one.added)
    assert off.max() < 4e-3 * one.added.max()


EXTREMES = {
    "all zeros": np.zeros((40, 60, 3)),
    "all ones": np.ones((40, 60, 3)),
    "1 x 1": np.full((1, 1, 3), 0.4),
    "2 x 3": np.random.default_rng(0).random((2, 3, 3)),
    "1 x 500": np.random.default_rng(0).random((1, 500, 3)),
    "500 x 1": np.random.default_rng(0).random((500, 1, 3)),
    "huge": np.where(np.random.default_rng(0).random((40, 60, 1)) > 0.5, 1e30, 0.1) * np.ones(3),
    "one huge": np.where(np.arange(2400).reshape(40, 60, 1) == 1230, 1e30, 0.1) * np.ones(3),
    "tiny": 1e-30 * np.random.default_rng(0).random((40, 60, 3)),
    "negative": -np.random.default_rng(0).random((40, 60, 3)),
    "inf": np.where(np.random.default_rng(0).random((40, 60, 1)) > 0.9, np.inf, 0.1) * np.ones(3),
    "nan": np.where(np.random.default_rng(0).random((40, 60, 1)) > 0.9, np.nan, 0.1) * np.ones(3),
}


@pytest.mark.parametrize("gpu", [True, False])
@pytest.mark.parametrize("name", EXTREMES)
def test_extremes_give_numbers(renderer: airlight.Renderer, name: str, gpu: bool) -> None:
    """No NaN, no infinity, nothing negative; rays are drawn, so that there is a look at all. Codes too, where they are any."""
    picture = EXTREMES[name].astype(np.float32)
    lights = [Light((0.4, 0.3)), Light((0.5, -0.5)), Light((0.0, 0.0)), Light((1e6, 3.0))]
    for light in lights if gpu else lights[:2]:
        found = apply(renderer if gpu else None, picture, picture, [light], Look(rays=24, mist=1.0), float_output=True)
        assert all(math.isfinite(v) for v in (found.resolved.strength, found.resolved.contrast, found.resolved.wanted))
        if found.added is not None:
            sane = np.isfinite(picture).all(axis=2)
            assert np.isfinite(found.added[sane]).all() and np.isfinite(found.taken[sane]).all()  # type: ignore[index]
            assert found.added[sane].min() >= 0 and found.taken[sane].min() >= 0  # type: ignore[index]
        if light == lights[0] and picture.min() >= 0 and picture.max() <= 1:
            codes = encode_codes(picture, np.uint8)
            found = apply(renderer if gpu else None, codes, picture, [light], Look(rays=24, mist=1.0), float_output=False)
            assert math.isfinite(found.resolved.strength)
            if found.added is not None:
                assert np.isfinite(found.added).all()


@pytest.mark.parametrize("bad", [math.nan, math.inf, 3e38, -1e30])
def test_one_bad_pixel_changes_nothing_elsewhere(renderer: airlight.Renderer, bad: float) -> None:
    """In a picture that is shrunk for all that is measured, on the ground: the layer beside it within .003."""
    size = (2 * WIDTH, 2 * HEIGHT)
    picture = barred(size=size)
    one = apply(renderer, picture, picture, [DISC], Look(), float_output=True)
    picture[500, 100] = bad
    other = apply(renderer, picture, picture, [DISC], Look(), float_output=True)
    assert one.added is not None and other.added is not None and np.isfinite(other.added).all()
    off = np.abs(other.added - one.added)
    off[490:510, 90:110] = 0  # the smoothed lightness
    assert off.max() < 0.003


def test_alpha_is_ignored_and_the_picture_is_not_changed(renderer: airlight.Renderer) -> None:
    """Four channels give what three do; arguments stay as they are."""
    picture = barred()
    four = np.concatenate([picture, np.random.default_rng(0).random((HEIGHT, WIDTH, 1)).astype(np.float32)], axis=2)
    kept = four.copy()
    one = apply(renderer, picture, picture, [DISC], Look(), float_output=True)
    other = apply(renderer, four, picture, [DISC], Look(), float_output=True)
    assert one.added is not None and other.added is not None
    assert np.array_equal(one.added, other.added) and np.array_equal(four, kept)


def test_held_settings_are_kept(renderer: airlight.Renderer) -> None:
    """A frame of a sequence takes strength, colour and tones from the one before, whatever it shows itself."""
    first = shone(renderer, barred(), DISC)
    again = shone(renderer, 0.7 * barred(), DISC, held=first.applied.resolved)
    assert again.applied.resolved == first.applied.resolved
    same = shone(renderer, barred(), DISC, held=first.applied.resolved)
    np.testing.assert_allclose(same.added, first.added, atol=1e-6)


def test_several_lights(renderer: airlight.Renderer) -> None:
    """Two alike at one place are one; one of strength 0 is none; the contrast is that of all together."""
    one = apply(renderer, barred(), barred(), [DISC], Look(), float_output=True)
    with_none = apply(renderer, barred(), barred(), [DISC, Light((0.8, 0.2), strength=0.0, kind="disc")], Look(), float_output=True)
    assert one.added is not None and with_none.added is not None
    np.testing.assert_allclose(with_none.added, one.added, atol=1e-3)
    twice = apply(renderer, barred(), barred(), [DISC, DISC], Look(), float_output=True)
    assert twice.added is not None and twice.resolved.contrast == pytest.approx(8, rel=0.02)
    assert np.abs(twice.added - one.added).mean() < 0.05 * one.added.mean()


def test_fineness_length_and_mist(renderer: airlight.Renderer, bars: Change) -> None:
    """Longer reach brings light farther, mist brings light that is even, coarser rays vary less from line to line."""
    far = distances() > 0.35

    def outer(change: Change) -> float:
        return float(np.abs(change.codes[far]).mean() / np.abs(change.codes).mean())

    short, long = (shone(renderer, barred(), DISC, Look(length=v)) for v in (0.08, 1.5))
    assert outer(short) < 0.6 * outer(long)
    misty = shone(renderer, barred(), DISC, Look(mist=1.0))
    assert misty.brightening > bars.brightening + 0.02
    coarse = shone(renderer, barred(), DISC, Look(fineness=4.0))
    level = [np.abs(np.diff(c.codes[220:300].mean(axis=(0, 2)))).sum() for c in (bars, coarse)]
    assert level[1] < 0.95 * level[0]
