"""Colour in image files: codes and their curve, dither, profiles, transparency."""

import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import P3, SRGB, codes_like, store
from test_files_reading import DATA

from airlight.colour import encode_codes, srgb_decode
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import encode, read_image, to_linear, write_image
from airlight.files.colour import Profile


def test_table_round_trip():
    for dtype, most in (("uint8", 255), ("uint16", 65535)):
        codes = np.repeat(
            np.arange(most + 1, dtype=dtype).reshape(-1, 64, 1) if most > 255 else np.arange(256, dtype=dtype).reshape(4, 64, 1), 3, 2
        )
        linear, alpha = to_linear(codes)
        assert alpha is None
        np.testing.assert_array_equal(encode_codes(linear, dtype, dither=False), codes)
        np.testing.assert_allclose(linear, srgb_decode(codes / most), atol=1e-7)


def test_dither():
    value = srgb_decode(np.float64(100.3) / 255).astype(np.float32)
    pixels = np.full((256, 300, 3), value, np.float32)
    one, two = encode_codes(pixels, "uint8"), encode_codes(pixels, "uint8")
    np.testing.assert_array_equal(one, two)
    assert set(np.unique(one)) == {100, 101}
    assert abs(one.mean() - 100.3) < 0.01
    assert not np.array_equal(one[..., 0], one[..., 1])
    assert encode_codes(np.zeros((64, 64, 3), np.float32), "uint8").max() == 0
    assert encode_codes(np.full((4, 4, 3), np.nan, np.float32), "uint8").max() == 0


def test_display_p3(tmp_path):
    codes = np.zeros((40, 48, 3), np.uint8)
    codes[:20] = (255, 0, 0)
    codes[20:] = (128, 128, 128)
    picture = read_image(store(tmp_path / "p3.png", codes, ICCProfile=P3))
    assert picture.encoding == "profile"
    linear = picture.linear()
    np.testing.assert_allclose(linear[0, 0], (1.2249, -0.0420, -0.0196), atol=2e-3)
    np.testing.assert_allclose(linear[30, 0], srgb_decode(np.float64(128 / 255)), atol=1e-3)
    write_image(tmp_path / "out.png", linear, picture)
    again = read_image(tmp_path / "out.png")
    assert again.icc == P3
    assert np.abs(again.codes.astype(int) - codes).max() <= 1
    write_image(tmp_path / "out.webp", linear, picture)
    assert read_image(tmp_path / "out.webp").icc == P3


def test_profiles(tmp_path):
    assert Profile(SRGB).is_srgb()
    assert not Profile(P3).is_srgb()
    picture = read_image(store(tmp_path / "s.png", codes_like(), ICCProfile=SRGB))
    assert picture.encoding == "srgb"
    write_image(tmp_path / "s.jpg", picture.linear(), picture)
    assert read_image(tmp_path / "s.jpg").icc == SRGB
    broken = SRGB[:36] + SRGB[36:].replace(b"rXYZ", b"qXYZ")
    with pytest.warns(AirlightWarning, match="taken as sRGB"):
        assert read_image(store(tmp_path / "b.tif", codes_like(), ICCProfile=broken)).encoding == "srgb"


def test_rec2020_and_tiff():
    picture = read_image(DATA / "Nikon-D300-12bit_2020_g1_dt.png")
    assert (picture.encoding, picture.bits) == ("profile", 16)
    grey = picture.codes.astype(float) / 65535 @ (0.2627, 0.678, 0.0593)
    np.testing.assert_allclose(picture.linear() @ np.float32([0.2126, 0.7152, 0.0722]), grey, atol=2e-3)
    assert read_image(DATA / "tiff_16bit_RGB.tiff").codes.dtype == np.uint16


def test_cmyk_says_so(tmp_path):
    with pytest.warns(AirlightWarning, match="CMYK"):
        picture = read_image(DATA / "pil_sample_cmyk.jpg")
    write_image(tmp_path / "out.jpg", picture.linear(), picture)
    assert read_image(tmp_path / "out.jpg").codes.shape == (100, 100, 3)


def test_alpha(tmp_path):
    codes = codes_like("uint8", 4)
    picture = read_image(store(tmp_path / "a.png", codes))
    np.testing.assert_allclose(picture.alpha, codes[..., 3] / 255, atol=1e-7)
    with pytest.warns(AirlightWarning, match="transparency"):
        write_image(tmp_path / "a.jpg", picture.linear(), picture)
    write_image(tmp_path / "a.exr", picture.linear(), picture, bits=32)
    exr = read_image(tmp_path / "a.exr")
    np.testing.assert_allclose(exr.codes[..., :3], picture.linear(), rtol=1e-6)
    straight = srgb_decode(codes[..., :3] / 255)
    np.testing.assert_allclose(picture.linear(), straight * picture.alpha[..., None], rtol=1e-6)
    write_image(tmp_path / "b.png", exr.linear(), exr, bits=8)
    back = read_image(tmp_path / "b.png").codes
    np.testing.assert_array_equal(back[..., 3], codes[..., 3])
    assert np.abs(back.astype(int) - codes).max() <= 1


def test_associated_tiff(tmp_path):
    codes = np.full((8, 8, 4), (64, 32, 0, 128), np.uint8)
    spec = oiio.ImageSpec(8, 8, 4, "uint8")
    out = oiio.ImageOutput.create("tiff")
    out.open(str(tmp_path / "a.tif"), spec)
    out.write_image(codes)
    out.close()
    out.geterror()
    assert tuple(read_image(tmp_path / "a.tif").codes[0, 0]) == (128, 64, 0, 128)


def test_grey_takes_colour(tmp_path):
    picture = read_image(store(tmp_path / "a.png", codes_like("uint8", 1)))
    write_image(tmp_path / "b.png", picture.linear() * 0.5, picture)
    assert read_image(tmp_path / "b.png").codes.shape == (40, 48, 1)
    write_image(tmp_path / "c.png", picture.linear() * np.float32([1, 0.5, 0.2]), picture)
    assert read_image(tmp_path / "c.png").codes.shape == (40, 48, 3)


def test_arrays():
    for shape in ((5, 6), (5, 6, 1), (5, 6, 3), (5, 6, 4)):
        for dtype in (np.uint8, np.uint16, np.float32, np.float64):
            array = codes_like(dtype, 1 if len(shape) == 2 else shape[2], 5, 6).reshape(shape)
            linear, alpha = to_linear(array)
            assert linear.shape == (5, 6, 3) and linear.dtype == np.float32 and linear.flags.c_contiguous
            assert (alpha is not None) == (shape[-1] == 4)
            back = encode(linear, dtype, np.zeros((5, 6), bool), array)
            assert back.dtype == dtype
            np.testing.assert_array_equal(back, array)
    for bad in (np.zeros((0, 4, 3)), np.zeros((4, 4, 2)), np.zeros(4), np.zeros((4, 4, 3), int), np.zeros((4, 4), bool), "picture"):
        with pytest.raises(AirlightError):
            to_linear(bad)


@pytest.mark.parametrize("extension", ["png", "tif", "webp", "exr"])
def test_alpha_that_hides_nothing(tmp_path, extension):
    codes = np.random.default_rng(3).integers(0, 256, (9, 7, 4), np.uint8)
    codes[..., 3] = 255
    picture = read_image(store(tmp_path / "in.png", codes))
    write_image(tmp_path / f"out.{extension}", picture.linear(), like=picture)
    again = read_image(tmp_path / f"out.{extension}")
    assert again.alpha is None or (again.alpha == 1).all()
    assert again.codes.shape[:2] == (9, 7)
