"""Formats of film and the web, in and out: DPX, JPEG XL, AVIF; how outputs are packed; files that hold several pictures."""

import struct

import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import NOTHING, P3, bmp_of_runs, codes_like, store

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image, read_settings, write_image
from airlight.files.storage import jpeg_quality
from airlight.options.storage import Storage

ALL = ~NOTHING
PAST = ["--light", "0.5,0.5;strength=0", "-y"]  # light that adds nothing


def spread(few, bits):
    """Spread codes of so many bits over 16, as OpenImageIO does."""
    few = np.asarray(few)
    return ((few << (16 - bits)) | (few >> (2 * bits - 16))).astype(np.uint16)


def dpx(path, few, transfer, bits=10, **attributes):
    return store(path, spread(few, bits), dpx__Transfer=transfer, oiio__BitsPerSample=bits, **attributes)


def test_film_codes_are_linear_light(tmp_path):
    """Printing density: black 95, white 685, 0.002 density a code, gamma 0.6; grey of 18 % is at 445 to 470 by the makers' aims."""
    few = np.repeat(np.array([95, 470, 685, 1023])[None, :, None], 3, axis=2)
    picture = read_image(dpx(tmp_path / "a.dpx", few, "Printing density"))
    black = 10 ** ((95 - 685) * 0.002 / 0.6)
    expected = (10 ** ((few - 685) * 0.002 / 0.6) - black) / (1 - black)
    np.testing.assert_allclose(picture.linear(), expected, rtol=1e-3, atol=1e-4)
    assert picture.linear()[0, 2, 0] == pytest.approx(1, abs=1e-3) and picture.linear()[0, 3, 0] == pytest.approx(13.52, abs=0.01)


def test_transfers(tmp_path):
    few = np.full((8, 8, 3), 512)
    value = 512 / 1023
    cases = {"Linear": value, "ITU-R 709-4": ((value + 0.099) / 1.099) ** (1 / 0.45)}
    cases["Logarithmic"] = (10 ** ((512 - 685) / 300) - 0.0107978) / 0.9892022
    for transfer, expected in cases.items():
        assert read_image(dpx(tmp_path / "a.dpx", few, transfer)).linear()[0, 0, 0] == pytest.approx(expected, rel=1e-3), transfer
    path = dpx(tmp_path / "a.dpx", few, "Undefined")
    with pytest.warns(AirlightWarning, match="does not say.*cineon.*--colorspace"):
        assert read_image(path).linear()[0, 0, 0] == pytest.approx(cases["Logarithmic"], rel=1e-3)
    assert read_image(path, colorspace="rec709").linear()[0, 0, 0] == pytest.approx(cases["ITU-R 709-4"], rel=1e-3)
    with pytest.raises(AirlightError, match="cineon, rec709 or linear"):
        read_image(path, colorspace="ACEScg")
    with pytest.warns(AirlightWarning, match="FFmpeg"):
        picture = read_image(dpx(tmp_path / "a.dpx", few, "Linear", Software="Lavc61.3"))
    assert picture.linear()[0, 0, 0] == pytest.approx(cases["ITU-R 709-4"], rel=1e-3)


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
@pytest.mark.parametrize("transfer", ["Printing density", "Linear", "ITU-R 709-4"])
def test_dpx_keeps_its_codes_and_header(tmp_path, bits, transfer):
    codes = codes_like("uint16" if bits > 8 else "uint8")
    source = store(tmp_path / "a.dpx", codes, dpx__Transfer=transfer, oiio__BitsPerSample=bits, oiio__Endian="big", dpx__FrameRate=25.0)
    picture = read_image(source)
    for changed in (NOTHING, ALL):
        write_image(tmp_path / "b.dpx", picture.linear(), picture, changed=changed, overwrite=True)
        again = read_image(tmp_path / "b.dpx")
        np.testing.assert_array_equal(again.codes, picture.codes)
        assert again.spec.get_string_attribute("dpx:Transfer") == transfer
        assert again.spec.get_int_attribute("oiio:BitsPerSample") == bits and again.spec.get_float_attribute("dpx:FrameRate") == 25
    data = (tmp_path / "b.dpx").read_bytes()
    assert data[:4] == b"SDPX" and data[36:136].rstrip(b"\0") == b"b.dpx"
    write_image(tmp_path / "c.dpx", picture.linear() * 0.5, picture)
    np.testing.assert_allclose(read_image(tmp_path / "c.dpx").linear(), np.clip(picture.linear() * 0.5, 0, 13.5), rtol=0.05, atol=0.02)


@pytest.mark.parametrize("width", [48, 49, 50])
@pytest.mark.parametrize("packing", ["Filled, method A", "Filled, method B", "Packed"])
def test_the_last_code_of_a_row(tmp_path, width, packing):
    """A row of R G B A ends in a word of its own where three codes to a word leave one: read, and written so that it is read."""
    few = np.random.default_rng(1).integers(0, 1024, (8, width, 4))
    picture = read_image(dpx(tmp_path / "a.dpx", few, "Printing density", dpx__Packing=packing))
    np.testing.assert_array_equal(picture.codes, spread(few, 10))
    write_image(tmp_path / "b.dpx", picture.linear(), picture, changed=np.zeros((8, width), bool))
    np.testing.assert_array_equal(read_image(tmp_path / "b.dpx").codes, picture.codes)


def test_dpx_from_other_formats(tmp_path):
    """Floats become film's codes, which hold light above white; codes become Rec. 709's, over black."""
    light = np.tile(np.array([0, 0.18, 1, 6], np.float32)[None, :, None], (8, 2, 4))
    light[..., 3] = 1
    picture = read_image(store(tmp_path / "a.exr", light, "half", ("R", "G", "B", "A")))
    write_image(tmp_path / "a.dpx", picture.linear(), picture)
    film = read_image(tmp_path / "a.dpx")
    assert film.alpha is None and film.spec.get_string_attribute("dpx:Transfer") == "Printing density"
    np.testing.assert_allclose(film.linear(), light[..., :3], rtol=0.01, atol=2e-3)
    codes = codes_like(channels=2)
    picture = read_image(store(tmp_path / "a.png", codes))
    with pytest.warns(AirlightWarning, match="no transparency: the picture is put on black"):
        write_image(tmp_path / "b.dpx", picture.linear(), picture)
    video = read_image(tmp_path / "b.dpx")
    assert video.codes.shape == (40, 48, 3) and video.spec.get_string_attribute("dpx:Transfer") == "ITU-R 709-4"
    np.testing.assert_allclose(video.linear(), picture.linear(), atol=3e-3)
    write_image(tmp_path / "back.png", film.linear(), film)
    found = read_image(tmp_path / "back.png")
    assert found.encoding == "srgb" and not any(item.name.startswith("dpx:") for item in found.spec.extra_attribs)
    np.testing.assert_allclose(found.linear(), np.clip(film.linear(), 0, 1), atol=2e-4 + 1 / 400)


def test_a_sequence_in_dpx(tmp_path):
    """Light is added to film's codes as to floats: what is brighter than white stays, and may grow."""
    y, x = np.mgrid[0:40, 0:64]
    for k in (1, 2):
        few = np.repeat(np.where((x - 20) ** 2 + (y - 12) ** 2 < 36, 900, 300 + 4 * k)[..., None], 3, axis=2)
        dpx(tmp_path / f"in.000{k}.dpx", few, "Printing density", dpx__TimeCode="01:00:00:00")
    out = tmp_path / "out.####.dpx"
    assert main(["image", str(tmp_path / "in.####.dpx"), "-o", str(out), "--light", "0.3125,0.3", "--look", "classic"]) == 0
    for k in (1, 2):
        before, after = (read_image(tmp_path / f"{name}.000{k}.dpx") for name in ("in", "out"))
        assert after.linear().max() >= before.linear().max() > 4 and (after.codes != before.codes).any()
        assert after.spec.get_int_attribute("oiio:BitsPerSample") == 10


@pytest.mark.parametrize("extension", [".jxl", ".avif"])
@pytest.mark.parametrize(("dtype", "channels"), [("uint8", 1), ("uint8", 2), ("uint8", 3), ("uint8", 4), ("uint16", 3), ("uint16", 4)])
def test_web_formats(tmp_path, extension, dtype, channels):
    codes = np.repeat(np.repeat(codes_like(dtype, channels, 5, 6), 8, axis=0), 8, axis=1)
    colour = {"ICCProfile": P3} if channels > 2 else {}
    picture = read_image(store(tmp_path / "a.png", codes, Make="Camera", **colour))
    write_image(tmp_path / f"b{extension}", picture.linear(), picture, changed=NOTHING, settings='{"k": 1}')
    again = read_image(tmp_path / f"b{extension}")
    assert read_settings(str(tmp_path / f"b{extension}")) == '{"k": 1}'
    assert again.icc == picture.icc or channels < 3
    assert again.spec.get_string_attribute("Make") == "Camera"
    assert (again.alpha is None) == (picture.alpha is None)
    is_exact = extension == ".jxl"
    np.testing.assert_allclose(again.linear(), picture.linear(), atol=1e-6 if is_exact else 0.08)
    if picture.alpha is not None:
        np.testing.assert_allclose(again.alpha, picture.alpha, atol=1e-6 if is_exact else 0.08)
    if is_exact:
        assert again.codes.dtype == dtype
    write_image(tmp_path / f"c{extension}", picture.linear(), picture, changed=NOTHING, settings='{"k": 1}')
    assert (tmp_path / f"c{extension}").read_bytes() == (tmp_path / f"b{extension}").read_bytes()


def test_avif_orientation_and_primaries(tmp_path):
    from PIL import Image

    codes = np.zeros((16, 32, 3), np.uint8)
    codes[:, :16, 0] = 200
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(codes).save(tmp_path / "a.avif", quality=100, subsampling="4:4:4", exif=exif)
    picture = read_image(tmp_path / "a.avif")
    assert picture.codes.shape == (32, 16, 3) and picture.codes[4, 8, 0] > 180 > 60 > picture.codes[28, 8, 0]
    data = (tmp_path / "a.avif").read_bytes()
    at = data.index(b"colrnclx")
    (tmp_path / "hdr.avif").write_bytes(data[: at + 8] + struct.pack(">HH", 9, 16) + data[at + 12 :])
    picture = read_image(tmp_path / "hdr.avif")
    assert picture.coding.is_hdr and picture.coding.cicp == (9, 16) and picture.to_709 is not None
    unknown = data[: at + 8] + struct.pack(">HH", 1, 9) + data[at + 12 :]
    (tmp_path / "log.avif").write_bytes(unknown)
    with pytest.warns(AirlightWarning, match="unusual transfer"):
        read_image(tmp_path / "log.avif")


def test_what_cannot_be_written_is_refused_before_the_work(tmp_path, monkeypatch):
    from airlight.files import atomic, check_output

    for extension, most in (("avif", 32768), ("webp", 16383), ("jpg", 65500)):
        with pytest.raises(AirlightError, match=f"pixels are more than it holds .{most} on a side"):
            write_image(tmp_path / f"a.{extension}", np.zeros((8, most + 1, 3), np.float32))
    write_image(tmp_path / "a.jpg", np.zeros((1, 65500, 3), np.float32))
    write_image(tmp_path / "a.webp", np.zeros((1, 16383, 3), np.float32))
    monkeypatch.setattr(atomic, "find_spec", lambda name: None)
    with pytest.raises(AirlightError, match="writing AVIF needs an extra"):
        check_output(tmp_path / "a.avif")


def test_avif_of_more_than_8_bits(tmp_path, monkeypatch):
    """Pillow writes none: what such a file says of itself is told."""
    from airlight.files import boxes

    picture = read_image(store(tmp_path / "a.png", codes_like()))
    write_image(tmp_path / "a.avif", picture.linear(), picture)
    data = bytearray((tmp_path / "a.avif").read_bytes())
    assert not boxes.is_deep(data)
    data[data.index(b"av1C") + 6] |= 0x40
    assert boxes.is_deep(data) and not boxes.is_deep(data[: data.index(b"av1C") + 6])
    monkeypatch.setattr(boxes, "is_deep", lambda head: True)
    with pytest.warns(AirlightWarning, match="more than 8 bits"):
        read_image(tmp_path / "a.avif")


@pytest.mark.parametrize(("out", "reads"), [("b.avif", False), ("b.png", True)])
def test_avif_without_pillow(tmp_path, monkeypatch, capsys, out, reads):
    from airlight.files import by_pillow

    source = store(tmp_path / "a.png", codes_like())
    if reads:
        picture = read_image(source)
        write_image(tmp_path / "a.avif", picture.linear(), picture)
        source = tmp_path / "a.avif"

    def absent(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(by_pillow, "import_module", absent)
    assert main(["image", str(source), "-o", str(tmp_path / out), *PAST]) == 2
    assert "pip install airlight[avif]" in capsys.readouterr().err and not (tmp_path / out).exists()


@pytest.mark.parametrize("compression", ["none", "rle", "zip", "piz", "pxr24", "b44a", "dwaa:200", "htj2k256"])
def test_exr_compression_is_kept(tmp_path, compression):
    light = np.random.default_rng(1).random((40, 48, 3)).astype(np.float32)
    picture = read_image(store(tmp_path / "a.exr", light, "half", compression=compression))
    write_image(tmp_path / "b.exr", picture.linear() * 1.5, picture)
    spec = read_image(tmp_path / "b.exr").spec
    name, _, level = compression.partition(":")
    assert spec.get_string_attribute("compression") == name
    assert not level or spec.get_float_attribute("openexr:dwaCompressionLevel") == float(level)
    write_image(tmp_path / "c.exr", picture.linear(), picture, storage=Storage(compression="rle"))
    assert read_image(tmp_path / "c.exr").spec.get_string_attribute("compression") == "rle"


def test_b44_makes_no_infinities(tmp_path):
    """Its 4 x 4 blocks round logarithms' differences: numbers near what half holds can come back as none."""
    light = np.full((8, 8, 3), 0.1, np.float32)
    light[1, 1:4] = (-63168, -6076, 39200), (-10672, -7896, -6972), (0.1, 39200, -63168)
    light[2:4, 1] = -63168
    picture = read_image(store(tmp_path / "a.exr", light, "half"))
    with pytest.warns(AirlightWarning, match="b44 would make infinities of its extremes"):
        write_image(tmp_path / "b.exr", picture.linear(), picture, storage=Storage(compression="b44"))
    np.testing.assert_array_equal(read_image(tmp_path / "b.exr").codes, picture.codes)


def test_cryptomatte_is_not_spoilt(tmp_path):
    values = np.random.default_rng(1).random((40, 48, 4)).astype(np.float32)
    names = ("R", "G", "B", "crypto00.R")
    picture = read_image(store(tmp_path / "a.exr", values, "float", names, compression="zip", **{"cryptomatte/1234567/name": "crypto"}))
    with pytest.warns(AirlightWarning, match="Cryptomatte"):
        write_image(tmp_path / "b.exr", picture.linear(), picture, storage=Storage(compression="dwaa"))
    np.testing.assert_array_equal(read_image(tmp_path / "b.exr").extra, picture.extra)


@pytest.mark.parametrize("quality", [20, 50, 75, 90, 95, 100])
@pytest.mark.parametrize("subsampling", ["4:4:4", "4:2:0", "4:2:2"])
def test_jpeg_packing_is_kept(tmp_path, quality, subsampling):
    codes = np.repeat(np.repeat(codes_like("uint8", 3, 5, 6), 8, axis=0), 8, axis=1)
    source = store(tmp_path / "a.jpg", codes, compression=f"jpeg:{quality}", jpeg__subsampling=subsampling)
    picture = read_image(source)
    write_image(tmp_path / "b.jpg", picture.linear() * 1.1, picture)
    assert jpeg_quality(str(tmp_path / "b.jpg")) == jpeg_quality(str(source)) == quality
    assert read_image(tmp_path / "b.jpg").spec.get_string_attribute("jpeg:subsampling") == subsampling
    write_image(tmp_path / "c.jpg", picture.linear(), picture, changed=NOTHING, storage=Storage(None, 60, "4:2:0"))
    assert jpeg_quality(str(tmp_path / "c.jpg")) == 60
    assert read_image(tmp_path / "c.jpg").spec.get_string_attribute("jpeg:subsampling") == "4:2:0"


def test_packing_by_the_command(tmp_path, capsys):
    source = str(store(tmp_path / "a.png", codes_like()))
    for out, options, words in (
        ("b.png", ["--file-quality", "80"], "--file-quality means something for .jpg"),
        ("b.exr", ["--compression", "dwa"], "did you mean 'dwab'?"),
        ("b.exr", ["--compression", "zip:4"], "only dwaa and dwab take a level"),
        ("b.tif", ["--compression", "piz"], "none of .tif: use one of none, lzw, zip, packbits"),
        ("b.jxl", ["--subsampling", "4:2:0"], "--subsampling means something for .jpg"),
    ):
        assert main(["image", source, "-o", str(tmp_path / out), *options, *PAST]) == 2
        assert words in " ".join(capsys.readouterr().err.split()) and not (tmp_path / out).exists()
    layer = ["--layer", str(tmp_path / "l.exr"), "--compression", "dwab:60"]
    assert main(["image", source, "-o", str(tmp_path / "b.jpg"), "--file-quality", "70", *layer, *PAST]) == 0
    assert jpeg_quality(str(tmp_path / "b.jpg")) == 70
    assert read_image(tmp_path / "l.exr").spec.get_string_attribute("compression") == "dwab"
    sizes = []
    for extension in ("webp", "avif", "jxl"):
        for quality in ("30", "90"):
            out = tmp_path / f"q{quality}.{extension}"
            assert main(["image", source, "-o", str(out), "--file-quality", quality, *PAST]) == 0
            sizes.append(out.stat().st_size)
        assert sizes[-2] < sizes[-1], extension


def animated(path):
    """A still picture that holds two: of TIFF's pages, or an animation."""
    from PIL import Image

    pictures = [Image.fromarray(codes_like() // n) for n in (1, 2)]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], **({"lossless": False} if path.suffix == ".webp" else {}))
    return path


@pytest.mark.parametrize("extension", [".tif", ".gif", ".webp", ".png", ".avif"])
def test_several_pictures_are_told(tmp_path, extension):
    path = animated(tmp_path / f"a{extension}")
    with pytest.warns(AirlightWarning, match="only the first is used"):
        picture = read_image(path)
    assert picture.codes.shape[:2] == (40, 48)
    if extension == ".webp":  # not the animation's bytes
        write_image(tmp_path / "b.webp", picture.linear(), picture, changed=NOTHING)
        read_image(tmp_path / "b.webp")


def test_one_picture_is_not_told(tmp_path):
    for extension in (".tif", ".webp", ".png"):
        read_image(store(tmp_path / f"a{extension}", codes_like()))


def test_bmp_of_run_lengths(tmp_path, monkeypatch):
    from airlight.files import by_pillow

    codes = codes_like(channels=1)[..., 0]
    (tmp_path / "a.bmp").write_bytes(bmp_of_runs(codes))
    picture = read_image(tmp_path / "a.bmp")
    np.testing.assert_array_equal(picture.codes[..., 0], codes)

    def absent(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(by_pillow, "import_module", absent)
    with pytest.raises(AirlightError, match="run-length BMP needs an extra"):
        read_image(tmp_path / "a.bmp")


@pytest.mark.parametrize("most", [3.4e38, -3e38, 1e-44])
@pytest.mark.parametrize("options", [[], ["--look", "classic", "--adapt", "0.5"], ["--look", "classic"]])
def test_numpy_is_silent(tmp_path, capsys, most, options):
    """What no light has is clamped with one line; nothing overflows on the way, nor in what is written."""
    light = np.random.default_rng(1).random((40, 48, 4)).astype(np.float32) * np.float32(most if abs(most) < 1 else 1)
    light[8:12, 20:24, :3], light[..., 3], light[:4, :, 3] = most, 1, 1e-30
    spec = oiio.ImageSpec(48, 40, 4, "float")
    spec.attribute("chromaticities", "float[8]", (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767))
    out = oiio.ImageOutput.create("openexr")
    source = str(tmp_path / "a.exr")
    assert out.open(source, spec) and out.write_image(light) and out.close()
    for extension in ("exr", "png", "hdr", "dpx", "tif"):
        made = str(tmp_path / f"o.{extension}")
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            assert main(["image", source, "-o", made, "--light", "0.45,0.25", "--depth", source, "-y", *options]) == 0
        said = capsys.readouterr().err
        assert "encountered" not in said and said.count("which no light has") == (abs(most) > 1), said
        assert np.isfinite(read_image(made).linear()).all()


def test_a_channel_that_is_the_picture_is_not_told_as_lost(tmp_path, recwarn):
    grey = np.random.default_rng(1).random((40, 48, 1)).astype(np.float32)
    for name in ("G", "mask.X"):
        picture = read_image(store(tmp_path / "a.exr", grey, "half", (name,)))
        write_image(tmp_path / "b.png", picture.linear(), picture, overwrite=True)
        assert not list(recwarn), name
        write_image(tmp_path / "b.exr", picture.linear(), picture, overwrite=True)
        assert name in read_image(tmp_path / "b.exr").spec.channelnames
    both = np.concatenate([grey, grey], axis=2)
    picture = read_image(store(tmp_path / "a.exr", both, "half", ("G", "Z")))
    with pytest.warns(AirlightWarning, match="cannot keep Z; use"):
        write_image(tmp_path / "b.png", picture.linear(), picture, overwrite=True)
