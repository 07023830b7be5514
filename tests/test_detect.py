"""The light is found where a person would mark it, and not where there is none."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import airlight
from airlight.colour import decode_codes, encode_codes
from airlight.detect import ACT, ASK, Candidate, find_light, find_lights
from airlight.detect.sheet import draw_candidates
from airlight.detect.signals import linear_copy
from airlight.files import read_image
from airlight.planes import blur, shrink

PHOTOS = Path(__file__).parent.parent / "examples" / "photos"
# marked by eye: the sun, the middle of the opening, the vanishing point of the lamps; kind; widths that are near enough
MARKS = {
    "casa-mila.jpg": ((0.535, 0.43), "opening", 0.07),
    "beacon-street-sunset.jpg": ((0.897, 0.467), "disc", 0.07),
    "hill-sunset.jpg": ((0.497, 0.414), "disc", 0.07),
    "dandelions.jpg": ((0.577, 0.06), "glow", 0.07),
    "sea-sunset.jpg": ((0.63, 0.305), "disc", 0.07),
    "tea-gardens-mist.jpg": ((0.78, -0.1), "beyond", 0.1),
    "night-light-frames.jpg": ((0.5, 0.84), "lamps", 0.07),
    "dark-room-opening.jpg": ((0.5, 0.42), "opening", 0.1),
}
SHIPPED = sorted(name for name in MARKS if (PHOTOS / name).exists())
WIDTH, HEIGHT = 480, 320
ASPECT = HEIGHT / WIDTH
ROW, COLUMN = np.indices((HEIGHT, WIDTH)) + 0.5
X, Y = COLUMN / WIDTH, ROW / WIDTH  # in widths
SKY = 0.15 + 0.25 * (Y / ASPECT) ** 2

Place = tuple[float, float]


@cache
def photo(name: str) -> np.ndarray:
    """The codes of a photograph, at most 480 px."""
    return encode_codes(shrink(read_image(PHOTOS / name).linear(), 480), np.uint8, dither=False)


def exposed(codes: np.ndarray, stops: float) -> np.ndarray:
    return encode_codes(np.clip(decode_codes(codes) * np.float32(2**stops), 0, 1), np.uint8, dither=False)


def cut(codes: np.ndarray, left: float, top: float, right: float, bottom: float) -> tuple[np.ndarray, Callable[[Place], Place]]:
    """What is left within shares of the width and the height, and where a place of the whole then lies."""
    inside = codes[round(top * len(codes)) : round(bottom * len(codes)), round(left * codes.shape[1]) : round(right * codes.shape[1])]
    return inside, lambda p: ((p[0] - left) / (right - left), (p[1] - top) / (bottom - top))


def variants(codes: np.ndarray) -> Iterator[tuple[str, np.ndarray, Callable[[Place], Place]]]:
    def same(p: Place) -> Place:
        return p

    yield "as is", codes, same
    yield "mirrored", codes[:, ::-1], lambda p: (1 - p[0], p[1])
    yield "cropped", *cut(codes, 0.06, 0.03, 0.97, 1)
    yield "half size", encode_codes(shrink(decode_codes(codes), 240), np.uint8, dither=False), same
    noise = np.random.default_rng(1).normal(0, 4, codes.shape)
    yield "noise", np.clip(np.rint(codes + noise), 0, 255).astype(np.uint8), same
    yield "+0.7 EV", exposed(codes, 0.7), same
    yield "-0.7 EV", exposed(codes, -0.7), same


def off(found: Candidate, mark: Place, aspect: float) -> float:
    return float(np.hypot(found.position[0] - mark[0], (found.position[1] - mark[1]) * aspect))


@pytest.mark.parametrize("name", SHIPPED)
def test_photographs_however_they_are_taken(name: str) -> None:
    mark, kind, near = MARKS[name]
    wrong = []
    for variant, codes, moved in variants(photo(name)):
        best = find_lights(codes)[0]
        error = off(best, moved(mark), codes.shape[0] / codes.shape[1])
        if error > near or best.confidence < ACT:
            wrong.append((variant, best, error))
        if variant == "as is":
            assert best.kind == kind and best.guess == (kind == "beyond")
    assert not wrong


def grey(plane: np.ndarray) -> np.ndarray:
    return np.repeat(plane[..., None], 3, axis=2).astype(np.float32)


def to_codes(plane: np.ndarray) -> np.ndarray:
    """Codes of linear values."""
    return encode_codes(np.clip(grey(plane) if plane.ndim == 2 else plane.astype(np.float32), 0, 1), np.uint8, dither=False)


def blotches(sigma: float, seed: int) -> np.ndarray:
    """Smooth noise, mean 0, deviation 1."""
    plane = blur(np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH)), sigma)
    return plane / plane.std()


def with_disc(ground: np.ndarray, x: float, y: float, radius_px: float, brightness: float) -> np.ndarray:
    cover = np.clip(radius_px - np.hypot(COLUMN - x * WIDTH, ROW - y * HEIGHT) + 0.5, 0, 1)
    return ground * (1 - cover) + brightness * cover


@pytest.mark.parametrize(
    ("place", "radius", "brightness", "scale"),
    [
        ((0.5, 0.5), 5, 1, 1),
        ((0.3, 0.25), 9, 40, 1e-4),
        ((0.3, 0.25), 9, 1, 1e4),
        ((0.1, 0.8), 16, 40, 16),
        ((0.93, 0.08), 9, 8, 1 / 16),
        ((0.3, 0.25), 25, 2000, 1),
    ],
)
def test_a_disc_in_a_clear_sky_at_any_exposure(place: Place, radius: float, brightness: float, scale: float) -> None:
    best = find_lights(grey(with_disc(SKY, *place, radius, brightness)) * np.float32(scale))[0]
    assert off(best, place, ASPECT) < 0.01 and best.confidence >= ACT and best.kind in ("disc", "glow")


def test_scaling_a_float_picture_changes_nothing() -> None:
    linear = decode_codes(photo("casa-mila.jpg"))
    first, second = find_lights(linear), find_lights(linear * np.float32(64))
    assert first == second == find_lights(linear)


def test_two_suns_are_both_candidates() -> None:
    both = np.maximum(with_disc(SKY, 0.3, 0.25, 9, 3), with_disc(0 * SKY, 0.75, 0.4, 11, 3))
    for picture in (grey(both), to_codes(both)):
        found = find_lights(picture)
        for place in ((0.3, 0.25), (0.75, 0.4)):
            assert any(off(c, place, ASPECT) < 0.01 and c.confidence >= ACT for c in found)


def test_a_low_sun_before_its_reflection() -> None:
    glow = 0.12 + 0.3 * np.exp(-((X - 0.6) ** 2 + (Y - 0.3) ** 2) / 0.06)
    sea = np.where(Y / ASPECT > 0.52, (0.35 + 0.03 * blotches(1.5, 3)) * glow, glow)
    column = np.exp(-(((X - 0.6) / 0.03) ** 2)) * (Y / ASPECT > 0.54) * np.clip(0.6 + 0.5 * blotches(1.5, 7), 0, 1)
    for picture in (grey(with_disc(sea, 0.6, 0.4, 11, 10) + 1.3 * column), to_codes(with_disc(sea, 0.6, 0.4, 11, 1) + 0.9 * column)):
        assert off(find_lights(picture)[0], (0.6, 0.4), ASPECT) < 0.015


@pytest.mark.parametrize("light", [(1.25, 0.2), (-0.2, 0.3), (0.7, 1.3), (0.4, -0.3)])
def test_shading_tells_the_direction_of_a_light_beyond_the_frame(light: Place) -> None:
    squared = (X - light[0]) ** 2 + (Y - light[1] * ASPECT) ** 2 + 0.02
    field = squared.min() / squared
    noisy = np.clip(field + 0.02 * np.random.default_rng(0).normal(size=field.shape), 0, None)
    for picture in (grey(noisy), to_codes(noisy)):
        best = find_lights(picture)[0]
        seen, true = (np.array([(p[0] - 0.5), (p[1] - 0.5) * ASPECT]) for p in (best.position, light))
        angle = np.degrees(np.arccos(seen @ true / np.linalg.norm(seen) / np.linalg.norm(true)))
        assert angle < 15 and best.kind == "beyond" and not best.guess and best.confidence >= ACT


@pytest.mark.parametrize("fading", [0.0, 1.2])
@pytest.mark.parametrize("light", [(0.3, -0.4), (1.3, -0.2)])
def test_beams_meet_at_a_light_beyond_the_frame(light: Place, fading: float) -> None:
    angle, distance = np.arctan2(Y - light[1] * ASPECT, X - light[0]), np.hypot(Y - light[1] * ASPECT, X - light[0])
    beams = 0.15 + sum(0.35 * np.exp(-(((angle - a) / 0.03) ** 2)) for a in np.linspace(angle.min() + 0.1, angle.max() - 0.1, 7))
    noise = 0.02 * np.random.default_rng(0).normal(size=beams.shape)
    best = find_lights(grey(np.clip(beams * np.exp(-fading * distance) + noise, 0, 1)))[0]
    assert off(best, light, ASPECT) < 0.1 and best.kind == "beyond" and not best.guess and best.confidence >= ACT


def test_lamps_at_night() -> None:
    places = [(0.2, 0.5), (0.35, 0.55), (0.55, 0.5), (0.8, 0.6)]
    night = 0.02 + 0.002 * blotches(20, 1)
    for x, y in places:
        squared = (X - x) ** 2 + (Y - y * ASPECT) ** 2
        night += 0.0001 / (squared + 0.0008) + (squared < 0.00006)
    best = find_lights(to_codes(night))[0]
    assert best.kind == "lamps" and ACT <= best.confidence <= 0.75
    assert len(best.lamps) == 4 and all(any(np.hypot(a - x, b - y) < 0.02 for a, b in best.lamps) for x, y in places)


def without_a_light() -> Iterator[tuple[str, np.ndarray]]:
    random = np.random.default_rng(0)
    yield "flat noise", random.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    yield "codes of noise", random.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    for half in (0.03, 0.2):
        square = ((abs(X - 0.4) < half) & (abs(Y - 0.3) < half)) * 1.0
        yield f"a lit square on black, {half}", grey(square)
        yield f"a lit square on nearly black, {half}", to_codes(0.002 + 0.9 * blur(square, 1.2) + 0.0003 * blotches(1, 3))
    yield "a square at the top, on black", grey(((abs(X - 0.4) < 0.05) & (Y < 0.07)) * 1.0)
    for name, plane in (("across", X), ("up", 1 - Y / ASPECT), ("down", Y / ASPECT), ("diagonal", (X + Y) / (1 + ASPECT))):
        yield f"a ramp {name}", np.rint(255 * grey(plane)).astype(np.uint8) if name in ("up", "diagonal") else grey(plane)
    around, distance = np.arctan2(Y - 0.35, X - 0.5), np.hypot(X - 0.5, Y - 0.35)
    dog = blur((distance < 0.14 * (1 + 0.25 * np.sin(3 * around) + 0.15 * np.sin(5 * around))) * 1.0, 2)
    fur = 0.75 + 0.06 * blotches(3, 4) + 0.05 * blotches(1, 5) + 0.7 * (0.35 - Y)
    lawn = 0.1 + 0.03 * blotches(1.5, 6)
    yield "a white dog", to_codes(lawn * (1 - dog) + fur * dog)
    yield "a white dog, overexposed", to_codes(1.8 * (lawn * (1 - dog) + fur * dog))
    yield "a white dog through a dim lens", to_codes((lawn * (1 - dog) + fur * dog) * (1 - 1.7 * ((X - 0.5) ** 2 + (Y - 0.33) ** 2)))
    yield "a white cat in the dark", to_codes(0.2 * lawn * (1 - dog) + fur * dog)
    row = np.floor(Y / 0.035).astype(int)
    column = np.floor((X + 0.04 * (row % 2)) / 0.08).astype(int)
    mortar = (Y % 0.035 < 0.006) | ((X + 0.04 * (row % 2)) % 0.08 < 0.006)
    wall = np.where(mortar, 0.6, 0.3 * random.uniform(0.5, 1, (60, 60))[row, column])
    yield "bricks", to_codes(wall)
    yield "bricks, lit from the left", to_codes(wall * (0.3 + 0.7 * np.exp(-((X - 0.3) ** 2 + (Y - 0.1) ** 2) / 0.3)))
    letters = np.zeros((HEIGHT, WIDTH))
    for top in range(16, 300, 18):
        for left in range(24, 450, 9):
            letters[top : top + 10, left : left + 6] = random.random((10, 6)) > 0.45
    yield "text", to_codes(1 - letters)
    yield "text on black", to_codes(letters)
    stars = np.zeros((HEIGHT, WIDTH))
    stars[random.integers(0, HEIGHT, 120), random.integers(0, WIDTH, 120)] = random.random(120) ** 2
    yield "stars", to_codes(6 * blur(stars, 0.8) + 0.001)
    for radius in (0.06, 0.25):
        x, y = (X - 0.55) / radius, (Y - 0.35) / radius
        ball = np.clip(-0.5 * x - 0.4 * y + 0.75 * np.sqrt(np.maximum(1 - x * x - y * y, 0)), 0, 1) * (x * x + y * y < 1)
        yield f"a planet, {radius}", to_codes(4 * blur(stars, 0.8) + blur(ball * (0.7 + 0.1 * blotches(8, 4)), 1))
    floor = 0.12 + 0.02 * np.sin(120 * Y + 3 * blotches(20, 1)) + 0.012 * blotches(2, 2)
    for slant in (0.5, -0.7):
        patch = blur(((abs(X - 0.45 - slant * (Y - 0.4)) < 0.09) & (abs(Y - 0.4) < 0.1)) * 1.0, 1.5)
        yield f"the sun on a floor, {slant}", to_codes(floor * (1 + 5 * patch))
        yield f"the sun on a dark floor, {slant}", to_codes(0.2 * floor * (1.2 - Y) * (1 + 22 * patch))
    for name, window in (
        ("casa-mila.jpg", (0, 0.62, 1, 1)),
        ("beacon-street-sunset.jpg", (0, 0.55, 0.6, 1)),
        ("dandelions.jpg", (0, 0.5, 1, 1)),
    ):
        yield f"the lower part of {name}", cut(photo(name), *window)[0]


def test_pictures_without_a_light() -> None:
    best = {name: find_lights(image)[:1] for name, image in without_a_light()}
    assert {name: found for name, found in best.items() if found and found[0].confidence >= ACT} == {}


def test_nothing_in_nothing() -> None:
    random = np.random.default_rng(0)
    for image in (
        np.ones((1, 1, 3)),
        random.random((2, 2, 3)),
        random.random((1, 50)),
        np.zeros((30, 40, 3)),
        np.ones((300, 400)),
        np.full((40, 40, 3), np.nan),
        np.full((40, 60), 9000, np.uint16),
    ):
        assert find_lights(image) == [] and find_light(image) is None


def test_every_kind_of_array() -> None:
    codes = photo("beacon-street-sunset.jpg")
    best = find_lights(codes)[0]
    wide = np.dstack([codes, np.full(codes.shape[:2], 255, np.uint8)])
    assert find_lights(wide)[0] == best
    assert off(find_lights(decode_codes(codes))[0], best.position, 0.56) < 0.001
    assert off(find_lights(codes.astype(np.uint16) * 257)[0], best.position, 0.56) < 0.001
    assert find_lights(codes[..., 0])[0].confidence >= ACT
    broken = decode_codes(codes)
    broken[5, 5], broken[6, 6], broken[7, 7] = np.nan, np.inf, -np.inf
    assert off(find_lights(broken)[0], best.position, 0.56) < 0.01


def test_candidates_are_few_ranked_and_apart() -> None:
    for name in SHIPPED[:3]:
        found, aspect = find_lights(photo(name)), photo(name).shape[0] / photo(name).shape[1]
        assert 1 <= len(found) <= 8 and all(0.05 <= c.confidence <= 1 for c in found)
        assert [c.confidence for c in found] == sorted((c.confidence for c in found), reverse=True)
        assert all(off(a, b.position, aspect) >= 0.08 for i, a in enumerate(found) for b in found[:i])
    assert airlight.find_lights is find_lights and airlight.Candidate is Candidate


def test_the_best_is_named_from_the_confidence_that_is_worth_a_question(monkeypatch: pytest.MonkeyPatch) -> None:
    for confidence, named in ((ASK, True), (ASK - 0.01, False)):
        one = Candidate((0.5, 0.5), "disc", confidence)
        monkeypatch.setattr("airlight.detect.ranking.find_lights", lambda image, one=one: [one])
        assert (find_light(np.zeros((9, 9, 3))) == one) is named


def test_candidates_are_drawn_where_they_are() -> None:
    candidates = [
        Candidate((0.3, 0.5), "disc", 0.8),
        Candidate((1.4, 0.5), "beyond", 0.3, guess=True),
        Candidate((0.7, 0.85), "lamps", 0.1, lamps=((0.7, 0.2),)),
    ]
    for ground in (0.0, 1.0):
        codes = draw_candidates(np.full((400, 2000, 3), ground, np.float32), candidates)
        assert codes.shape == (320, 1600, 3) and codes.dtype == np.uint8
        changed = (codes != codes[0, 0]).any(axis=2)
        for x, y in ((480, 160), (1600 - 40, 160), (1120, 272), (1120, 64)):  # the one beyond the frame stands at its border
            assert changed[y - 40 : y + 40, max(0, x - 40) : x + 40].any()
        assert not changed[:, 820:1000].any()
        assert changed.any(axis=0)[500:700].any()  # the text


def test_a_sun_behind_a_post_among_fireflies() -> None:
    """A renderer's hot pixels are no lights; the sun is, though a post crosses it. A photograph's bright pixels stay."""
    y, x = np.indices((270, 480)) + 0.5
    picture = np.repeat((0.1 - 0.08 * y / 270)[..., None], 3, axis=2) * [0.4, 0.65, 1.1]
    picture[np.hypot(x - 202, y - 95) < 29] = 12
    picture[(x % 46 > 10) & (x % 46 < 22)] = 0.004
    plain = picture.astype(np.float32)
    random = np.random.default_rng(3)
    hot = plain.copy()
    hot[random.integers(0, 270, 60), random.integers(0, 480, 60)] = random.uniform(20, 400, 60)[:, None]
    for one in (plain, hot, 1e-3 * hot):
        found = find_lights(one)[0]
        assert found.position == pytest.approx((202 / 480, 95 / 270), abs=0.02) and found.confidence >= ACT
    assert np.array_equal(linear_copy(plain), linear_copy(plain, bounded=True))
    lamps = np.full((90, 120, 3), 0.02, np.float32)
    lamps[[10, 40, 70], [20, 60, 100]] = 1
    assert linear_copy(lamps, bounded=True).max() == 1 and linear_copy(lamps).max() < 0.1
