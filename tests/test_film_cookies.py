"""Cookies of films: numbered files, of which a light sends out the one of the frame."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs.cookies import MOST, FilmCookie, open_cookie, read_cookie
from airlight.lights.shape import Cookie

pytest.importorskip("pygfx")
from PIL import Image

from airlight import files
from airlight.api import Renderer
from airlight.gpu.device import Device, shared_device
from airlight.jobs.shape_text import shaped
from airlight.lights.around import around_table
from airlight.lights.spot import SpotLight
from airlight.options import March, Medium, Parameters
from airlight.pygfx import SceneLight
from airlight.pygfx.screen_effect import PictureSums
from airlight.reference.around import around_light
from airlight.scatter.march.cookies import Cookies, even_colour
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot, Studio

TINT = np.array([1.0, 0.0, 0.2])  # of the second frame, codes


@pytest.fixture
def film(tmp_path: Path) -> str:
    """Write frames 1, 2 and 4: columns of light, the same ones tinted, and white."""
    columns = np.full((16, 16, 3), 255.0)
    columns[:, ::4] = 0
    for number, codes in ((1, columns), (2, columns * TINT), (4, np.full((16, 16, 3), 255.0))):
        Image.fromarray(np.rint(codes).astype(np.uint8)).save(tmp_path / f"film.{number:03d}.png")
    return str(tmp_path / "film.###.png")


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Collect the names of the files that are read."""
    names: list[str] = []
    original = files.read_image
    monkeypatch.setattr(files, "read_image", lambda path, *more, **named: names.append(path) or original(path, *more, **named))
    return names


def numbers(names: list[str]) -> list[int]:
    return [int(name.split(".")[-2]) for name in names]


def test_a_file_is_read_when_its_frame_comes_and_once(film: str, read: list[str]) -> None:
    cookie = open_cookie(film, 2.0)
    assert isinstance(cookie, FilmCookie) and cookie.size == 2.0 and read == []
    seen = []
    for frame in (1, 1, 2):
        cookie.frame = frame
        seen.append((cookie.pixels.mean(axis=(0, 1)), cookie.revision))
    assert numbers(read) == [1, 2] and [revision for _, revision in seen] == [1, 1, 2]
    np.testing.assert_allclose(seen[2][0] / seen[0][0], read_cookie(film, 2).pixels[1, 1], rtol=1e-5)
    assert type(open_cookie(film.replace("###", "001"))) is Cookie


def test_a_missing_frame_is_that_before_it(film: str, read: list[str], recwarn: Any) -> None:
    cookie = FilmCookie(film)
    for frame in (3, 2, 4, 9, -5):  # 3 is missing; 9 is after the last, -5 before the first
        cookie.frame = frame
        assert cookie.pixels.shape == (16, 16, 3)
    assert numbers(read) == [2, 4, 1]
    assert [str(one.message).partition(": ")[2] for one in recwarn] == [
        f"has no frame 3; frames that are missing look as those before them, here as {film.replace('###', '002')}"
    ]
    with pytest.raises(AirlightError, match="no files of that pattern"):
        open_cookie(film.replace("film", "flim"))


def test_a_long_row_is_averaged(tmp_path: Path) -> None:
    Image.new("RGB", (3 * MOST - 5, 1), (255, 0, 0)).save(tmp_path / "row.png")
    with pytest.warns(AirlightWarning, match="averaged to"):
        found = read_cookie(str(tmp_path / "row.png"))
    np.testing.assert_allclose(found.pixels, np.broadcast_to([1.0, 0.0, 0.0], (1, MOST - 2, 3)), atol=1e-6)


def test_frames_of_one_size_share_a_texture(film: str, tmp_path: Path) -> None:
    device: Device = shared_device()
    Image.fromarray(np.arange(192, dtype=np.uint8).reshape(8, 8, 3)).save(tmp_path / "film.006.png")
    held, cookie = Cookies(device), FilmCookie(film)
    light, found = SpotLight((1.0, 1.0, 1.0), cookie=cookie), {}
    for frame in (1, 2, 6):
        cookie.frame = frame
        assert even_colour(light) is None
        found[frame] = held.of(light)[0]
    assert found[1] is found[2] is not found[6]
    cookie.frame = 4
    np.testing.assert_array_equal(even_colour(light), [1.0, 1.0, 1.0])


def test_a_projector_shows_the_film_as_time_goes(film: str, read: list[str]) -> None:
    """The second frame is the first tinted, and so is the light in the air; each file is read once, in the order of frames."""
    stage = open_scene("slats")
    stage.lights = []
    text = f"0,1.4,3;target=0,1.4,-1;fov=50,40;intensity=300,300,300;near=0.05;cookie={film}"
    requested = shaped(stage, {"projector": [text]}, fps=10.0)
    assert stage.cookies == [requested[0].cookie] and read == []
    studio = Studio(stage, Shot(48, 32, 1, lights=tuple(requested)), Parameters(method="march"), medium=Medium(), march=March(steps=8))
    layers = [studio.frame(time, layer=True).shafts() for time in (0.0, 0.1)]
    factor = read_cookie(film, 2).pixels[1, 1]
    np.testing.assert_allclose(layers[1], layers[0] * factor, rtol=2e-3, atol=2e-3 * layers[0].max())
    assert layers[0].max() > 0 and numbers(read) == [1, 2, 2]
    studio.frame(0.11)
    assert len(read) == 3


def test_a_renderer_follows_a_film(film: str) -> None:
    cookie, renderer = FilmCookie(film), Renderer(keep=2)
    image, found = np.random.default_rng(2).random((24, 32, 3)).astype(np.float32), {}
    for cookie.frame in (4, 1):
        found[cookie.frame] = renderer.light_shafts(image, (0.4, 0.6), method="radial", cookie=cookie)
    shape = around_light(around_table(cookie), (32, 24), (0.4 * 32, 0.6 * 24))
    np.testing.assert_allclose(found[1], found[4] * shape, rtol=3e-3, atol=1e-3)


def test_sums_of_the_picture_follow_a_film(film: str) -> None:
    """A light of a scene that stands still is planned anew where its cookie's frame is another, and not else."""
    cookie = FilmCookie(film)
    light = SceneLight(direction=(0.0, 0.0, 1.0), cookie=cookie).seen((0.4, 0.6))
    device, p = shared_device(), Parameters(method="radial", samples=8)
    source = device.texture(32, 24, "rgba16float")
    device.write(source, np.random.default_rng(1).random((24, 32, 4)).astype(np.float16), 32 * 8)
    sums, layers, planned = PictureSums(device, source, p, 0), {}, []
    update = sums.plans.update
    sums.plans.update = lambda *some: planned.append(cookie.frame) or update(*some)  # type: ignore[method-assign]
    for frame in (1, 1, 2, 4):
        cookie.frame = frame
        encoder = device.encoder()
        sums.record(encoder, [light], p, None)
        device.submit(encoder)
        layers[frame] = np.frombuffer(device.read(sums.shafts, 8), np.float16).reshape(24, 32, 4)[..., :3].astype(float)
    assert planned == [1, 2, 4] and layers[4].min() > 0
    for frame in (1, 2):  # of the fourth, which is white
        cookie.frame = frame
        shape = around_light(around_table(cookie), (32, 24), (0.4 * 32, 0.6 * 24))
        np.testing.assert_allclose(layers[frame], layers[4] * shape, rtol=3e-3, atol=1e-3)
