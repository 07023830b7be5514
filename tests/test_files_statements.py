"""Colours that files tell by numbers and no ICC profile: read by the one that counts, and written with one statement that is true."""

import contextlib
import struct
from pathlib import Path

import colour_files as files
import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import P3, SRGB, store

from airlight.cli import main
from airlight.colour import srgb_encode
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import coded, icc, read_image, spaces, told, write_image
from airlight.files.colour import XYZ_TO_709, Profile
from airlight.files.decode import decode

REC709, REC2020, DISPLAY_P3, ADOBE, ACESCG, ACES = spaces.CHROMATICITIES
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
PARIS = Path(__file__).parent / "data" / "cases" / "gainmap_paris.jpg"
STEPS = np.linspace(0, 1, 24)
LIGHT = np.stack([*np.meshgrid(STEPS, STEPS[::-1], indexing="ij"), np.full((24, 24), 0.4)], axis=-1)  # linear (24, 24, 3)


def in_rec709(path):
    picture = read_image(path)
    return picture.rec709(picture.linear())


def matrix(chromaticities):
    found = spaces.to_rec709(chromaticities)
    return np.eye(3) if found is None else found


def codes_of(values, dtype="uint16"):
    return np.rint(np.clip(values, 0, 1) * np.iinfo(dtype).max).astype(dtype)


def gama(value):
    return b"gAMA", struct.pack(">I", round(value * 100_000))


CASES = {  # name: codes of LIGHT, chunks, chromaticities, white
    "unlabelled": (srgb_encode(LIGHT), (), REC709),
    "gamma 1.8": (LIGHT ** (1 / 1.8), (gama(1 / 1.8),), REC709),
    "gamma 2.2 is sRGB": (srgb_encode(LIGHT), (gama(0.45455), (b"cHRM", files.chrm(REC709))), REC709),
    "linear": (LIGHT, (gama(1),), REC709),
    "linear P3": (LIGHT, (gama(1), (b"cHRM", files.chrm(DISPLAY_P3))), DISPLAY_P3),
    "Adobe RGB": (LIGHT ** (256 / 563), (gama(256 / 563), (b"cHRM", files.chrm(ADOBE))), ADOBE),
    "primaries alone": (srgb_encode(LIGHT), ((b"cHRM", files.chrm(DISPLAY_P3)),), DISPLAY_P3),
    "sRGB before gAMA": (srgb_encode(LIGHT), ((b"sRGB", b"\0"), gama(1), (b"cHRM", files.chrm(ADOBE))), REC709),
    "cICP before all": (srgb_encode(LIGHT), ((b"cICP", bytes((12, 13, 0, 1))), (b"sRGB", b"\0"), gama(1)), DISPLAY_P3),
    "cICP gamma 2.8": (LIGHT ** (1 / 2.8), ((b"cICP", bytes((9, 5, 0, 1))),), REC2020),
    "cICP linear": (LIGHT, ((b"cICP", bytes((1, 8, 0, 1))),), REC709),
    "cICP BT.709": (
        np.where(LIGHT < 0.018, 4.5 * LIGHT, 1.099 * LIGHT**0.45 - 0.099),
        ((b"cICP", bytes((9, 1, 0, 1))),),
        REC2020,
    ),
    "narrow range": (srgb_encode(LIGHT) * 219 * 256 / 65535 + 16 * 256 / 65535, ((b"cICP", bytes((1, 13, 0, 0))),), REC709),
    "PQ": (files.pq(LIGHT * 4 * 203), ((b"cICP", bytes((9, 16, 0, 1))), (b"mDCV", bytes(24))), REC2020),
    "PQ of P3": (files.pq(LIGHT * 4 * 203), ((b"cICP", bytes((12, 16, 0, 1))),), DISPLAY_P3),
    "unknown cICP": (LIGHT ** (1 / 1.8), ((b"cICP", bytes((1, 9, 0, 1))), gama(1 / 1.8)), REC709),
}


def case(tmp_path, name):
    """Store a case: its path and its linear Rec. 709."""
    values, chunks, chromaticities = CASES[name]
    light = LIGHT * (4 if "PQ" in name else 1) @ matrix(chromaticities).T
    return files.png(tmp_path / "in.png", codes_of(values), *chunks), light


@pytest.mark.filterwarnings("ignore:.*code points:airlight.errors.AirlightWarning")
@pytest.mark.parametrize("name", CASES)
def test_png_is_read_by_what_counts(tmp_path, name):
    path, light = case(tmp_path, name)
    np.testing.assert_allclose(in_rec709(path), light, atol=2e-3 * light.max())


def test_hlg_is_as_its_reference_display_shows_it(tmp_path):
    """Of 1000 cd/m2, by ITU-R BT.2100: 75 % is white, colours through the system gamma of luminance."""
    scene = LIGHT * 0.7
    path = files.png(tmp_path / "in.png", codes_of(files.hlg(scene)), (b"cICP", bytes((9, 18, 0, 1))))
    luminance = scene @ (0.2627, 0.678, 0.0593)
    shown = 1000 / 203 * luminance[..., None] ** 0.2 * scene
    np.testing.assert_allclose(in_rec709(path), shown @ matrix(REC2020).T, atol=5e-3)
    white = files.png(tmp_path / "white.png", np.full((4, 4, 3), round(0.75 * 65535), np.uint16), (b"cICP", bytes((9, 18, 0, 1))))
    np.testing.assert_allclose(in_rec709(white), 1, atol=5e-3)


def statement(path):
    """What an output says of its colours, as a function from codes to linear Rec. 709; asserts that no two things contradict."""
    spec = decode(str(path), "error")[1]
    profile, chromaticities = spec.getattribute("ICCProfile"), spec.getattribute("chromaticities")
    names = {item.name for item in spec.extra_attribs}
    assert not [name for name in names if name.startswith(("hdrgm:", "Item:"))]
    exif = spec.getattribute("Exif:ColorSpace")
    if spec.format.basetype in (oiio.HALF, oiio.FLOAT):
        assert exif is None and "CICP" not in names
        if profile is not None:
            return bytes(bytearray(profile))
        return chromaticities or REC709
    assert chromaticities is None
    if path.suffix == ".png":
        chunks = files.png_statements(path)
        if b"cICP" in chunks:
            assert set(chunks) <= {b"cICP", b"mDCV"} and exif != 1
        elif b"iCCP" in chunks:
            assert set(chunks) == {b"iCCP"} and exif != 1
        elif b"sRGB" in chunks:
            assert chunks.get(b"gAMA", struct.pack(">I", 45455)) == struct.pack(">I", 45455)
            assert chunks.get(b"cHRM", files.chrm(REC709)) == files.chrm(REC709) and exif in (None, 1)
            return "srgb"
        else:
            assert b"gAMA" in chunks or (b"cHRM" in chunks and exif != 1)
        return chunks
    if profile is not None:
        assert exif in (None, 65535) or Profile(bytes(bytearray(profile))).is_srgb()
        return bytes(bytearray(profile))
    assert exif in (None, 1)
    return "srgb"


OUTPUTS = [".png", ".jpg", ".tif", ".webp", ".exr", ".hdr", ".jxl", ".avif", ".dpx"]


@pytest.mark.filterwarnings("ignore::airlight.errors.AirlightWarning")
@pytest.mark.parametrize("extension", OUTPUTS)
@pytest.mark.parametrize("name", CASES)
def test_outputs_say_one_thing_and_it_is_true(tmp_path, name, extension):
    path, light = case(tmp_path, name)
    picture = read_image(path)
    out = tmp_path / f"out{extension}"
    write_image(out, picture.linear(), picture)
    said = statement(out)
    back = in_rec709(out)
    held = light if extension in (".exr", ".hdr") or said != "srgb" else np.clip(light, 0, 1)
    if extension == ".hdr":
        held = np.maximum(held, 0)
    tolerance = {".jpg": 0.08, ".avif": 0.08, ".webp": 0.02, ".hdr": 0.02}.get(extension, 4e-3) * max(1, light.max())
    np.testing.assert_allclose(back, held, atol=tolerance)
    if extension == ".exr":
        np.testing.assert_allclose(said, CASES[name][2], atol=1e-6)


@pytest.mark.filterwarnings("ignore::airlight.errors.AirlightWarning")
@pytest.mark.parametrize("name", [name for name in CASES if name not in ("unlabelled", "gamma 2.2 is sRGB")])
def test_an_unchanged_png_keeps_codes_and_the_chunk_that_counts(tmp_path, name):
    path, _ = case(tmp_path, name)
    picture = read_image(path)
    write_image(tmp_path / "out.png", picture.linear(), picture, changed=np.zeros((24, 24), bool))
    np.testing.assert_array_equal(read_image(tmp_path / "out.png").codes, picture.codes)
    before, after = files.png_statements(path), files.png_statements(tmp_path / "out.png")
    counts = next(kind for kind in (b"cICP", b"sRGB", b"gAMA", b"cHRM") if kind in before and not (name[0] == "u" and kind == b"cICP"))
    assert after[counts] == before[counts] or counts == b"sRGB"
    assert (b"mDCV" in after) == (b"mDCV" in before)


def test_command_of_hdr(tmp_path, capsys):
    """PQ stays PQ in PNG, is linear in EXR with the luminance of its white, and a line says what SDR cuts."""
    path, light = case(tmp_path, "PQ")
    for extension in (".png", ".exr", ".jpg"):
        assert main(["image", str(path), "-o", str(tmp_path / f"out{extension}"), "--light", "0.5,0.5;strength=0"]) == 0
        err = capsys.readouterr().err
        assert ("brighter than white" in err) == (extension == ".jpg"), err
    assert files.png_statements(tmp_path / "out.png")[b"cICP"] == bytes((9, 16, 0, 1))
    exr = oiio.ImageInput.open(str(tmp_path / "out.exr")).spec()
    assert exr.get_float_attribute("whiteLuminance") == 203
    np.testing.assert_allclose(in_rec709(tmp_path / "out.exr"), light, atol=0.01)


def test_damaged_chunks_are_left_aside(tmp_path):
    codes = codes_of(srgb_encode(LIGHT), "uint8")
    plain = in_rec709(files.png(tmp_path / "a.png", codes))
    for kind, data in ((b"gAMA", b"\0\0\0\0"), (b"gAMA", b"\0"), (b"cHRM", bytes(32)), (b"cICP", b"\1")):
        path = files.png(tmp_path / "b.png", codes, (kind, data))
        if data == bytes(32):
            with pytest.warns(AirlightWarning, match="span no colours"):
                np.testing.assert_array_equal(in_rec709(path), plain)
        else:
            try:
                np.testing.assert_array_equal(in_rec709(path), plain)
            except AirlightError as error:  # libpng's judgement
                assert "damaged" in str(error)


def test_grey_has_a_curve_and_no_primaries(tmp_path):
    light = LIGHT[..., :1]
    path = files.png(tmp_path / "in.png", codes_of(light ** (1 / 1.8)), gama(1 / 1.8), (b"cHRM", files.chrm(ADOBE)))
    np.testing.assert_allclose(in_rec709(path), np.repeat(light, 3, 2), atol=2e-3)
    picture = read_image(path)
    for extension in (".png", ".jpg", ".tif"):
        write_image(tmp_path / f"out{extension}", picture.linear(), picture)
        again = read_image(tmp_path / f"out{extension}")
        assert again.codes.shape[2] == 1
        np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), np.repeat(light, 3, 2), atol=0.03)


def test_grey_that_gets_colour(tmp_path):
    """Its codes are then Rec. 709's, whatever primaries were written beside the grey."""
    grey = np.full((8, 8, 1), 0.5)
    tint = np.float32([1, 0.6, 0.3])
    for chunks in ((gama(1 / 1.8), (b"cHRM", files.chrm(ADOBE))), ((b"cICP", bytes((9, 5, 0, 1))),)):
        exponent = 1 / 2.8 if chunks[0][0] == b"cICP" else 1 / 1.8
        picture = read_image(files.png(tmp_path / "in.png", codes_of(grey**exponent), *chunks))
        write_image(tmp_path / "out.png", picture.linear() * tint, picture, overwrite=True)
        np.testing.assert_allclose(in_rec709(tmp_path / "out.png"), np.broadcast_to(0.5 * tint, (8, 8, 3)), atol=2e-3)


def test_transparency_of_hdr(tmp_path):
    """Light beyond white behind a half transparent alpha: codes of PQ hold it, so alpha stays."""
    codes = np.concatenate([codes_of(files.pq(LIGHT * 3 * 203)), np.full((24, 24, 1), 32768, np.uint16)], axis=2)
    picture = read_image(files.png(tmp_path / "in.png", codes, (b"cICP", bytes((9, 16, 0, 1)))))
    write_image(tmp_path / "out.png", picture.linear() * 1.1, picture)
    again = read_image(tmp_path / "out.png")
    np.testing.assert_array_equal(again.codes[..., 3], codes[..., 3])
    np.testing.assert_allclose(again.linear(), picture.linear() * 1.1, atol=5e-3)


@pytest.mark.parametrize(("space", "index", "adobe"), [(65535, b"R03\0", True), (1, b"R98\0", False), (65535, b"R98\0", False)])
def test_adobe_rgb_of_cameras(tmp_path, space, index, adobe):
    light = LIGHT * 0.5 + 0.2
    curve = light ** (256 / 563) if adobe else srgb_encode(light)
    path = store(tmp_path / "in.jpg", codes_of(curve, "uint8"), compression="jpeg:100")
    files.with_segment(path, files.camera_exif(space, index))
    expected = light @ matrix(ADOBE if adobe else REC709).T
    np.testing.assert_allclose(in_rec709(path), expected, atol=0.08)
    picture = read_image(path)
    for extension in OUTPUTS:
        write_image(tmp_path / f"out{extension}", picture.linear() * 0.9, picture)
        said = statement(tmp_path / f"out{extension}")
        np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), expected * 0.9, atol=0.08)
        if extension in (".jpg", ".tif", ".png", ".webp"):
            assert isinstance(said, bytes | dict) == adobe
    store(path, codes_of(srgb_encode(light), "uint8"), compression="jpeg:100", ICCProfile=P3)
    files.with_segment(path, files.camera_exif(65535, b"R03\0"))
    assert read_image(path).icc == P3


@pytest.mark.parametrize(("chromaticities", "curve", "gamma"), [(DISPLAY_P3, "srgb", 1), (ADOBE, "gamma", 2.2), (REC2020, "bt709", 1)])
def test_profiles_that_are_made(chromaticities, curve, gamma):
    coding = coded.Coding(chromaticities, curve, gamma)
    codes = LIGHT.astype(np.float32)
    by_profile, by_numbers = codes.copy(), codes.copy()
    Profile(coding.icc).decode(by_profile)
    coding.profile.decode(by_numbers)
    np.testing.assert_allclose(by_profile, by_numbers @ coding.to_709.T, atol=5e-4)


def test_xyz_is_a_space_of_rgb(tmp_path):
    """Its primaries have y = 0, and neutral is D65, as programs write it."""
    light = (LIGHT * 3).astype(np.float32)
    path = store(tmp_path / "xyz.exr", np.float32(light @ np.linalg.inv(XYZ_TO_709).T), "float")
    spec = oiio.ImageInput.open(str(path)).spec()
    spec.attribute("chromaticities", "float[8]", XYZ)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), spec) and out.write_image(np.float32(light @ np.linalg.inv(XYZ_TO_709).T)) and out.close()
    np.testing.assert_allclose(in_rec709(path), light, atol=1e-4)
    picture = read_image(path)
    for extension in (".exr", ".png", ".hdr"):
        write_image(tmp_path / f"out{extension}", picture.linear(), picture)
        assert np.allclose(statement(tmp_path / "out.exr"), XYZ)
        expected = np.clip(light, 0, 1) if extension == ".png" else light
        np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), expected, atol=0.02)


@pytest.mark.parametrize(
    ("attributes", "chromaticities", "told"),
    [
        ({"colorInteropID": "lin_ap1_scene"}, ACESCG, ""),
        ({"colorInteropID": "lin_rec2020_scene"}, REC2020, ""),
        ({"colorInteropID": "lin_ciexyzd65_scene"}, XYZ, ""),
        ({"colorInteropID": "data"}, REC709, ""),
        ({"acesImageContainerFlag": 1}, ACES, ""),
        ({"colorInteropID": "srgb_rec709_scene"}, REC709, "not linear"),
        ({"colorInteropID": "nonsense"}, REC709, "not in OpenColorIO"),
        ({"colorInteropID": "lin_ap1_scene", "chromaticities": DISPLAY_P3}, DISPLAY_P3, ""),
    ],
)
def test_exr_tells_by_name(tmp_path, attributes, chromaticities, told):
    light = (LIGHT * 3).astype(np.float32)
    spec = oiio.ImageSpec(24, 24, 3, "half")
    spec.attribute("compression", "none")
    for name, value in attributes.items():
        if isinstance(value, tuple):
            spec.attribute(name, "float[8]", value)
        else:
            spec.attribute(name, value)
    out = oiio.ImageOutput.create("openexr")
    path = tmp_path / "in.exr"
    assert out.open(str(path), spec) and out.write_image(light) and out.close()
    with pytest.warns(AirlightWarning, match=told) if told else contextlib.nullcontext():
        picture = read_image(path)
    np.testing.assert_allclose(picture.rec709(light), light @ matrix(chromaticities).T, atol=2e-3)
    write_image(tmp_path / "out.exr", picture.linear(), picture)
    again = oiio.ImageInput.open(str(tmp_path / "out.exr")).spec()
    np.testing.assert_allclose(again.getattribute("chromaticities") or REC709, chromaticities, atol=1e-5)
    written = again.get_string_attribute("colorInteropID")
    assert written == ("" if "chromaticities" in attributes else attributes.get("colorInteropID", written))


@pytest.mark.parametrize(("tail", "found"), [(b"http://ns.apple.com/HDRGainMap/1.0/", True), (b"a second view", False)])
def test_a_gain_map_that_only_its_own_picture_names(tmp_path, tail, found):
    path = store(tmp_path / "in.jpg", codes_of(LIGHT, "uint8"))
    files.with_segment(path, b"MPF\0" + bytes(30), 0xE2)
    path.write_bytes(path.read_bytes() + tail)
    assert read_image(path).gain_map is found
    head = b"\0\0\0\x20ftypavif\0\0\0\0avifmif1miaf" + (b"tmap" if found else b"MA1A")
    assert told.read(oiio.ImageSpec(24, 24, 3, "uint8"), "avif", "a.avif", codes_of(LIGHT, "uint8"), head, None).gain_map is found


@pytest.mark.parametrize("extension", OUTPUTS)
@pytest.mark.parametrize("source", [".png", ".jpg", ".tif", ".webp"])
def test_profiles_stand_alone(tmp_path, source, extension):
    """Beside an ICC profile nothing else is said, whatever else the input held."""
    codes = codes_of(srgb_encode(LIGHT * 0.5 + 0.2), "uint8")
    path = store(tmp_path / f"in{source}", codes, ICCProfile=P3, Make="Camera", Exif__ColorSpace=1)
    picture = read_image(path)
    write_image(tmp_path / f"out{extension}", picture.linear() * 0.9, picture)
    said = statement(tmp_path / f"out{extension}")
    if extension in (".png", ".jpg", ".tif", ".webp", ".avif"):
        assert said == P3 or set(said) == {b"iCCP"}
    np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), picture.linear() * 0.9, atol=0.06)


def test_lab_says_so(tmp_path):
    from PIL import Image, ImageCms

    image = Image.fromarray(codes_of(srgb_encode(LIGHT), "uint8"))
    profiles = ImageCms.createProfile("sRGB"), ImageCms.createProfile("LAB")
    ImageCms.applyTransform(image, ImageCms.buildTransform(*profiles, "RGB", "LAB")).save(tmp_path / "lab.tif")
    with pytest.warns(AirlightWarning, match="is Lab and was converted to RGB plainly") as told_of:
        picture = read_image(tmp_path / "lab.tif")
    assert len(told_of) == 1 and picture.icc is None
    write_image(tmp_path / "out.tif", picture.linear(), picture)
    assert statement(tmp_path / "out.tif") == "srgb"


def test_radiance_primaries(tmp_path):
    write_image(tmp_path / "in.hdr", (LIGHT + 0.1).astype(np.float32))
    data = (tmp_path / "in.hdr").read_bytes()
    line = "PRIMARIES=" + " ".join(str(v) for v in DISPLAY_P3) + "\n"
    (tmp_path / "in.hdr").write_bytes(data.replace(b"\nFORMAT", b"\n" + line.encode() + b"FORMAT", 1))
    expected = (LIGHT + 0.1) @ matrix(DISPLAY_P3).T
    np.testing.assert_allclose(in_rec709(tmp_path / "in.hdr"), expected, atol=0.01)
    picture = read_image(tmp_path / "in.hdr")
    for extension in (".hdr", ".exr"):
        write_image(tmp_path / f"out{extension}", picture.linear(), picture)
        held = np.maximum(expected, 0) if extension == ".hdr" else expected
        np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), held, atol=0.02)


LINEAR_P3 = icc.matrix_profile(spaces.to_xyz(DISPLAY_P3, icc.D50), "linear")


@pytest.mark.parametrize("profile", [P3, SRGB, LINEAR_P3])
def test_profile_of_floats(tmp_path, profile):
    """A float TIFF whose codes have a curve is decoded, and one of it is encoded again; the profile stays."""
    space = REC709 if profile == SRGB else DISPLAY_P3
    codes = np.float32(LIGHT if profile == LINEAR_P3 else srgb_encode(LIGHT))
    path = store(tmp_path / "in.tif", codes, ICCProfile=profile)
    expected = LIGHT @ matrix(space).T
    np.testing.assert_allclose(in_rec709(path), expected, atol=2e-3)
    picture = read_image(path)
    for extension in (".tif", ".exr", ".png"):
        write_image(tmp_path / f"out{extension}", picture.linear(), picture, changed=np.zeros((24, 24), bool))
        held = expected if extension != ".png" else np.clip(expected, 0, 1)
        np.testing.assert_allclose(in_rec709(tmp_path / f"out{extension}"), held, atol=3e-3)
    assert statement(tmp_path / "out.tif") == profile
    np.testing.assert_allclose(oiio.ImageInput.open(str(tmp_path / "out.tif")).read_image("float"), codes, atol=1e-5)


def test_a_gain_map_that_is_lost_is_told(tmp_path, capsys):
    out = tmp_path / "out.jpg"
    assert main(["image", str(PARIS), "-o", str(out), "--light", "0.5,0.3", "--threshold", "0.5"]) == 0
    assert capsys.readouterr().err.count("gain map") == 1
    statement(out)
    assert b"hdr-gain-map" not in out.read_bytes() and b"MPF\0" not in out.read_bytes()
    picture = read_image(PARIS)
    write_image(tmp_path / "same.jpg", picture.linear(), picture, changed=np.zeros((picture.height, picture.width), bool))
    assert capsys.readouterr().err == ""
    assert (tmp_path / "same.jpg").read_bytes() == PARIS.read_bytes()
    with pytest.warns(AirlightWarning, match="gain map"):
        write_image(tmp_path / "out.exr", picture.linear(), picture)
