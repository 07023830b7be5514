import os
import struct
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from airlight.colour import encode_codes, srgb_decode
from airlight.errors import AirlightError, AirlightWarning, MachineError
from airlight.files import atomic, check_output, encode, read_image, read_mask, to_linear, write_image
from airlight.files.colour import Profile
from airlight.files.images import upright

DATA = Path(__file__).parent / "data"
NOTHING = np.zeros((40, 48), bool)


def codes_like(dtype="uint8", channels=3, height=40, width=48):
    random = np.random.default_rng(1)
    if np.dtype(dtype).kind == "f":
        return (random.random((height, width, channels)) * 4 - 0.25).astype(np.float16).astype(np.float32)
    codes = random.integers(0, np.iinfo(dtype).max + 1, (height, width, channels), dtype=dtype)
    if channels in (2, 4):
        codes[..., -1] |= 1  # WebP forgets the colour of what cannot be seen
    return codes


def store(path, codes, kind=None, names=None, **attributes):
    height, width, channels = codes.shape
    spec = oiio.ImageSpec(width, height, channels, kind or codes.dtype.name.replace("float32", "float"))
    if names:
        spec.channelnames = names
    if channels in (2, 4):
        spec.alpha_channel = channels - 1
        spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        if isinstance(value, bytes):
            spec.attribute(name, f"uint8[{len(value)}]", np.frombuffer(value, np.uint8))
        else:
            spec.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(codes)
    out.close()
    out.geterror()
    return path


def xyz(values):
    return b"XYZ \0\0\0\0" + b"".join(struct.pack(">i", round(v * 65536)) for v in values)


def icc_profile(primaries, gamma=None):
    """A small matrix profile; sRGB's own curve as a table where no gamma is given."""
    if gamma:
        curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"
    else:
        table = np.rint(srgb_decode(np.linspace(0, 1, 1024)) * 65535).astype(">u2").tobytes()
        curve = b"curv\0\0\0\0" + struct.pack(">I", 1024) + table
    tags = {b"wtpt": xyz((0.9642, 1, 0.8249)), b"desc": b"desc\0\0\0\0\0\0\0\x05test\0" + b"\0" * 79, b"cprt": b"text\0\0\0\0CC0\0"}
    for name, column in zip((b"r", b"g", b"b"), primaries):
        tags[name + b"XYZ"] = xyz(column)
        tags[name + b"TRC"] = curve
    body, index = b"", b""
    for name, data in tags.items():
        index += name + struct.pack(">II", 128 + 4 + 12 * len(tags) + len(body), len(data))
        body += data + b"\0" * (-len(data) % 4)
    whole = struct.pack(">I", len(tags)) + index + body
    head = struct.pack(">I", 128 + len(whole)) + b"\0\0\0\0\x02\x10\0\0mntrRGB XYZ " + b"\0" * 12 + b"acsp" + b"\0" * 28
    head += b"".join(struct.pack(">i", round(v * 65536)) for v in (0.9642, 1, 0.8249))
    return head.ljust(128, b"\0") + whole


P3 = icc_profile(((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407)))
SRGB = icc_profile(((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410)))


@pytest.mark.parametrize(
    "extension, dtype, channels",
    [
        (e, d, c)
        for e, d in ((".png", "uint8"), (".png", "uint16"), (".tif", "uint8"), (".tif", "uint16"), (".exr", "float32"))
        for c in (1, 2, 3, 4)
    ]
    + [(".webp", "uint8", 3), (".webp", "uint8", 4), (".tif", "float32", 3), (".tif", "float32", 4)],
)
def test_untouched_codes_come_back(tmp_path, extension, dtype, channels):
    names = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}[channels]
    source = store(
        tmp_path / f"in{extension}", codes_like(dtype, channels), "half" if extension == ".exr" else None, names, compression="lossless"
    )
    picture = read_image(source)
    target = tmp_path / f"out{extension}"
    write_image(target, picture.linear(), picture, changed=NOTHING)
    again = read_image(target)
    assert again.codes.dtype == picture.codes.dtype == dtype
    np.testing.assert_array_equal(again.codes, picture.codes)
    assert again.bits == picture.bits
    write_image(tmp_path / f"second{extension}", picture.linear(), picture, changed=NOTHING)
    assert target.read_bytes() == (tmp_path / f"second{extension}").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([f"in{extension}", f"out{extension}", f"second{extension}"])


def test_hdr_and_jpeg(tmp_path):
    pixels = np.broadcast_to(np.linspace(0.01, 0.9, 48, dtype=np.float32)[None, :, None], (40, 48, 3))
    write_image(tmp_path / "a.hdr", pixels, None)
    one = read_image(tmp_path / "a.hdr")
    write_image(tmp_path / "b.hdr", one.linear(), one, changed=NOTHING)
    np.testing.assert_array_equal(read_image(tmp_path / "b.hdr").codes, one.codes)
    np.testing.assert_allclose(one.codes, pixels, rtol=0.01)
    write_image(tmp_path / "a.jpg", pixels, None)
    picture = read_image(tmp_path / "a.jpg")
    assert picture.spec.get_string_attribute("jpeg:subsampling") == "4:4:4"
    assert np.abs(picture.linear() - pixels).mean() < 0.01


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


def test_display_p3(tmp_path):
    codes = np.zeros((40, 48, 3), np.uint8)
    codes[:20] = (255, 0, 0)
    codes[20:] = (128, 128, 128)
    picture = read_image(store(tmp_path / "p3.png", codes, ICCProfile=P3))
    assert picture.encoding == "icc"
    linear = picture.linear()
    np.testing.assert_allclose(linear[0, 0], (1.2249, -0.0420, -0.0196), atol=2e-3)
    np.testing.assert_allclose(linear[30, 0], srgb_decode(np.float64(128 / 255)), atol=1e-3)
    write_image(tmp_path / "out.png", linear, picture)
    again = read_image(tmp_path / "out.png")
    assert again.icc == P3
    assert np.abs(again.codes.astype(int) - codes).max() <= 1
    write_image(tmp_path / "out.webp", linear, picture)
    assert read_image(tmp_path / "out.webp").encoding == "srgb"


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
    assert (picture.encoding, picture.bits) == ("icc", 16)
    grey = picture.codes.astype(float) / 65535 @ (0.2627, 0.678, 0.0593)
    np.testing.assert_allclose(picture.linear() @ np.float32([0.2126, 0.7152, 0.0722]), grey, atol=2e-3)
    assert read_image(DATA / "tiff_16bit_RGB.tiff").codes.dtype == np.uint16


def test_cmyk_says_so(tmp_path):
    with pytest.warns(AirlightWarning, match="CMYK"):
        picture = read_image(DATA / "pil_sample_cmyk.jpg")
    write_image(tmp_path / "out.jpg", picture.linear(), picture)
    assert read_image(tmp_path / "out.jpg").codes.shape == (100, 100, 3)


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


def test_metadata_and_determinism(tmp_path):
    source = store(
        tmp_path / "a.jpg",
        codes_like(),
        Make="Nikon",
        DateTime="2020:02:02 02:02:02",
        XResolution=300.0,
        YResolution=300.0,
        ResolutionUnit="in",
    )
    picture = read_image(source)
    for extension in (".jpg", ".png", ".tif", ".exr"):
        write_image(tmp_path / f"o{extension}", picture.linear(), picture)
        spec = read_image(tmp_path / f"o{extension}").spec
        assert spec.get_string_attribute("Make") == "Nikon"
        assert spec.get_string_attribute("DateTime") == "2020:02:02 02:02:02"
        assert spec.get_float_attribute("XResolution") == pytest.approx(300, 1e-3)


def test_exr_layers_and_windows(tmp_path):
    names, kinds = ("R", "G", "B", "A", "Z", "spec.R"), ("half", "half", "half", "half", "float", "half")
    codes = codes_like("float32", 6)
    codes[..., 4] = np.linspace(0, 1e5, 48, dtype=np.float32) + 0.123
    codes[0, 0, 4] = np.inf
    spec = oiio.ImageSpec(48, 40, 6, "float")
    spec.channelnames, spec.channelformats = names, tuple(oiio.TypeDesc(k) for k in kinds)
    spec.x, spec.y, spec.full_x, spec.full_y, spec.full_width, spec.full_height = 10, 20, 0, 0, 100, 90
    spec.attribute("compression", "dwaa")
    spec.attribute("Copyright", "me")
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_image(codes) and out.close()
    picture = read_image(tmp_path / "a.exr")
    assert picture.data_window == (10, 20, 48, 40)
    assert picture.display_window == (0, 0, 100, 90)
    layer = np.ones((40, 48, 3), np.float32)
    write_image(tmp_path / "b.exr", picture.linear() + 1e6, picture, layer=layer)
    again = read_image(tmp_path / "b.exr")
    assert again.data_window == picture.data_window and again.display_window == picture.display_window
    assert again.codes[..., :3].max() == 65504
    np.testing.assert_array_equal(again.codes[..., 3], picture.codes[..., 3])
    np.testing.assert_array_equal(again.extra, picture.extra)
    assert again.spec.get_string_attribute("Copyright") == "me"
    assert set(again.spec.channelnames) == {*names, "airlight.R", "airlight.G", "airlight.B"}
    depth = read_mask(tmp_path / "b.exr", depth=True)
    assert depth[0, 0] == depth.max() == codes[5, 47, 4]


def test_alpha(tmp_path):
    codes = codes_like("uint8", 4)
    picture = read_image(store(tmp_path / "a.png", codes))
    np.testing.assert_allclose(picture.alpha, codes[..., 3] / 255, atol=1e-7)
    with pytest.warns(AirlightWarning, match="transparency"):
        write_image(tmp_path / "a.jpg", picture.linear(), picture)
    write_image(tmp_path / "a.exr", picture.linear(), picture, bits=32)
    exr = read_image(tmp_path / "a.exr")
    np.testing.assert_allclose(exr.codes[..., :3], picture.linear() * picture.alpha[..., None], rtol=1e-6)
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


def test_mask(tmp_path):
    codes = codes_like("uint16", 1)
    np.testing.assert_allclose(read_mask(store(tmp_path / "a.png", codes)), codes[..., 0] / 65535, atol=1e-7)
    codes = codes_like()
    np.testing.assert_allclose(read_mask(store(tmp_path / "b.png", codes)), codes / 255 @ (0.2126, 0.7152, 0.0722), atol=1e-6)


def test_encoded_and_changed(tmp_path):
    picture = read_image(store(tmp_path / "a.png", codes_like()))
    changed = NOTHING.copy()
    changed[:10] = True
    write_image(tmp_path / "b.png", None, picture, changed=changed, encoded=255 - picture.codes)
    np.testing.assert_array_equal(read_image(tmp_path / "b.png").codes, np.where(changed[..., None], 255 - picture.codes, picture.codes))


def test_refusals(tmp_path):
    source = store(tmp_path / "a.png", codes_like())
    os.symlink(source, tmp_path / "link.png")
    os.link(source, tmp_path / "hard.png")
    before = source.read_bytes()
    pixels = codes_like("float32")
    with pytest.raises(AirlightError, match="--overwrite"):
        write_image(source, pixels, None)
    for name in ("a.png", "link.png", "hard.png"):
        with pytest.raises(AirlightError, match="also an input"):
            check_output(tmp_path / name, [source], True)
    for name, word in (
        ("x.foo", r"\.png .*\.exr"),
        ("x", "no extension"),
        ("no/x.png", "does not exist"),
        ("n" * 300 + ".png", "too long"),
    ):
        with pytest.raises(AirlightError, match=word):
            check_output(tmp_path / name, [], False)
    (tmp_path / "d.png").mkdir()
    os.mkfifo(tmp_path / "f.png")
    for name in ("d.png", "f.png"):
        with pytest.raises(AirlightError, match="is "):
            check_output(tmp_path / name, [], True)
    with pytest.raises(AirlightError, match="16 bits"):
        write_image(tmp_path / "x.jpg", pixels, None, bits=16)
    assert source.read_bytes() == before
    write_image(source, pixels, None, overwrite=True)
    assert source.read_bytes() != before
    write_image(tmp_path / ("n" * 251 + ".png"), pixels, None)


@pytest.mark.parametrize("error, expected", [(KeyboardInterrupt(), KeyboardInterrupt), (OSError(28, "No space left"), MachineError)])
def test_nothing_is_left(tmp_path, monkeypatch, error, expected):
    def fail(*_):
        raise error

    monkeypatch.setattr(atomic.os, "fsync", fail)
    (tmp_path / "old.png").write_bytes(b"old")
    for name in ("new.png", "old.png"):
        with pytest.raises(expected):
            write_image(tmp_path / name, codes_like("float32"), None, overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["old.png"]
    assert (tmp_path / "old.png").read_bytes() == b"old"


def test_two_runs_to_one_output(tmp_path):
    with pytest.raises(AirlightError, match="--overwrite"), atomic.replacing(tmp_path / "a.png") as file:
        file.write(b"late")
        (tmp_path / "a.png").write_bytes(b"first")
    assert (tmp_path / "a.png").read_bytes() == b"first"
    assert len(list(tmp_path.iterdir())) == 1


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


@pytest.mark.parametrize("compression", ["none", "zip", "zips", "piz"])
@pytest.mark.parametrize("damage", ["tail", "middle", "offset", "row", "whole", "header"])
def test_a_damaged_write_is_noticed(tmp_path, monkeypatch, compression, damage):
    """Of an EXR not all rows are decoded again; what an encoder may leave out is noticed all the same, and nothing is left."""
    from airlight.files import writing

    true = writing._encode
    source = tmp_path / "in.exr"
    spec = oiio.ImageSpec(48, 40, 3, "half")
    spec.attribute("compression", compression)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(source), spec) and out.write_image(np.random.default_rng(1).random((40, 48, 3)).astype(np.float32)) and out.close()
    picture = read_image(source)

    def encode(memory, format, spec, codes, name):
        if damage == "row":
            codes = codes.copy()
            codes[0, 7, 1] += 1
        true(memory, format, spec, codes, name)
        with open(memory, "r+b") as file:
            data = bytearray(file.read())
            table = data.index(b"screenWindowWidth\0float\0") + 18 + 6 + 4 + 4 + 1  # the last attribute, then the offsets of chunks
            if damage == "offset":
                data[table : table + 8] = bytes(8)
            elif damage == "middle":
                del data[len(data) // 2 : len(data) // 2 + 9]
            elif damage == "whole":
                data = data[:0]
            else:
                data = data[: {"tail": len(data) - 1, "header": 60, "row": len(data)}[damage]]
            file.seek(0)
            file.truncate()
            file.write(data)

    monkeypatch.setattr(writing, "_encode", encode)
    with pytest.raises(MachineError, match="read back"):
        write_image(tmp_path / "out.exr", picture.linear() * 2, picture)
    assert [p.name for p in tmp_path.iterdir()] == ["in.exr"]
    monkeypatch.setattr(writing, "_encode", true)
    write_image(tmp_path / "out.exr", picture.linear() * 2, picture)


@pytest.mark.parametrize("name", ["in.jpg", "in.webp", "grey.jpg", "turned.jpg"])
def test_a_zero_layer_gives_a_lossy_file_back(tmp_path, name):
    """JPEG and lossy WebP lose something each time they are encoded: where nothing has changed the file's bytes are taken."""
    from airlight.cli import main

    source = tmp_path / name
    codes = np.random.default_rng(8).integers(0, 256, (48, 64, 1 if name == "grey.jpg" else 3), np.uint8)
    spec = oiio.ImageSpec(64, 48, codes.shape[2], "uint8")
    spec.attribute("compression", "webp:70" if name.endswith("webp") else "jpeg:70")
    if name == "turned.jpg":
        spec.attribute("Orientation", 6)
    out = oiio.ImageOutput.create(str(source))
    assert out.open(str(source), spec) and out.write_image(codes) and out.close()
    target, more = tmp_path / f"out{source.suffix}", tmp_path / f"more{source.suffix}"
    for given in (["--light", "0.4,0.3;strength=0"], ["--light", "0.4,0.3", "--exposure", "0"], ["--light", "0.4,0.3", "--mix", "0"]):
        assert main(["image", str(source), "-o", str(target), "-y", *given]) == 0
        assert target.read_bytes() == source.read_bytes()
    assert main(["image", str(source), "-o", str(more), "--light", "0.4,0.3", "--threshold", "0.2"]) == 0
    assert not np.array_equal(read_image(more).codes, read_image(source).codes)
    other = tmp_path / "out.png"
    assert main(["image", str(source), "-o", str(other), "--light", "0.4,0.3;strength=0"]) == 0
    assert np.array_equal(read_image(other).codes, read_image(source).codes)


def test_a_damaged_lossy_file_is_not_copied(tmp_path):
    source = tmp_path / "in.jpg"
    write_image(source, np.random.default_rng(8).random((200, 200, 3)).astype(np.float32))
    source.write_bytes(source.read_bytes()[:-3000])
    picture = read_image(source, "ignore")
    write_image(tmp_path / "out.jpg", picture.linear(), picture, changed=np.zeros((200, 200), bool))
    assert (tmp_path / "out.jpg").read_bytes() != source.read_bytes()
    read_image(tmp_path / "out.jpg")


@pytest.mark.parametrize("extension", ["png", "tif", "webp", "exr"])
def test_alpha_that_hides_nothing(tmp_path, extension):
    codes = np.random.default_rng(3).integers(0, 256, (9, 7, 4), np.uint8)
    codes[..., 3] = 255
    picture = read_image(store(tmp_path / "in.png", codes))
    write_image(tmp_path / f"out.{extension}", picture.linear(), like=picture)
    again = read_image(tmp_path / f"out.{extension}")
    assert again.alpha is None or (again.alpha == 1).all()
    assert again.codes.shape[:2] == (9, 7)
