"""Reading image files: orientation, damage, limits, names, masks."""

import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import codes_like, store

from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image, read_mask, write_image
from airlight.files.images import upright

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("extension", [".png", ".jpg", ".tif"])
def test_orientation(tmp_path, orientation, extension):
    shown = np.zeros((32, 64, 3), np.uint8)
    shown[:16, :32] = 255  # white only in the top-left quarter
    shown[:16, 32:] = 128
    inverse = {6: 8, 8: 6}.get(orientation, orientation)
    source = store(tmp_path / f"in{extension}", upright(shown, inverse), Orientation=orientation)
    picture = read_image(source)
    assert (picture.width, picture.height) == (64, 32)
    assert np.abs(picture.codes.astype(int) - shown).max() <= 8
    write_image(tmp_path / f"out{extension}", picture.linear(), picture)
    again = read_image(tmp_path / f"out{extension}")
    assert (again.width, again.height) == (64, 32)
    assert again.spec.get_int_attribute("Orientation", 1) == 1


def test_real_orientation():
    assert read_image(DATA / "hopper_orientation_6.jpg").linear().shape == (128, 128, 3)


@pytest.mark.parametrize("extension", [".png", ".jpg", ".exr", ".tif", ".webp", ".hdr"])
def test_damage(tmp_path, extension):
    source = tmp_path / f"in{extension}"
    write_image(source, codes_like("float32", 3, 200, 200), None)
    whole = source.read_bytes()
    for length in (20, len(whole) // 2, len(whole) * 9 // 10):
        source.write_bytes(whole[:length])
        with pytest.raises(AirlightError) as caught:
            read_image(source)
        assert "\n" not in str(caught.value)
        assert str(source) in str(caught.value)


def test_on_damage(tmp_path):
    source = tmp_path / "in.png"
    write_image(source, np.full((400, 300, 3), 0.5, np.float32) + codes_like("float32", 3, 400, 300), None)
    source.write_bytes(source.read_bytes()[: source.stat().st_size // 2])
    with pytest.warns(AirlightWarning, match="damaged"):
        picture = read_image(source, "warn")
    assert picture.codes.shape == (400, 300, 3)
    assert picture.codes[:50].any()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_image(source, "ignore")
    with pytest.raises(AirlightError, match="on-damage"):
        read_image(source, "perhaps")


def test_not_pictures(tmp_path):
    (tmp_path / "empty.png").touch()
    (tmp_path / "text.png").write_text("no picture")
    os.mkfifo(tmp_path / "pipe.png")
    for name, word in (
        ("empty.png", "empty"),
        ("text.png", "not an image"),
        ("pipe.png", "regular"),
        ("none.png", "No such"),
        ("", "folder"),
    ):
        with pytest.raises(AirlightError, match=word):
            read_image(tmp_path / name)
    with pytest.raises(AirlightError):
        read_image("/dev/zero")


def test_limits(tmp_path, monkeypatch):
    monkeypatch.setattr("airlight.files.decode.MAX_PIXELS", 1000)
    with pytest.raises(AirlightError, match="limit"):
        read_image(store(tmp_path / "a.png", codes_like()))


@pytest.mark.skipif(os.name == "nt", reason="Windows tells no files apart by inode")
def test_stderr_comes_back_after_reading_in_threads(tmp_path):
    write_image(tmp_path / "a.png", np.zeros((40, 40, 3), np.float32))
    before = os.fstat(2)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: read_image(tmp_path / "a.png"), range(200)))
    assert os.path.samestat(before, os.fstat(2))


def test_odd_name(tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff\xfe.png"
    write_image(name, codes_like("float32"), None)
    assert read_image(name).codes.shape == (40, 48, 3)


def test_bad_pixels(tmp_path):
    codes = codes_like("float32")
    codes[5, 7] = np.nan
    codes[20, 0, 1] = np.inf
    with pytest.warns(AirlightWarning, match=r"2 pixels.*x=7, y=5"):
        picture = read_image(store(tmp_path / "a.exr", codes, "half"))
    assert np.isfinite(picture.codes).all()
    np.testing.assert_array_equal(np.delete(picture.codes, (5, 20), 0), np.delete(codes, (5, 20), 0))
    near = np.delete(codes[4:7, 6:9].reshape(9, 3), 4, 0).mean(axis=0)
    np.testing.assert_allclose(picture.codes[5, 7], near, rtol=1e-6)
    codes[:, :4] = np.nan
    with pytest.raises(AirlightError, match="1 %"):
        read_image(store(tmp_path / "b.exr", codes, "half"))


def test_mask(tmp_path):
    codes = codes_like("uint16", 1)
    np.testing.assert_allclose(read_mask(store(tmp_path / "a.png", codes)), codes[..., 0] / 65535, atol=1e-7)
    codes = codes_like()
    np.testing.assert_allclose(read_mask(store(tmp_path / "b.png", codes)), codes / 255 @ (0.2126, 0.7152, 0.0722), atol=1e-6)


def test_errors_that_a_caller_left_are_none_of_ours(tmp_path):
    """OpenImageIO keeps an error of a thread until it is asked for: that of another file says nothing of this one."""
    source = store(tmp_path / "a.png", codes_like())
    assert oiio.ImageInput.open(str(tmp_path / "missing.exr")) is None
    picture = read_image(source)
    assert oiio.ImageInput.open(str(tmp_path / "missing.exr")) is None
    write_image(tmp_path / "b.png", picture.linear(), picture)
    np.testing.assert_array_equal(read_image(tmp_path / "b.png").codes, picture.codes)
