"""RAW and HEIC: read where rawpy and pillow-heif are installed; where they are not, the line that names the extra."""

import importlib
import importlib.util
import struct

import numpy as np
import pytest

from airlight.cli import main
from airlight.colour import srgb_decode
from airlight.errors import AirlightError
from airlight.files import extras, read_image, spaces, write_image
from airlight.files.colour import XYZ_TO_709

HAS_RAW, HAS_HEIC = (importlib.util.find_spec(module) is not None for module in ("rawpy", "pillow_heif"))
HEIC = b"\0\0\0\x1cftypheic\0\0\0\0mif1heicmiaf" + b"\0" * 64


def dng(grey, neutral=(0.5, 1.0, 0.8), orientation=1):
    """A DNG of grey (H, W) scene levels 0..1, seen by a camera whose primaries are Rec. 709's and to which grey looks `neutral`."""
    height, width = grey.shape
    colour = np.array([[0, 1], [1, 2]])[np.arange(height)[:, None] % 2, np.arange(width)[None] % 2]
    data = np.rint(grey * np.array(neutral)[colour] * 65535).astype("<u2").tobytes()

    def rational(values, form):
        return struct.pack(f"<{2 * len(values)}{form}", *(n for v in values for n in (round(v * 10000), 10000)))

    tags = [  # tag, type, count, value
        (254, 4, 1, struct.pack("<I", 0)),
        (256, 4, 1, struct.pack("<I", width)),
        (257, 4, 1, struct.pack("<I", height)),
        (258, 3, 1, struct.pack("<H", 16)),
        (259, 3, 1, struct.pack("<H", 1)),
        (262, 3, 1, struct.pack("<H", 32803)),
        (271, 2, 5, b"Test\0"),
        (272, 2, 5, b"Test\0"),
        (273, 4, 1, None),
        (274, 3, 1, struct.pack("<H", orientation)),
        (277, 3, 1, struct.pack("<H", 1)),
        (278, 4, 1, struct.pack("<I", height)),
        (279, 4, 1, struct.pack("<I", len(data))),
        (33421, 3, 2, struct.pack("<2H", 2, 2)),
        (33422, 1, 4, bytes([0, 1, 1, 2])),
        (50706, 1, 4, bytes([1, 4, 0, 0])),
        (50708, 2, 5, b"Test\0"),
        (50717, 4, 1, struct.pack("<I", 65535)),
        (50721, 10, 9, rational(XYZ_TO_709.ravel(), "i")),
        (50728, 5, 3, rational(neutral, "I")),
        (50778, 3, 1, struct.pack("<H", 21)),
    ]
    body, index = b"", b""
    start = 8 + 2 + 12 * len(tags) + 4
    for tag, kind, count, value in tags:
        if value is None:
            index += struct.pack("<HHI", tag, kind, count) + b"STRP"
        elif len(value) <= 4:
            index += struct.pack("<HHI", tag, kind, count) + value.ljust(4, b"\0")
        else:
            index += struct.pack("<HHII", tag, kind, count, start + len(body))
            body += value + b"\0" * (len(value) % 2)
    index = index.replace(b"STRP", struct.pack("<I", start + len(body)))
    return b"II*\0\x08\0\0\0" + struct.pack("<H", len(tags)) + index + b"\0\0\0\0" + body + data


def test_what_is_raw_and_what_is_heic():
    tiff = b"II*\0\x08\0\0\0"
    cases = {("a.nef", tiff): "raw", ("A.DNG", b"MM\0*"): "raw", ("a.tif", tiff): None, ("a.dng", b"\xff\xd8\xff\xe0"): None}
    cases |= {("a", b"FUJIFILMCCD-RAW 0201"): "raw", ("a.x", b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom"): "raw"}
    cases |= {("a.jpg", HEIC): "heic", ("a", b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic"): "heic"}
    cases |= {("a.avif", b"\0\0\0\x1cftypavif\0\0\0\0avifmif1miaf"): "avif", ("a.mp4", b"\0\0\0\x18ftypisom\0\0\0\0isommp42"): None}
    for (name, head), expected in cases.items():
        assert extras.kind(name, head) == expected, (name, head)


@pytest.mark.parametrize(("name", "data", "extra"), [("a.nef", b"II*\0" + b"\0" * 60, "raw"), ("a.heic", HEIC, "heic")])
def test_without_the_extra_a_line_names_it(tmp_path, monkeypatch, capsys, name, data, extra):
    def absent(module, *_):
        raise ModuleNotFoundError(f"No module named {module!r}")

    monkeypatch.setattr(extras, "import_module", absent)
    (tmp_path / name).write_bytes(data)
    assert main(["image", str(tmp_path / name), "-o", str(tmp_path / "o.png")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and f"pip install airlight[{extra}]" in err and not (tmp_path / "o.png").exists()


def test_raw(tmp_path):
    grey = np.full((64, 96), 0.125)
    grey[:32, :48] = 0.5
    path = tmp_path / "a.dng"
    path.write_bytes(dng(grey))
    if not HAS_RAW:
        with pytest.raises(AirlightError, match=r"pip install airlight\[raw\]"):
            read_image(path)
        return
    picture = read_image(path)
    assert (picture.codes.dtype, picture.codes.shape, picture.bits, picture.format) == (np.uint16, (64, 96, 3), 16, "raw")
    linear = picture.linear()
    np.testing.assert_allclose(linear[16, 24], 0.5, rtol=0.01)  # the camera's white balance makes it neutral, linear, not brightened
    np.testing.assert_allclose(linear[50, 70], 0.125, rtol=0.01)
    path.write_bytes(dng(grey, orientation=6))
    turned = read_image(path).linear()
    assert turned.shape == (96, 64, 3)
    np.testing.assert_allclose(turned[24, 48], 0.5, rtol=0.01)
    for name in ("o.png", "o.tif", "o.jpg"):  # developed for viewing: sRGB, not the linear codes
        write_image(tmp_path / name, linear, picture)
        out = read_image(tmp_path / name)
        assert out.encoding == "srgb" and out.bits == (8 if name == "o.jpg" else 16)
        np.testing.assert_allclose(out.linear()[16, 24], 0.5, rtol=0.03)
    for damaged in (dng(grey)[:200], dng(grey)[: len(dng(grey)) // 2], b"II*\0" + b"\xff" * 300):
        path.write_bytes(damaged)
        with pytest.raises(AirlightError) as caught:
            read_image(path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("space", ["srgb", "p3", "icc", "pq"])
def test_heic(tmp_path, space):
    path = tmp_path / "a.heic"
    if not HAS_HEIC:
        path.write_bytes(HEIC)
        with pytest.raises(AirlightError, match=r"pip install airlight\[heic\]"):
            read_image(path)
        return
    heif = importlib.import_module("pillow_heif")
    codes = np.empty((64, 96, 3), np.uint8)
    codes[:, :48], codes[:, 48:] = (200, 60, 40), (90, 90, 90)
    image = heif.from_bytes("RGB", (96, 64), codes.tobytes())
    from picture_files import P3

    if space == "icc":
        image.info["icc_profile"] = P3
    primaries, curve = {"p3": (12, 13), "pq": (9, 16)}.get(space, (1, 13))
    image.save(
        path, quality=100, chroma=444, color_primaries=primaries, transfer_characteristics=curve, matrix_coefficients=6, full_range_flag=1
    )
    if space == "pq":
        picture = read_image(path)
        assert picture.coding.is_hdr and picture.codes.dtype == np.uint8
        value = (np.array([200, 60, 40]) / 255) ** (32 / 2523)  # SMPTE ST 2084, equation 4.1
        light = (np.maximum(value - 0.8359375, 0) / (18.8515625 - 18.6875 * value)) ** (16384 / 2610) * 10_000 / 203
        np.testing.assert_allclose(picture.linear()[32, 24], light, rtol=0.2)
        deep = heif.from_bytes("RGB;16", (8, 8), np.full((8, 8, 3), 65535, np.uint16).tobytes())
        deep.save(path, quality=100, bit_depth=10, color_primaries=9, transfer_characteristics=16, matrix_coefficients=9, full_range_flag=1)
        assert (read_image(path).codes == 65535).all()
        return
    picture = read_image(path)
    assert picture.codes.dtype == np.uint8 and np.abs(picture.codes.astype(int) - codes).max() <= 3
    assert picture.encoding == ("profile" if space in ("icc", "p3") else "srgb") and not picture.lossless
    red = srgb_decode(codes[0, 0] / 255)
    expected = red if space == "srgb" else spaces.to_rec709(spaces.CHROMATICITIES[2]) @ red
    np.testing.assert_allclose(picture.rec709(picture.linear())[32, 24], expected, atol=0.02)
    assert main(["image", str(path), "-o", str(tmp_path / "o.png"), "--light", "0,0", "--exposure", "0"]) == 0
    out = read_image(tmp_path / "o.png")
    np.testing.assert_allclose(out.rec709(out.linear())[32, 24], expected, atol=0.02)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    with pytest.raises(AirlightError) as caught:
        read_image(path)
    assert "\n" not in str(caught.value)


def test_exif_of_heic_is_kept(tmp_path):
    """The block as pillow-heif gives it, its orientation left out, and blocks that make no sense."""
    import OpenImageIO as oiio

    tags = struct.pack("<HHI4sHHIHH", 271, 2, 4, b"Cam\0", 274, 3, 1, 6, 0)
    block = b"II*\0\x08\0\0\0" + struct.pack("<H", 2) + tags + bytes(4)
    for whole in (block, b"Exif\0\0" + block):
        spec = oiio.ImageSpec(96, 64, 3, "uint8")
        extras.copy_exif(spec, whole, "a.heic")
        assert spec.get_string_attribute("Make") == "Cam" and spec.getattribute("Orientation") is None
    for useless in (b"", b"Exif\0\0", b"\xff" * 300, block[:20], bytes(70_000)):
        spec = oiio.ImageSpec(96, 64, 3, "uint8")
        extras.copy_exif(spec, useless, "a.heic")
        assert spec.getattribute("Make") is None
    if HAS_HEIC:
        heif = importlib.import_module("pillow_heif")
        image = heif.from_bytes("RGB", (96, 64), bytes(96 * 64 * 3))
        image.info["exif"] = b"Exif\0\0" + block
        image.save(tmp_path / "a.heic", quality=80)
        assert main(["image", str(tmp_path / "a.heic"), "-o", str(tmp_path / "o.jpg"), "--light", "0,0"]) == 0
        assert read_image(tmp_path / "o.jpg").spec.get_string_attribute("Make") == "Cam"


def test_the_extras_are_declared():
    import tomllib
    from pathlib import Path

    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = project["optional-dependencies"]
    assert declared["raw"][0].startswith("rawpy") and declared["heic"][0].startswith("pillow-heif")
    assert all(not d.startswith(("rawpy", "pillow")) for d in project["dependencies"])
