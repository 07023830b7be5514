"""Cookies of lights of the image plane: a factor over the angle around the light, in every method and look."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calling import call
from PIL import Image

import airlight
from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image
from airlight.jobs.tasks import picture_tasks
from airlight.lights.around import ANGLES, ENTRIES, around_table, wedges
from airlight.lights.shape import Cookie
from airlight.options import Look
from airlight.pictures import render_look
from airlight.reference import fallback, radial
from airlight.reference.around import around_at, around_factor, around_light, around_span
from airlight.scatter.methods import of_screen

RNG = np.random.default_rng(19)
SIZE = (56, 40)
PICTURE = RNG.random((SIZE[1], SIZE[0], 3)).astype(np.float32) ** 6 * 3
COOKIE = Cookie(RNG.random((24, 30, 3)))
WHITE = np.ones((3, 5, 3), np.float32)
UP, RIGHT, DOWN, LEFT = (0, -9), (9, 0), (0, 9), (-9, 0)


def factor(cookie: Cookie, d: Any) -> Any:
    """The factor at a place (..., 2), pixels from the light."""
    table = around_table(cookie)
    assert table is not None
    return around_factor(table, around_span(np.asarray(d, float)))


def quarters() -> Cookie:
    """Black below, red above on the left, blue above on the right."""
    pixels = np.zeros((64, 64, 3))
    pixels[:32, :32] = (1, 0, 0)
    pixels[:32, 32:] = (0, 0, 1)
    return Cookie(pixels)


def test_the_cookie_lies_upon_the_light_as_it_is_seen() -> None:
    near = [(-900, -900), (900, -900), (900, 900), (-900, 900)]
    np.testing.assert_allclose(factor(quarters(), near), [(1, 0, 0), (0, 0, 1), (0, 0, 0), (0, 0, 0)], atol=1e-3)
    np.testing.assert_allclose(factor(quarters(), (0, -900)), (0.5, 0, 0.5), atol=0.02)
    wide = Cookie(np.pad(quarters().pixels, ((0, 0), (50, 50), (0, 0)), constant_values=7))  # of which the circle in the middle counts
    np.testing.assert_allclose(wedges(wide, 64)[4:60], wedges(quarters(), 64)[4:60], atol=1e-6)


def test_a_wedge_has_its_mean() -> None:
    """A disc within the circle: each wedge holds the square of its radius's share."""
    y, x = np.mgrid[:200, :200] - 99.5
    found = wedges(Cookie(np.repeat((np.hypot(x, y) < 60)[..., None], 3, axis=2).astype(float)), 100)
    np.testing.assert_allclose(found, 0.36, atol=0.01)


def test_a_pixel_near_the_light_has_the_mean_of_what_it_covers() -> None:
    """A fan of 200 blades: far away each is as it is, near the light all are grey, and there is nothing in between but a fall."""
    turn = (np.arange(ANGLES) + 0.5) / ANGLES
    fan = Cookie(np.ones((2, 2, 3)))
    table = np.zeros((ENTRIES, 4), np.float32)
    level = np.repeat((turn * 200 % 1 < 0.5)[:, None], 3, axis=1).astype(float)
    for at in (ANGLES >> k for k in range(13)):
        table[2 * ANGLES - 2 * at : 2 * ANGLES - at, :3] = level.reshape(at, -1, 3).mean(axis=1)
    deviations = []
    for radius in (3000.0, 200.0, 60.0, 15.0, 2.0, 0.0):
        d = radius * np.stack([np.sin(2 * math.pi * turn), -np.cos(2 * math.pi * turn)], axis=-1)
        found = around_factor(table, around_span(d))
        assert abs(found.mean() - 0.5) < 1e-3
        deviations.append(round(float(found.std()), 2))
    assert deviations == sorted(deviations, reverse=True) and deviations[0] > 0.45 and deviations[3] < 0.05, deviations
    np.testing.assert_allclose(factor(COOKIE, (0.0, 0.0)), wedges(COOKIE).mean(axis=0), atol=1e-6)
    assert around_table(fan) is None


def test_shaders_agree_with_their_twins() -> None:
    d = np.concatenate([RNG.normal(size=(200, 2)) * 10 ** RNG.uniform(-3, 6, (200, 1)), [(0, 0), UP, RIGHT, DOWN, LEFT]]).astype("f4")
    span = call("scatter/around.wgsl", "around_span", [d])
    off = np.abs(span - around_span(d.astype(float)))
    assert np.minimum(off[:, 0], 1 - off[:, 0])[:-5].max() < 1e-6 and off[:, 1].max() < 1e-6
    np.testing.assert_allclose(span[-4:, 0], [0, 0.25, 0.5, 0.75], atol=1e-6)
    table = around_table(COOKIE)
    assert table is not None
    found = call("scatter/around.wgsl", "around_factor", [span], bindings={"around": table})
    np.testing.assert_allclose(found, around_factor(table, span.astype(float)), atol=1e-3)
    levels = np.arange(len(span)) % 13
    found = call("scatter/around.wgsl", "around_at", [levels.astype("u4"), span[:, 0]], bindings={"around": table})
    np.testing.assert_allclose(found, around_at(table, levels, span[:, 0].astype(float)), atol=1e-3)
    ones = np.ones_like(table)  # what is alike everywhere stays so, to the last bit
    assert (call("scatter/around.wgsl", "around_factor", [span], bindings={"around": ones}) == 1).all()


@pytest.mark.parametrize("method", of_screen())
def test_each_method_is_multiplied(method: str) -> None:
    lights = [airlight.Light((0.4, 0.3), strength=0.5), airlight.Light((0.9, 1.3), color=(1, 0.5, 0.2), cookie=quarters())]
    plain, each = (airlight.light_shafts(PICTURE, lights[0], method=method, cookie=c) for c in (None, COOKIE))
    places = [(x * SIZE[0], y * SIZE[1]) for x, y in (light.position for light in lights)]
    factors = [around_light(around_table(c), SIZE, at) for c, at in zip((COOKIE, quarters()), places, strict=True)]
    close: Any = {"atol": 1e-3 * plain.max()}
    np.testing.assert_allclose(each, plain * factors[0], **close)
    other = airlight.light_shafts(PICTURE, airlight.Light((0.9, 1.3), color=(1, 0.5, 0.2)), method=method)
    both = airlight.light_shafts(PICTURE, lights, method=method, cookie=COOKIE)  # the second has its own
    np.testing.assert_allclose(both, plain * factors[0] + other * factors[1], **close)
    np.testing.assert_array_equal(airlight.light_shafts(PICTURE, lights[0], method=method, cookie=WHITE), plain)


def test_references_are_multiplied() -> None:
    light, p = airlight.Light((0.3, 0.6), cookie=COOKIE), airlight.Parameters(method="radial", samples=20)
    plain, shared = airlight.Light((0.3, 0.6)), around_light(around_table(COOKIE), SIZE, (0.3 * SIZE[0], 0.6 * SIZE[1]))
    for sums in (radial.layer, fallback.layer):
        np.testing.assert_allclose(sums(PICTURE, [light], p), sums(PICTURE, [plain], p) * shared, rtol=1e-5, atol=1e-6)


def look_of(**more: Any) -> Any:
    """A picture with a window and bars, with the smart look on it."""
    codes = np.full((90, 120, 3), 30, np.uint8)
    codes[20:50, 40:80:8], codes[20:50, 42:80:8] = 255, 230
    return codes, airlight.add_light_shafts(codes, (0.5, 0.4), strength=2.0, **more)


def test_the_smart_look_is_multiplied() -> None:
    codes, plain = look_of()
    np.testing.assert_array_equal(look_of(cookie=WHITE)[1], plain)
    shaped = look_of(cookie=quarters())[1]
    below = shaped[40:] != codes[40:]  # nothing shines there, and nothing is taken, but where the cookie's pixels meet
    assert below.mean() < 1e-3
    change = shaped[:34].astype(int) - codes[:34]
    assert (plain[40:] != codes[40:]).mean() > 0.2
    left, right = change[:, :56], change[:, 64:]
    assert left[..., 0].sum() > 2 * left[..., 2].sum() and right[..., 2].sum() > 2 * right[..., 0].sum()


def test_the_smart_look_agrees_with_its_twin(monkeypatch: pytest.MonkeyPatch) -> None:
    shaped = look_of(cookie=COOKIE)[1]
    monkeypatch.setattr("airlight.api.open_renderer", lambda device: None)
    assert np.abs(look_of(cookie=COOKIE)[1].astype(int) - shaped).max() <= 2


def test_views_and_fractions_know_no_cookie() -> None:
    light = airlight.Light((0.4, 0.3), cookie=COOKIE)
    one, other = (airlight.occlusion_fraction(PICTURE, at, occlusion="luminance") for at in (light, (0.4, 0.3)))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("cookie", "told"),
    [
        ("gobo.png", "give airlight.read_cookie of the file"),
        (np.zeros((0, 4, 3), np.float32), "no pixels"),
        (np.zeros((4, 4, 2), np.float32), "of shape"),
        (Cookie(np.full((2, 2, 3), math.nan)), "finite and 0 or more"),
    ],
)
def test_what_is_no_cookie_is_refused(cookie: Any, told: str) -> None:
    with pytest.raises(AirlightError, match=told):
        airlight.light_shafts(PICTURE, (0.5, 0.5), cookie=cookie)
    with pytest.raises(AirlightError, match="parallel light has no angles around it"):
        airlight.Light.parallel(30.0).__class__((0.0, 0.0), angle=30.0, cookie=COOKIE)


def test_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """--cookie, that of one light, settings taken up again, a film of frames; and what is refused, in a line."""
    photo, gobo, out = (str(tmp_path / name) for name in ("photo.png", "gobo.png", "out.png"))
    Image.fromarray(np.clip(PICTURE * 255, 0, 255).astype(np.uint8)).save(photo)
    Image.fromarray(np.rint(quarters().pixels * 255).astype(np.uint8)).save(gobo)
    classic = ["--look", "classic", "--threshold", "0.5", "-y"]

    def made(*more: str) -> Any:
        assert main(["image", photo, "-o", out, *classic, *more]) == 0
        return np.asarray(Image.open(out)).astype(int)

    plain, shaped = made("--light", "0.4,0.3"), made("--light", "0.4,0.3", "--cookie", gobo)
    np.testing.assert_array_equal(made("--settings-from", out), shaped)
    np.testing.assert_array_equal(made("--light", f"0.4,0.3;cookie={gobo}"), shaped)
    np.testing.assert_array_equal(made("--settings-from", out), shaped)
    assert (plain[20:] - shaped[20:]).mean() > 1 and (plain[:8, :15] - shaped[:8, :15]).mean(axis=(0, 1)).argmin() == 0  # red is left
    capfd.readouterr()
    for more, says in (
        (["--light", "0.4,0.3", "--cookie", "none.png"], "none.png: cannot be read"),
        (["--light", "0.4,0.3;cookie=none.png"], "none.png: cannot be read"),
        (["--angle", "30", "--cookie", gobo], "a parallel one of --angle has no place"),
        (["--angle", f"30;cookie={gobo}"], "cannot read 'cookie="),
        (["--light", "0.4,0.3", "--cookie", str(tmp_path / "gobo.####.png")], "no files of that pattern"),
    ):
        assert main(["image", photo, "-o", str(tmp_path / "none.png"), *classic, *more]) == 2
        error = capfd.readouterr().err
        assert says in error and error.count("\n") == 1, error
    assert not (tmp_path / "none.png").exists()


def test_frames_of_pictures_have_those_of_a_film(tmp_path: Path) -> None:
    for name in ("a.0001.png", "a.0002.png", "a.0005.png", "gobo.0001.png", "gobo.0004.png"):
        Image.new("RGB", (2, 2)).save(tmp_path / name)

    def cookies(source: str, cookie: str) -> list[str]:
        places = source, str(tmp_path / "o.####.png" if "#" in source else tmp_path / "o.png")
        found, _ = picture_tasks([str(tmp_path / places[0])], places[1], *[None] * 6, cookie=str(tmp_path / cookie))
        return [Path(str(task.cookie)).name for task in found]

    with pytest.warns(AirlightWarning, match="has no frame 2; frames that are missing look as those before them"):
        assert cookies("a.####.png", "gobo.####.png") == ["gobo.0001.png", "gobo.0001.png", "gobo.0004.png"]
    assert cookies("a.####.png", "gobo.0004.png") == ["gobo.0004.png"] * 3
    assert cookies("a.0005.png", "gobo.0004.png") == ["gobo.0004.png"]


def test_frames_keep_all_of_a_look_but_its_cookie(tmp_path: Path) -> None:
    Image.fromarray(look_of()[0]).save(tmp_path / "frame.png")
    picture = read_image(str(tmp_path / "frame.png"))
    plain, shaped = ([airlight.Light((0.5, 0.4), cookie=cookie)] for cookie in (None, quarters()))
    first = render_look(picture, plain, Look(), codes_only=True)
    second = render_look(picture, shaped, Look(), codes_only=True, held=first.held)
    np.testing.assert_array_equal(second.encoded, render_look(picture, shaped, Look(), codes_only=True).encoded)
    again = render_look(picture, plain, Look(), codes_only=True, held=second.held)
    np.testing.assert_array_equal(again.encoded, first.encoded)
    assert (first.encoded != second.encoded).any()
