"""EXR channels by the names that programs give them, and luminance with chroma."""

import warnings

import colour_files as files
import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import codes_like, store

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import channels, read_image

RGBA = (np.random.default_rng(2).random((12, 16, 4)) * 3).astype(np.float16).astype(np.float32)
RGBA[..., 3] = 1


def exr(path, *names, more=(), **attributes):
    """Store the first channels of RGBA by these names, and `more` of zeros."""
    pixels = np.concatenate([RGBA[..., : len(names)], np.zeros((12, 16, len(more)), np.float32)], axis=2)
    return store(path, pixels, "half", (*names, *more), **attributes)


@pytest.mark.parametrize(
    ("names", "more", "layer"),
    [
        (("R", "G", "B", "A"), (), ""),
        (("r", "g", "b", "a"), ("Z",), ""),
        (("red", "green", "blue", "alpha"), (), ""),
        (("Red", "Green", "Blue"), (), ""),
        (("R", "G", "B"), ("beauty.R", "beauty.G", "beauty.B"), ""),
        (("beauty.red", "beauty.green", "beauty.blue", "beauty.alpha"), (), "beauty"),
        (("ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "ViewLayer.Combined.A"), ("ViewLayer.Depth.Z",), None),
        (("Composite.Combined.R", "Composite.Combined.G", "Composite.Combined.B"), tuple(f"A.Combined.{c}" for c in "RGB"), None),
        (("RGBA.R", "RGBA.G", "RGBA.B", "RGBA.A"), ("N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"), "RGBA"),
        (("Ci.r", "Ci.g", "Ci.b"), ("albedo.r", "albedo.g", "albedo.b"), "Ci"),
        (("FinalImage.R", "FinalImage.G", "FinalImage.B", "FinalImage.A"), ("ActorHit.R", "ActorHit.G", "ActorHit.B"), "FinalImage"),
        (("beauty_R", "beauty_G", "beauty_B"), ("N.x", "N.y", "N.z"), "beauty"),
        (("Beauty.R", "Beauty.G", "Beauty.B"), ("Z", "diffuse.R", "diffuse.G", "diffuse.B"), "beauty"),
    ],
)
def test_names_of_programs(tmp_path, names, more, layer):
    path = exr(tmp_path / "in.exr", *names, more=more)
    picture = read_image(path)
    np.testing.assert_array_equal(picture.codes, RGBA[..., : len(names)])
    assert (picture.alpha is not None) == (len(names) == 4)
    if layer:
        np.testing.assert_array_equal(read_image(path, layer=layer).codes, picture.codes)
    out = tmp_path / "out.exr"
    assert main(["image", str(path), "-o", str(out), "--light", "0.5,0.5;strength=0"]) == 0
    inp = oiio.ImageInput.open(str(out))
    kept = list(inp.spec().channelnames)
    pixels = inp.read_image("float")
    np.testing.assert_array_equal(pixels[..., [kept.index(c) for c in "RGBA"[: len(names)]]], RGBA[..., : len(names)])
    assert set(kept) >= set(more) and (layer == "" or set(kept) >= set(names))


def test_a_choice_is_told(tmp_path):
    path = exr(tmp_path / "in.exr", "sky.R", "sky.G", "sky.B", more=("tree.R", "tree.G", "tree.B", "N.X", "N.Y", "N.Z"))
    with pytest.warns(AirlightWarning, match=r"sky is used, --input-layer chooses another \(tree\)"):
        np.testing.assert_array_equal(read_image(path).codes, RGBA[..., :3])
    two = exr(tmp_path / "two.exr", "Back.Combined.R", "Back.Combined.G", "Back.Combined.B", more=[f"Front.Combined.{c}" for c in "RGB"])
    with pytest.warns(AirlightWarning, match=r"Back.Combined is used.*Front.Combined"):
        read_image(two)


def test_a_vector_is_no_grey_picture():
    names = ["N.x", "N.y", "N.z", "P.X", "P.Y", "P.Z"]
    assert channels.layers(names, -1, [True] * 6) == {}
    assert channels.layers(["Y", "Z"], -1, [True] * 2) == {"": [0]}


def luminance_chroma(path, step, layer=""):
    """Store the picture of RGBA as Y, RY, BY, a chroma every `step` pixels: its values as halves hold them."""
    rgb = RGBA[..., :3] + 0.1
    y = rgb @ (0.2126390059, 0.7151686788, 0.0721923154)
    chroma = {"RY": (rgb[..., 0] - y) / y, "BY": (rgb[..., 2] - y) / y}
    planes = {f"{layer}{name}": (values[::step, ::step], step) for name, values in chroma.items()}
    return files.exr(path, {f"{layer}Y": (y, 1), **planes}, 12, 16), rgb


@pytest.mark.parametrize("layer", ["", "beauty."])
def test_luminance_and_chroma(tmp_path, layer):
    path, rgb = luminance_chroma(tmp_path / "yc.exr", 1, layer)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        picture = read_image(path)
    assert picture.channels == tuple(f"{layer}{c}" for c in "RGB")
    np.testing.assert_allclose(picture.codes, rgb, atol=0.02)
    assert main(["image", str(path), "-o", str(tmp_path / "out.exr"), "--light", "0.5,0.5;strength=0"]) == 0
    np.testing.assert_allclose(read_image(tmp_path / "out.exr").codes, rgb, atol=0.02)


def test_subsampled_chroma_is_refused_by_what_it_is(tmp_path):
    path, _ = luminance_chroma(tmp_path / "yc.exr", 2)
    with pytest.raises(AirlightError, match="subsampled channels, as chroma beside luminance; save it with R, G, B"):
        read_image(path)


def test_a_reader_says_why(tmp_path):
    """Not that of the last format that was tried."""
    path = exr(tmp_path / "in.exr", "R", "G", "B")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(AirlightError, match="End of file") as caught:
        read_image(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("names", "kept"), [(("X", "Y", "Z"), ("X", "Y", "Z")), (("R", "G"), ("input.R", "input.G"))])
def test_channels_that_are_no_colours_keep_their_values(tmp_path, names, kept):
    """X Y Z, or R G, alone are a position or a vector: an EXR made of them keeps theirs, under another name where the picture has it."""
    values = codes_like("float32")[..., : len(names)]
    source = store(tmp_path / "a.exr", values, "half", names)
    assert main(["image", str(source), "-o", str(tmp_path / "b.exr"), "--light", "0.5,0.5", "--warmth", "0.5", "--rays", "9"]) == 0
    made = read_image(tmp_path / "b.exr")
    assert made.channels == ("R", "G", "B")
    for name, value in zip(kept, np.moveaxis(values, -1, 0), strict=True):
        np.testing.assert_array_equal(made.extra[..., made.extra_names.index(name)], value)


@pytest.mark.parametrize("layer", ["crypto_object00", "matte", "ViewLayer.Diffuse"])
def test_alpha_of_another_layer_is_none_of_the_picture(tmp_path, layer):
    """A picture of R G B without alpha has none, though a layer beside it has: a coverage, say."""
    more = tuple(f"{layer}.{c}" for c in "RGBA")
    source = exr(tmp_path / "a.exr", "R", "G", "B", more=more)
    picture = read_image(source)
    assert picture.alpha is None and set(picture.extra_names) == set(more)
    assert main(["image", str(source), "-o", str(tmp_path / "b.exr"), "--light", "0.5,0.5;strength=0"]) == 0
    made = read_image(tmp_path / "b.exr")
    assert made.channels == ("R", "G", "B") and set(more) <= set(made.extra_names)


def test_names_that_are_not_utf_8(tmp_path):
    path = exr(tmp_path / "in.exr", *(f"beau?ty.{c}" for c in "RGB"), more=("R?", "G?"), Artist="Ren?e")
    path.write_bytes(path.read_bytes().replace(b"beau?ty", b"beau\xe9ty").replace(b"R?", b"R\x80").replace(b"Ren?e", b"Ren\xe9e"))
    out = tmp_path / "out.exr"
    assert main(["image", str(path), "-o", str(out), "--light", "0.5,0.5;strength=0"]) == 0
    spec = oiio.ImageInput.open(str(out)).spec()
    assert set(spec.channelnames) >= {"beauéty.R", "beauéty.G", "beauéty.B", "R\x80", "G?"}
    assert spec.get_string_attribute("Artist") == "Renée"
    np.testing.assert_array_equal(read_image(out, layer="beauéty").codes, RGBA[..., :3])
