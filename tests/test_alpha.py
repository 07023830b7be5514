"""Premultiplied light at small or zero alpha survives every format, and what is transparent is seen as black."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

import airlight
from airlight.alpha import straight_codes, straighten
from airlight.cli import main
from airlight.colour import encode_codes, srgb_decode, srgb_encode
from airlight.files import read_image, read_mask, write_image

SIZE = (54, 96)
NOTHING = "0.35,0.4;strength=0"
FORMATS = {"png": 0.5, "tif": 0.5, "webp": 1.0, "hdr": 1.5, "exr": 0.01}  # codes of 8 bits by which light may be off


def stored(path: Path, pixels: np.ndarray, kind: str = "half", associated: bool = True) -> Path:
    """Write (H, W, C) as they are."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if not associated:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(path.suffix.lstrip("."))
    assert out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels)) and out.close()
    return path


def glow() -> np.ndarray:
    """Draw what a renderer gives of a flame and a pane of glass before nothing: a glow of alpha 0, a lamp above white, a pane whose
    light passes its alpha, posts: (H, W, 4) premultiplied."""
    y, x = np.indices(SIZE) + 0.5
    r = np.hypot(x - 34, y - 22)
    pixels = np.zeros((*SIZE, 4), np.float32)
    pixels[..., :3] = 0.35 * np.exp(-((r / 18) ** 2))[..., None] * np.float32([1, 0.7, 0.35])
    pixels[20:46, 52:70] = (0.012, 0.014, 0.018, 0.01)
    pixels[r < 4] = (14, 10, 5, 1)
    pixels[:, 22:25] = pixels[:, 44:48] = (0.02, 0.02, 0.02, 1)
    return pixels.astype(np.float16).astype(np.float32)


def codes_of(light: np.ndarray) -> np.ndarray:
    return 255 * srgb_encode(np.clip(light, 0, 1))


def run(*arguments: object) -> None:
    assert main(["image", *(str(one) for one in arguments), "-y"]) == 0


def over_black(path: Path) -> np.ndarray:
    """Read what a file shows over black, by OpenImageIO alone: linear (H, W, 3)."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(path), hints)
    spec = file.spec()
    pixels = file.read_image(0, 0, 0, spec.nchannels, "float")
    colour = pixels[..., :3]
    if spec.format.basetype not in (oiio.FLOAT, oiio.HALF):
        colour = srgb_decode(colour)
        if spec.nchannels == 4:
            colour = colour * pixels[..., 3:]
    return np.asarray(colour)


@pytest.mark.parametrize("look", ["smart", "classic"])
@pytest.mark.parametrize("extension", FORMATS)
def test_light_that_hides_nothing_is_kept(tmp_path: Path, extension: str, look: str, capsys: pytest.CaptureFixture[str]) -> None:
    source = stored(tmp_path / "in.exr", glow())
    target = tmp_path / f"out.{extension}"
    run(source, "-o", target, "--light", NOTHING, "--look", look)
    off = np.abs(codes_of(over_black(target)) - codes_of(glow()[..., :3]))
    assert off.max() < FORMATS[extension]
    made = read_image(target)
    if made.alpha is None:
        assert extension == "hdr" and "put on black" in capsys.readouterr().err
        return
    needed = np.clip(glow()[..., :3].max(axis=2), 0, 1)
    least = glow()[..., 3] if extension == "exr" else np.maximum(glow()[..., 3], needed)
    np.testing.assert_allclose(made.alpha, least, rtol=2e-3, atol=1.01 / (65535 if made.bits == 16 else 255))  # just enough


def test_a_jpeg_holds_light_over_black(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(stored(tmp_path / "in.exr", glow()), "-o", tmp_path / "out.jpg", "--light", NOTHING)
    assert "put on black" in capsys.readouterr().err
    codes = codes_of(read_image(tmp_path / "out.jpg").linear())
    truth = codes_of(glow()[..., :3])
    flat = np.s_[24:42, 56:66]  # the pane; edges are JPEG's own
    assert np.median(np.abs(codes[flat] - truth[flat])) <= 1 and np.abs(codes[flat] - truth[flat]).max() <= 4
    assert np.abs(codes - truth).mean() < 1


def test_a_straight_picture_is_put_on_black(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    codes = np.random.default_rng(1).integers(0, 256, (24, 40, 4), np.uint8)
    source = stored(tmp_path / "in.png", codes, "uint8", False)
    run(source, "-o", tmp_path / "out.hdr", "--light", NOTHING)
    assert "put on black" in capsys.readouterr().err
    truth = srgb_decode(codes[..., :3] / 255) * (codes[..., 3:] / 255)
    off = np.abs(read_image(tmp_path / "out.hdr").linear() - truth)
    assert (off <= truth.max(axis=2, keepdims=True) / 127).all()  # one exponent for three
    run(source, "-o", tmp_path / "same.png", "--light", NOTHING)
    assert np.array_equal(read_image(tmp_path / "same.png").codes, codes)


def text() -> np.ndarray:
    """Draw letters on transparency, which has the letters' colour: (H, W, 4) uint8, straight."""
    codes = np.zeros((*SIZE, 4), np.uint8)
    codes[..., :3] = (255, 230, 178)
    for x in (26, 36, 44, 54, 64):
        codes[22:32, x : x + 5, 3] = 255
    codes[25:28, 37:40, 3] = 90
    return codes


@pytest.mark.parametrize("extension", ["png", "tif", "webp", "jpg", "exr"])
def test_letters_cast_shafts_as_their_premultiplied_exr(tmp_path: Path, extension: str) -> None:
    straight = stored(tmp_path / "in.png", text(), "uint8", False)
    light = srgb_decode(text()[..., :3] / 255) * (text()[..., 3:] / 255)
    exr = stored(tmp_path / "in.exr", np.concatenate([light, text()[..., 3:] / 255], axis=2).astype(np.float32), "half")
    options = ["--light", "0.5,0.5", "--threshold", "0.5", "--smoothness", "0.2"]
    for source, name in ((straight, "a"), (exr, "b")):
        run(source, "-o", tmp_path / f"{name}.{extension}", *options)
    a, b = (codes_of(over_black(tmp_path / f"{name}.{extension}")) for name in "ab")
    outside = text()[..., 3] == 0
    assert a[outside].max() > 60  # rays
    assert np.abs(a - b)[outside].mean() < 0.5 and np.abs(a - b).max() < (20 if extension == "jpg" else 3)


def test_alpha_of_floats(tmp_path: Path) -> None:
    """TIFFs of floats, premultiplied and not: light of alpha 0 is kept in both."""
    run(stored(tmp_path / "in.tif", glow(), "float"), "-o", tmp_path / "a.tif", "--light", NOTHING)
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif").codes, glow())
    straight = glow()
    straight[..., :3] /= np.maximum(straight[..., 3:], 0.01)
    source = stored(tmp_path / "s.tif", straight, "float", False)
    np.testing.assert_allclose(read_image(source).linear(), straight[..., :3] * straight[..., 3:])
    run(source, "-o", tmp_path / "b.exr", "--light", NOTHING)
    np.testing.assert_allclose(read_image(tmp_path / "b.exr").codes[..., :3], straight[..., :3] * straight[..., 3:], rtol=1e-3, atol=1e-7)
    run(source, "-o", tmp_path / "b.tif", "--light", "0.35,0.4", "--threshold", "0.5")
    run(source, "-o", tmp_path / "c.exr", "--light", "0.35,0.4", "--threshold", "0.5")
    one, two = read_image(tmp_path / "b.tif").linear(), read_image(tmp_path / "c.exr").linear()
    np.testing.assert_allclose(one, two, rtol=1e-3, atol=1e-5)


def test_premultiplied_codes() -> None:
    """Light of alpha 0 is its code; light that alpha holds is divided by it; what lies between goes from one to the other."""
    codes = np.zeros((1, 256, 4), np.uint16)
    codes[..., :3] = 40000
    codes[0, :, 3] = np.linspace(0, 65535, 256)
    made = straight_codes(codes)
    light = srgb_decode(made[..., :3] / 65535)[0, :, 0] * made[0, :, 3] / 65535
    assert abs(light[0] - srgb_decode(np.array(40000 / 65535))) < 1e-4
    assert np.abs(np.diff(light)).max() < 0.01
    fine = codes[0, :, 3] > 40000
    assert np.array_equal(made[0, fine, 3], codes[0, fine, 3])
    np.testing.assert_allclose(made[0, fine, 0] / 65535, 40000 / codes[0, fine, 3], atol=1e-4)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_straight_colours_and_alpha_give_the_light(dtype: type) -> None:
    random = np.random.default_rng(2)
    light = (random.random((80, 60, 3)) ** 4).astype(np.float32)
    alpha = (random.random((80, 60)) ** 3 * np.iinfo(dtype).max).astype(dtype)
    straight, raised = straighten(light, alpha)
    assert straight.max() < 1.03 and (raised >= alpha).all()
    share = raised / np.iinfo(dtype).max
    np.testing.assert_allclose(straight * share[..., None], light, atol=1e-7)
    assert (share <= np.maximum(alpha / np.iinfo(dtype).max, light.max(axis=2) + 1 / np.iinfo(dtype).max)).all()


def test_arrays(tmp_path: Path) -> None:
    """Codes with alpha are straight, floats premultiplied; alpha of codes rises where shafts fall on nothing."""
    options = {"threshold": 0.5, "smoothness": 0.2, "blend": "add", "veil": 0.0, "mix": 1.0}
    codes = airlight.add_light_shafts(text(), (0.5, 0.5), **options)
    light = (srgb_decode(text()[..., :3] / 255) * (text()[..., 3:] / 255)).astype(np.float32)
    floats = np.concatenate([light, text()[..., 3:].astype(np.float32) / 255], axis=2)
    made = airlight.add_light_shafts(floats, (0.5, 0.5), **options)
    np.testing.assert_array_equal(made[..., 3], floats[..., 3])
    seen = srgb_decode(codes[..., :3] / 255) * (codes[..., 3:] / 255)
    assert codes_of(seen)[text()[..., 3] == 0].max() > 60
    assert np.abs(codes_of(seen) - codes_of(made[..., :3])).max() < 3
    unlit = airlight.add_light_shafts(text(), (0.5, 0.5), **options, exposure=0.0)
    assert np.array_equal(unlit, text())


def test_a_mask_is_seen_over_black(tmp_path: Path) -> None:
    codes = np.full((8, 12, 4), 255, np.uint8)
    codes[:, 6:, 3] = 0
    source = stored(tmp_path / "mask.png", codes, "uint8", False)
    np.testing.assert_array_equal(read_mask(source), np.repeat([[1.0] * 6 + [0.0] * 6], 8, axis=0))
    assert read_mask(source, depth=True).min() == 1


def test_a_picture_that_is_transparent_all_over(tmp_path: Path) -> None:
    codes = np.random.default_rng(4).integers(0, 256, (8, 12, 4), np.uint8)
    codes[..., 3] = 0
    with pytest.warns(airlight.AirlightWarning, match="transparent all over"):
        picture = read_image(stored(tmp_path / "in.png", codes, "uint8", False))
    assert picture.alpha is None and np.array_equal(picture.codes, codes[..., :3])


def test_what_airlight_shows_of_light_is_dithered_alike(tmp_path: Path) -> None:
    """Alpha of 1 everywhere changes nothing of how a picture is written."""
    light = np.random.default_rng(5).random((20, 30, 3)).astype(np.float32)
    write_image(tmp_path / "a.png", light, alpha=np.ones((20, 30), np.float32))
    assert np.array_equal(read_image(tmp_path / "a.png").codes[..., :3], encode_codes(light, np.uint8))
