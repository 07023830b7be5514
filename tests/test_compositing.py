"""What a compositor hands in and gets back: layers, windows, overscan, colour spaces, settings, numbers typed elsewhere."""

import json
import re
from pathlib import Path

import msgspec
import numpy as np
import OpenImageIO as oiio
import pytest
import thumbs

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image, read_settings, spaces, write_image
from airlight.jobs.light_text import place, read_light
from airlight.options import Parameters
from airlight.reference import fallback
from airlight.reference import radial as ref

AP1 = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
QUICK = ["--method", "radial", "--samples", "24"]
LOOKS = {"classic": QUICK, "smart": ["--rays", "24"]}  # before the little suns of these pictures nothing stands


def spec_of(names, kinds, data, display, **attributes):
    spec = oiio.ImageSpec(data[2], data[3], len(names), kinds[0])
    spec.channelnames, spec.channelformats = tuple(names), tuple(oiio.TypeDesc(kind) for kind in kinds)
    spec.x, spec.y = data[:2]
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = display
    for name, value in attributes.items():
        if isinstance(value, tuple):
            spec.attribute(name.replace("__", ":"), f"float[{len(value)}]", value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    return spec


def store(path, pixels, names="RGB", kind="half", data=None, display=None, **attributes):
    data = data or (0, 0, pixels.shape[1], pixels.shape[0])
    kinds = [kind] * len(names) if isinstance(kind, str) else kind
    spec = spec_of(list(names), kinds, data, display or data, **attributes)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(pixels, np.float32)) and out.close()
    return path


def load(path):
    """Spec, and each channel by its name, as OpenImageIO alone reads them."""
    inp = oiio.ImageInput.open(str(path))
    spec = oiio.ImageSpec(inp.spec())
    pixels = np.reshape(inp.read_image(0, 0, 0, spec.nchannels, "float"), (spec.height, spec.width, spec.nchannels))
    inp.close()
    return spec, dict(zip(spec.channelnames, np.moveaxis(pixels, 2, 0)))


def scene(width=64, height=40, channels=3, seed=3):
    """A dim picture with a small bright sun in its upper left quarter; halves."""
    random = np.random.default_rng(seed)
    pixels = random.random((height, width, channels)) * 0.3
    pixels[height // 4 : height // 4 + 3, width // 4 : width // 4 + 3, :3] = (40, 30, 20)
    return pixels.astype(np.float16).astype(np.float32)


def run(*args, look="classic"):
    assert main(["image", *map(str, args), *LOOKS[look]]) == 0


def refused(capsys, *args):
    assert main(["image", *map(str, args)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("airlight: ") and err.count("\n") == 1
    return err


@pytest.mark.parametrize(
    ("compression", "look"), [*((name, "classic") for name in ("zip", "zips", "piz", "none")), ("zip", "smart"), ("none", "smart")]
)
def test_layers_metadata_and_windows_are_kept(tmp_path, compression, look):
    names = ["R", "G", "B", "A", "Z", "diffuse.R", "diffuse.G", "diffuse.B", "crypto00.R", "N.X", "N.Y", "N.Z"]
    kinds = ["half"] * 3 + ["float"] * 2 + ["half"] * 3 + ["float"] + ["half"] * 3
    pixels = scene(61, 37, 12)
    pixels[..., 3] = np.linspace(0, 1, 61, dtype=np.float32)
    pixels[..., 4] = np.linspace(0.1, 12345.678, 61, dtype=np.float32)
    pixels[..., 8] = np.random.default_rng(1).integers(1, 2**30, (37, 61), dtype=np.int32).view(np.float32)
    said = {
        "owner": "me",
        "capDate": "2026:01:02 03:04:05",
        "frameNumber": 7,
        "nameOfShot": "sh010",
        "typeOfLens": "50mm",
        "screenWindowWidth": 1.5,
    }
    source = store(
        tmp_path / "in.exr", pixels, names, kinds, (-7, -5, 61, 37), (3, 2, 40, 30), compression=compression, chromaticities=AP1, **said
    )
    run(source, "-o", tmp_path / "out.exr", "--light", "0.2,0.3", look=look)
    before, was = load(source)
    after, now = load(tmp_path / "out.exr")
    for name in ("x", "y", "width", "height", "full_x", "full_y", "full_width", "full_height"):
        assert getattr(after, name) == getattr(before, name)
    assert set(after.channelnames) == {*names, "airlight.R", "airlight.G", "airlight.B"}
    form = dict(zip(after.channelnames, map(str, after.channelformats)))
    assert [form[name] for name in names] == kinds and form["airlight.R"] == "half"
    for name in names[3:]:
        np.testing.assert_array_equal(now[name], was[name], err_msg=name)
    for name in "RGB":  # premultiplied and additive: plus, and nothing else
        layer = now[f"airlight.{name}"]
        assert layer.max() > 0.01
        np.testing.assert_array_equal(now[name], (was[name] + layer).astype(np.float16))
    for item in before.extra_attribs:
        assert item.name.startswith(("oiio:", "openexr:")) or after.getattribute(item.name) == item.value, item.name
    assert {"nameOfShot", "frameNumber", "screenWindowWidth", "chromaticities"} <= {item.name for item in before.extra_attribs}
    assert after.getattribute("compression") == compression and after.get_int_attribute("oiio:subimages", 1) == 1
    run(source, "-o", tmp_path / "again.exr", "--light", "0.2,0.3", look=look)
    assert (tmp_path / "again.exr").read_bytes() == (tmp_path / "out.exr").read_bytes()


@pytest.mark.parametrize("look", LOOKS)
def test_alpha_beyond_0_to_1_stays(tmp_path, look):
    pixels = scene(channels=4)
    pixels[..., 3] = 1
    pixels[0, :3, 3] = (1.5, -0.25, 60000)
    run(store(tmp_path / "a.exr", pixels, "RGBA"), "-o", tmp_path / "b.exr", "--light", "0.25,0.25", look=look)
    assert np.array_equal(load(tmp_path / "b.exr")[1]["A"], pixels[..., 3])


def test_half_beside_float_stays_finite(tmp_path):
    """A sum beyond what half holds, in an EXR where only some colours are half."""
    source = store(tmp_path / "a.exr", np.full((10, 12, 3), 60000, np.float32), kind=["float", "half", "half"])
    run(source, "-o", tmp_path / "b.exr", "--light", "0.25,0.25", "--occlusion", "none")
    spec, channels = load(tmp_path / "b.exr")
    assert [str(kind) for kind in spec.channelformats[:3]] == ["float", "half", "half"]
    assert channels["R"].max() > 65504 == channels["G"].max() == channels["B"].max()
    store(tmp_path / "c.exr", np.minimum(100000 * thumbs.linear(), 65504), kind=["float", "half", "half"])
    assert main(["image", str(tmp_path / "c.exr"), "-o", str(tmp_path / "d.exr"), "--strength", "4"]) == 0
    spec, channels = load(tmp_path / "d.exr")
    assert channels["airlight.R"].max() > 1000 and all(np.isfinite(values).all() for values in channels.values())
    assert channels["R"].max() >= 65504 and channels["G"].max() <= 65504


def test_float_stays_float(tmp_path):
    pixels = np.random.default_rng(0).random((30, 40, 3)).astype(np.float32) * 0.1
    source = store(tmp_path / "in.exr", pixels, kind="float")
    run(source, "-o", tmp_path / "out.exr", "--light", "0.5,0.5", "--exposure", "0")
    spec, now = load(tmp_path / "out.exr")
    assert str(spec.channelformats[0] if spec.channelformats else spec.format) == "float"
    for i, name in enumerate("RGB"):
        np.testing.assert_array_equal(now[name], pixels[..., i])


@pytest.mark.parametrize("look", LOOKS)
def test_layer_of_a_transparent_picture_is_premultiplied(tmp_path, look):
    codes = np.full((40, 64, 4), (30, 60, 90, 128), np.uint8)
    codes[10:14, 16:20] = 255
    codes[:, 40:, 3] = 0
    write_image(tmp_path / "in.png", None, encoded=codes[..., :3].copy(), alpha=codes[..., 3] / 255)
    picture = read_image(tmp_path / "in.png")
    run(tmp_path / "in.png", "-o", tmp_path / "out.exr", "--light", "0.28,0.3", look=look)
    _, now = load(tmp_path / "out.exr")
    for i, name in enumerate("RGB"):
        np.testing.assert_allclose(now[name], picture.linear()[..., i] + now[f"airlight.{name}"], rtol=2e-3, atol=1e-4)
        assert now[f"airlight.{name}"][:, :40].max() > 0.005
        assert (now[f"airlight.{name}"][:, 40:].max() > 0.002) == (look == "classic")  # what is black stays black in the smart look
    np.testing.assert_array_equal(now["A"], picture.alpha.astype(np.float16))


def test_parts_become_one(tmp_path):
    parts = [("rgba", "RGB", "half"), ("diffuse", "RGB", "half"), ("depth", "Z", "float"), ("small", "RGB", "half")]
    window = (-3, 2, 48, 30)
    specs = [spec_of(list(c), [k] * len(c), window if n != "small" else (0, 0, 8, 8), (0, 0, 40, 30)) for n, c, k in parts]
    for spec, (name, _, _) in zip(specs, parts):
        spec.attribute("oiio:subimagename", name)
    pixels = [scene(s.width, s.height, s.nchannels, seed=i) if s.nchannels == 3 else np.full((30, 48, 1), 3.3) for i, s in enumerate(specs)]
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "in.exr"), specs)
    for i, (spec, values) in enumerate(zip(specs, pixels)):
        assert i == 0 or out.open(str(tmp_path / "in.exr"), spec, "AppendSubimage")
        assert out.write_image(np.ascontiguousarray(values, np.float32))
    assert out.close()
    with pytest.warns(AirlightWarning, match="another size are not kept: small"):
        picture = read_image(tmp_path / "in.exr", layer="diffuse")
    np.testing.assert_array_equal(picture.codes, pixels[1])
    write_image(tmp_path / "out.exr", picture.linear(), picture, changed=np.zeros((30, 48), bool))
    spec, now = load(tmp_path / "out.exr")
    assert spec.get_int_attribute("oiio:subimages", 1) == 1 and (spec.x, spec.y) == (-3, 2)
    assert set(now) == {"R", "G", "B", "diffuse.R", "diffuse.G", "diffuse.B", "Z"}
    np.testing.assert_array_equal(now["G"], pixels[0][..., 1])
    np.testing.assert_array_equal(now["diffuse.G"], pixels[1][..., 1])
    assert np.all(now["Z"] == np.float32(3.3))


def test_input_layer(tmp_path, capsys):
    names = ["R", "G", "B", "A", "sky.R", "sky.G", "sky.B", "key.left.R", "key.left.G", "key.left.B", "Z"]
    beauty, sky, left = scene(channels=4), scene(seed=5) * 2, scene(seed=6)
    source = store(tmp_path / "in.exr", np.concatenate([beauty, sky, left, left[..., :1]], axis=2), names)
    run(source, "-o", tmp_path / "out.exr", "--light", "0.28,0.3", "--input-layer", "sky", "--layer", tmp_path / "alone.exr")
    _, was = load(source)
    _, now = load(tmp_path / "out.exr")
    assert set(now) == {*names, "airlight.R", "airlight.G", "airlight.B"}
    for name in names:
        if not name.startswith("sky"):
            np.testing.assert_array_equal(now[name], was[name])
    for name in "RGB":
        assert now[f"airlight.{name}"].max() > 0.01
        np.testing.assert_array_equal(now[f"sky.{name}"], (was[f"sky.{name}"] + now[f"airlight.{name}"]).astype(np.float16))
    _, alone = load(tmp_path / "alone.exr")
    assert set(alone) == {"R", "G", "B"}
    np.testing.assert_array_equal(alone["G"], now["airlight.G"])

    assert read_image(source, layer="key.left").channels == ("key.left.R", "key.left.G", "key.left.B")
    assert read_image(source, layer="RGBA").codes.shape[2] == 4
    says = refused(capsys, source, "-o", tmp_path / "no.exr", "--input-layer", "skye")
    assert "did you mean 'sky'" in says and "it has rgba, key.left, sky" in says
    write_image(tmp_path / "a.png", beauty[..., :3])
    assert "--input-layer" in refused(capsys, tmp_path / "a.png", "-o", tmp_path / "no.png", "--input-layer", "sky")


def test_blenders_combined_stands_in(tmp_path):
    names = [f"ViewLayer.{p}.{c}" for p in ("AO", "Combined") for c in "RGB"]
    picture = read_image(store(tmp_path / "in.exr", np.concatenate([scene(), scene(seed=9)], axis=2), names))
    assert picture.channels[0] == "ViewLayer.Combined.R" and len(picture.extra_names) == 6


def overscanned(tmp_path, pixels):
    """A picture whose display window is the inner 100 x 60 of 200 x 120, in three files: with overscan, whole, cropped."""
    window, inner = (-40, -30, 200, 120), (0, 0, 100, 60)
    return (
        store(tmp_path / "over.exr", pixels, data=window, display=inner),
        store(tmp_path / "whole.exr", pixels),
        store(tmp_path / "crop.exr", pixels[30:90, 40:140]),
    )


def test_overscan_is_the_extended_region(tmp_path):
    """GPU Gems 3, ch. 13.6: what lies beyond the border emits and hides as what lies within."""
    pixels = np.zeros((120, 200, 3), np.float32)
    pixels[50:70, 10:30] = 8  # a sun left of the display window, which begins at x = 40
    over, whole, crop = overscanned(tmp_path, pixels)
    method = ["--threshold", "1", "--border", "black"]
    run(over, "-o", tmp_path / "o.exr", "--light", "-0.2,0.5", *method)  # of the display window: pixel 20 of the whole
    run(whole, "-o", tmp_path / "w.exr", "--light", "0.1,0.5", *method)
    run(crop, "-o", tmp_path / "c.exr", "--light", "-0.2,0.5", *method)
    spec, with_it = load(tmp_path / "o.exr")
    assert (spec.x, spec.y, spec.full_width) == (-40, -30, 100)
    inside = with_it["airlight.R"][30:90, 40:140]
    assert inside[30].min() > 0.01
    assert load(tmp_path / "c.exr")[1]["airlight.R"].max() == 0
    np.testing.assert_allclose(inside, load(tmp_path / "w.exr")[1]["airlight.R"][30:90, 40:140], rtol=2e-3, atol=1e-5)

    pixels = np.full((120, 200, 3), 2, np.float32)  # all emits
    free, _, _ = overscanned(tmp_path, pixels)
    run(free, "-o", tmp_path / "f.exr", "--light", "-0.2,0.5", *method)
    pixels[59:62, 30:38] = 0  # an occluder in the overscan
    over, _, _ = overscanned(tmp_path, pixels)
    run(over, "-o", tmp_path / "h.exr", "--light", "-0.2,0.5", *method)
    hidden, lit = (load(tmp_path / name)[1]["airlight.R"][30:90, 40:140] for name in ("h.exr", "f.exr"))
    assert (hidden <= lit).all() and (hidden[30, :20] < 0.97 * lit[30, :20]).all()
    np.testing.assert_array_equal(hidden[0, -1], lit[0, -1])  # no ray from there passes it


@pytest.mark.parametrize("look", LOOKS)
def test_a_found_light_is_told_in_the_display_window(tmp_path, capsys, look):
    y, x = np.indices((120, 200))
    pixels = np.repeat(0.1 + 0.2 * (y / 120)[..., None], 3, axis=2).astype(np.float32)  # a sky
    pixels[np.hypot(x - 79.5, y - 59.5) < 6] = 50
    over, _, _ = overscanned(tmp_path, pixels)
    run(over, "-o", tmp_path / "a.exr", look=look)
    said = re.search(r"light at (\S+),(\S+) \((\d+)px,(\d+)px\)", capsys.readouterr().err)
    np.testing.assert_allclose([float(v) for v in said.groups()], [0.4, 0.5, 40, 30], atol=1.1)
    run(over, "-o", tmp_path / "b.exr", "--settings-from", tmp_path / "a.exr", look=look)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


@pytest.mark.parametrize(
    ("typed", "origin", "where"),
    [
        ("480px,810px", "bottom", (0.25, 0.25)),  # Nuke, Natron: pixels from the lower left of a 1920 x 1080 format
        ("0.25,0.75", "bottom", (0.25, 0.25)),  # Blender: parts of the image from the lower left
        ("960px,540px", "bottom", (0.5, 0.5)),
        ("-192px,1188px", "bottom", (-0.1, -0.1)),  # outside the format
        ("0.25,0.25", "top", (0.25, 0.25)),
    ],
)
def test_numbers_as_typed_elsewhere(tmp_path, typed, origin, where):
    page = (Path(__file__).parents[1] / "docs" / "compositing.md").read_text(encoding="utf-8")
    assert typed in page
    for data in ((0, 0, 1920, 1080), (-100, -50, 2120, 1180), (300, 200, 500, 400)):
        picture = type("P", (), {"data_window": data, "display_window": (0, 0, 1920, 1080), "width": data[2], "height": data[3]})
        x, y = place(read_light(typed), picture, origin).position
        np.testing.assert_allclose(((x * data[2] + data[0]) / 1920, (y * data[3] + data[1]) / 1080), where, atol=1e-12)


def test_spaces_agree_with_opencolorio():
    for name, primaries in (("ACEScg", AP1), ("ACES2065-1", spaces.CHROMATICITIES[5]), ("Linear P3-D65", spaces.CHROMATICITIES[2])):
        matrix, known = spaces.by_name(name)
        assert known == primaries
        np.testing.assert_allclose(spaces.to_rec709(primaries), matrix, atol=1e-6)
    assert spaces.by_name("lin_rec709_scene")[0] is None and spaces.to_rec709(spaces.CHROMATICITIES[0]) is None
    matrix, derived = spaces.by_name("Linear ARRI Wide Gamut 4")  # none of the known
    np.testing.assert_allclose(spaces.to_rec709(derived), matrix, atol=1e-6)
    for bad in ((0.0,) * 8, (np.nan,) * 8, (0.3, 0.3) * 4, (1e30,) * 8):
        with pytest.raises(ValueError, match="span no colours"):
            spaces.to_rec709(bad)


@pytest.mark.parametrize("by", ["name", "attribute"])
def test_shafts_are_computed_in_the_files_own_primaries(tmp_path, by):
    pixels = scene()
    pixels[10:13, 16:19] = (0.25, 9, 0.125)  # a green beyond Rec. 709, where its red is negative
    more = {"chromaticities": AP1} if by == "attribute" else {}
    source = store(tmp_path / "in.exr", pixels, **more)
    space = ["--colorspace", "ACEScg"] if by == "name" else []
    args = ["--light", "0.28,0.3", "--threshold", "4", "--smoothness", "1"]
    run(source, "-o", tmp_path / "out.exr", *space, *args)
    spec, now = load(tmp_path / "out.exr")
    np.testing.assert_allclose(spec.getattribute("chromaticities"), AP1, atol=1e-6)
    layer = np.stack([now[f"airlight.{c}"] for c in "RGB"], axis=2)
    weights = np.float32([0.2126, 0.7152, 0.0722]) @ spaces.to_rec709(AP1)
    p = Parameters(method="radial", samples=24, threshold=4.0, smoothness=1.0)
    emitted = ref.source(pixels, p, luminance=weights)
    assert 0 < emitted[11, 17, 0] <= 0.25  # red of the source is kept, though it is none of Rec. 709's
    lights = [place(read_light("0.28,0.3"), read_image(source))]
    truth = ref.layer(emitted, lights, msgspec.structs.replace(p, occlusion="none"))
    np.testing.assert_allclose(layer, truth, rtol=5e-3, atol=2e-4)
    np.testing.assert_allclose(fallback.layer(pixels, lights, p, luminance=weights), truth, rtol=1e-4, atol=1e-6)
    for i, name in enumerate("RGB"):
        untouched = layer.max(axis=2) == 0
        np.testing.assert_array_equal(now[name][untouched], pixels[..., i][untouched])
        np.testing.assert_array_equal(now[name], (pixels[..., i] + now[f"airlight.{name}"]).astype(np.float16))


def test_acescg_becomes_rec709_in_other_formats(tmp_path):
    pixels = np.full((16, 24, 3), (0.3, 0.3, 0.1), np.float32)
    source = store(tmp_path / "in.exr", pixels, kind="float")
    for name, at_most in (("o.png", 0.5 / 255), ("o.hdr", 3e-3), ("o.tif", 1e-6)):
        run(source, "-o", tmp_path / name, "--colorspace", "ACEScg", "--light", "0.5,0.5", "--exposure", "0", "--blend", "add")
        back = read_image(tmp_path / name).linear()[8, 8]
        np.testing.assert_allclose(back, spaces.to_rec709(AP1) @ pixels[0, 0], atol=max(at_most, 4e-3), rtol=0.02)
        run(source, "-o", tmp_path / name, "-y", "--light", "0.5,0.5", "--exposure", "0", "--blend", "add")
        np.testing.assert_allclose(read_image(tmp_path / name).linear()[8, 8], pixels[0, 0], atol=4e-3, rtol=0.02)


@pytest.mark.parametrize(
    ("name", "says"),
    [("ACESgc", "ACEScg"), ("lin_rec709_sceen", "lin_rec709_scene"), ("ACEScct", "not linear"), ("Raw", "not linear"), ("", "nearest")],
)
def test_colour_spaces_that_cannot_be(tmp_path, capsys, name, says):
    source = store(tmp_path / "in.exr", scene())
    assert says in refused(capsys, source, "-o", tmp_path / "o.exr", "--colorspace", name)
    assert not (tmp_path / "o.exr").exists()


def test_colour_space_of_integers_and_a_broken_config(tmp_path, capsys, monkeypatch):
    write_image(tmp_path / "in.png", scene() / 40)
    assert "integers" in refused(capsys, tmp_path / "in.png", "-o", tmp_path / "o.png", "--colorspace", "ACEScg")
    source = store(tmp_path / "in.exr", scene())
    monkeypatch.setenv("OCIO", str(tmp_path / "none.ocio"))
    assert "$OCIO" in refused(capsys, source, "-o", tmp_path / "o.exr", "--colorspace", "ACEScg")
    import PyOpenColorIO as ocio

    (tmp_path / "mine.ocio").write_text(ocio.Config.CreateFromBuiltinConfig("ocio://cg-config-latest").serialize(), encoding="utf-8")
    monkeypatch.setenv("OCIO", str(tmp_path / "mine.ocio"))
    assert spaces.by_name("ACEScg")[1] == AP1
    with pytest.raises(AirlightError, match=r"not in \$OCIO"):
        spaces.by_name("Linear ARRI Wide Gamut 4")


def test_senseless_chromaticities_are_told(tmp_path):
    source = store(tmp_path / "in.exr", scene(), chromaticities=(0.3, 0.3) * 4)
    with pytest.warns(AirlightWarning, match="taken as Rec. 709"):
        assert read_image(source).to_709 is None


SET = ["--decay", "0.9", "--preset", "pmndrs", "--light", "0.28,0.3;color=1,0.8,0.6;strength=2", "--light", "100%,20px", "--veil", "0.1"]


@pytest.mark.parametrize("extension", ["exr", "png", "jpg", "tif"])
def test_settings_survive_and_repeat_to_the_byte(tmp_path, extension):
    source = tmp_path / "in.png"
    write_image(source, scene() / 40)
    one, two, three = (tmp_path / f"{n}.{extension}" for n in ("one", "two", "three"))
    args = [a for a in SET]
    assert main(["image", str(source), "-o", str(one), *args]) == 0
    spec, _ = load(one)
    key = "airlight:settings" if extension in ("exr", "png") else "Software"
    text = spec.get_string_attribute(key).removeprefix("Airlight ")
    said = json.loads(text)
    assert said["light"] == ["0.28,0.3;color=1.0,0.8,0.6;strength=2.0", "1.0,0.5"]
    assert (said["decay"], said["samples"], said["preset"], said["veil"]) == (0.9, 60, "pmndrs", 0.1) and not {"border", "threshold"} & set(
        said
    )
    assert read_settings(one) == text
    assert main(["image", str(source), "-o", str(two), "--settings-from", str(one)]) == 0
    assert two.read_bytes() == one.read_bytes()
    assert main(["image", str(source), "-o", str(three), "--settings-from", str(one), "--decay", "0.95", "--light", "0,0"]) == 0
    again = json.loads(read_settings(three))
    assert (again["decay"], again["light"], again["samples"]) == (0.95, ["0.0,0.0"], 60)


def test_settings_hold_everything_that_shapes_the_result(tmp_path, capsys):
    names = ["R", "G", "B", "sky.R", "sky.G", "sky.B"]
    height, width, _ = thumbs.linear().shape
    source = store(tmp_path / "in.exr", np.concatenate([scene(width, height), thumbs.linear()], axis=2), names)
    write_image(tmp_path / "mask.png", np.tile(np.linspace(0, 1, width, dtype=np.float32)[None, :, None], (height, 1, 3)))
    args = ["--input-layer", "sky", "--colorspace", "ACEScg", "--mask", tmp_path / "mask.png", "--mask-invert", "--light", "auto"]
    run(source, "-o", tmp_path / "a.exr", *args, "--depth", tmp_path / "mask.png", "--depth-near", "white", "--threshold", "0.3")
    assert "light at" in capsys.readouterr().err
    run(source, "-o", tmp_path / "b.exr", "--settings-from", tmp_path / "a.exr", "--origin", "bottom")
    said = capsys.readouterr().err  # the light is not sought again, nor turned upside down
    assert said == "the light is that of the settings; --light auto finds each picture's own\n"
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


@pytest.mark.parametrize("extension", ["hdr", "webp"])
@pytest.mark.parametrize("look", LOOKS)
def test_formats_that_hold_no_settings_say_so(tmp_path, capsys, extension, look):
    write_image(tmp_path / "in.png", scene() / 40)
    made = tmp_path / f"made.{extension}"
    run(tmp_path / "in.png", "-o", made, "--light", "0.2,0.1", look=look)
    assert "settings" not in capsys.readouterr().err
    said = refused(capsys, tmp_path / "in.png", "-o", tmp_path / "o.png", "--settings-from", made)
    assert "holds no settings" in said and "EXR, PNG, TIFF, JPEG, JPEG XL and AVIF" in said and said.count("\n") <= 1


@pytest.mark.parametrize("look", LOOKS)
def test_settings_leave_the_input_its_own_words(tmp_path, look):
    codes = np.random.default_rng(0).integers(0, 256, (40, 64, 3), dtype=np.uint8)
    out = oiio.ImageOutput.create("jpeg")
    spec = oiio.ImageSpec(64, 40, 3, "uint8")
    spec.attribute("ImageDescription", "A day at the sea")
    spec.attribute("Software", "Darkroom 3")
    assert out.open(str(tmp_path / "in.jpg"), spec) and out.write_image(codes) and out.close()
    for extension in ("jpg", "tif", "png", "exr"):
        run(tmp_path / "in.jpg", "-o", tmp_path / f"o.{extension}", "--light", "0,0", look=look)
        spec, _ = load(tmp_path / f"o.{extension}")
        assert spec.get_string_attribute("ImageDescription") == "A day at the sea"
        assert extension in ("jpg", "tif") or spec.get_string_attribute("Software") == "Darkroom 3"
        run(tmp_path / f"o.{extension}", "-o", tmp_path / "p.webp", "-y", "--light", "0,0", look=look)  # old settings are not carried along
        write_image(
            tmp_path / "q.png", read_image(tmp_path / f"o.{extension}").linear(), read_image(tmp_path / f"o.{extension}"), overwrite=True
        )
        with pytest.raises(AirlightError, match="no settings"):
            read_settings(str(tmp_path / "q.png"))


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("text", ['"' * 30000, "é" * 60000, "x" * 200000])
def test_long_metadata_does_not_end_a_jpeg(tmp_path, text, look):
    """Libjpeg ends the process where a block of metadata is longer than 64 KiB."""
    source = store(tmp_path / "in.exr", scene() / 40, ImageDescription=text, Copyright="me")
    import subprocess
    import sys

    command = [sys.executable, "-m", "airlight", "image"]
    done = subprocess.run(
        [*command, source, "-o", tmp_path / "o.jpg", "--light", "0,0", *LOOKS[look]], capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    assert load(tmp_path / "o.jpg")[0].get_string_attribute("Copyright") == "me"


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (None, "no settings"),
        ("{", "damaged"),
        ("[1]", "damaged"),
        ("[" * 5000, "damaged"),
        ('{"decai": 0.9}', "'decai'"),
        ('{"decay": 7}', "--decay"),
        ('{"decay": {"a": 1}}', "'decay'"),
        ('{"method": "magic"}', "--method"),
        ('{"light": ["x"]}', "light position"),
        ('{"light": [[1]]}', "'light'"),
    ],
)
def test_settings_that_cannot_be_used(tmp_path, capsys, settings, says):
    write_image(tmp_path / "in.png", scene() / 40, settings=settings)
    assert says in refused(capsys, tmp_path / "in.png", "-o", tmp_path / "o.png", "--settings-from", tmp_path / "in.png")
    assert says == "no settings" or main(["image", str(tmp_path / "in.png"), "-o", str(tmp_path / "o.png"), "--light", "0,0"]) == 0
