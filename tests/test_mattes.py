"""Masks out of EXRs: channels, objects of a Cryptomatte, views of a stereo picture."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import cryptomatte, read_image, read_mask, write_image
from airlight.files.planes_of import plane_of_file, plane_of_picture

H, W = 24, 32
LIT = ["--light", "0.5,0.5", "-y"]


def exr(path, channels, **attributes):
    """Store channels, by name (H, W), as floats."""
    spec = oiio.ImageSpec(W, H, len(channels), "float")
    spec.channelnames = tuple(channels)
    for name, value in attributes.items():
        name = name.replace("__", "/")
        if isinstance(value, tuple):
            spec.attribute(name, f"string[{len(value)}]", value)
        else:
            spec.attribute(name, value)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), spec) and out.write_image(np.stack(list(channels.values()), 2).astype(np.float32)) and out.close()
    return str(path)


def parts(path, *found):
    """Store an EXR of parts, each (name, view, channels)."""
    specs = []
    for name, view, channels in found:
        spec = oiio.ImageSpec(W, H, len(channels), "float")
        spec.channelnames = tuple(channels)
        spec.attribute("oiio:subimagename", name)
        if view:
            spec.attribute("view", view)
        specs.append(spec)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), specs)
    for i, (_, _, channels) in enumerate(found):
        assert i == 0 or out.open(str(path), specs[i], "AppendSubimage")
        assert out.write_image(np.stack(list(channels.values()), 2).astype(np.float32))
    assert out.close()
    return str(path)


def flat(value):
    return np.full((H, W), value, np.float32)


def colours(value, before=""):
    return {f"{before}{c}": flat(value) for c in "RGB"}


def as_float(name):
    return np.array([cryptomatte.identifier(name)], np.uint32).view(np.float32)[0]


def crypto(matte="crypto_object", manifest=True, beside=None):
    """Two trees that share a column by halves, and a rock: the left third Tree_1, the right Tree_2, the rock in the last column."""
    ids, covers = np.zeros((4, H, W), np.float32), np.zeros((4, H, W), np.float32)
    ids[0, :, :12], covers[0, :, :11] = as_float("Tree_1"), 1
    ids[0, :, 12:31], covers[0, :, 12:31] = as_float("Tree_2"), 1
    ids[1, :, 11], covers[1, :, 11], covers[0, :, 11] = as_float("Tree_2"), 0.25, 0.75
    ids[0, :, 31], covers[0, :, 31] = as_float("rock/größe"), 1
    ids[2, :, 5], covers[2, :, 5] = as_float("rock/größe"), 0.125  # of a second layer
    channels = {}
    for rank, (a, b) in enumerate(((0, 1), (2, 3))):
        values = (ids[a], covers[a], ids[b], covers[b])
        channels |= {f"{matte}{rank:02d}.{c}": value for c, value in zip("RGBA", values, strict=True)}
    key = "cryptomatte__1234567"
    attributes = {f"{key}__name": matte, f"{key}__hash": "MurmurHash3_32", f"{key}__conversion": "uint32_to_float32"}
    names = {name: f"{cryptomatte.identifier(name):08x}" for name in ("Tree_1", "Tree_2", "rock/größe", "unseen")}
    if beside is not None:
        beside.write_text(json.dumps(names), encoding="utf-8")
        attributes[f"{key}__manif_file"] = beside.name
    elif manifest:
        attributes[f"{key}__manifest"] = json.dumps(names)
    return channels, attributes


def test_hashes():
    """Source of the numbers: smhasher's own test, and Python's mmh3."""
    expected = {"": 0, "hello": 0x248BFA47, "hello, world": 0x149BBB7F, "The quick brown fox jumps over the lazy dog": 0x2E4FF723}
    assert {text: cryptomatte.murmur3(text) for text in expected} == expected
    assert np.isfinite([as_float(str(i)) for i in range(2000)]).all()


@pytest.mark.parametrize("how", ["manifest", "none", "beside"])
def test_objects_by_name(tmp_path, how):
    channels, attributes = crypto(manifest=how == "manifest", beside=tmp_path / "names.json" if how == "beside" else None)
    path = exr(tmp_path / "a.exr", colours(0.5) | channels, **attributes)
    picture = read_image(path)
    expected = np.zeros(W, np.float32)
    expected[:11], expected[11] = 1, 0.75
    for plane in (plane_of_file(path, "crypto_object/Tree_1"), plane_of_picture(picture, "crypto_object/Tree_1")):
        np.testing.assert_array_equal(plane, np.tile(expected, (H, 1)))
    expected[:] = 0
    expected[31], expected[5] = 1, 0.125
    np.testing.assert_array_equal(plane_of_file(path, "crypto_object/rock/größe")[3], expected)
    if how == "none":
        with pytest.raises(AirlightError, match="no pixel of its Cryptomatte crypto_object is of 'Tree_9', and it lists no names"):
            plane_of_file(path, "crypto_object/Tree_9")
        return
    np.testing.assert_array_equal(plane_of_file(path, "Tree_*")[3], (np.arange(W) < 31).astype(np.float32))
    assert not plane_of_file(path, "unseen").any()
    with pytest.raises(AirlightError, match="has no object 'Tree_9'; it has Tree_"):
        plane_of_file(path, "crypto_object/Tree_9")
    with pytest.raises(AirlightError, match=r"has no channel 'tree_2'.*did you mean.*'Tree_2'.*it has R, G, B and the objects"):
        plane_of_file(path, "tree_2")


def test_names_as_renderers_write_them(tmp_path):
    """Blender's layers stand before, in capitals; further parts have manifests of their own."""
    channels, attributes = crypto("CryptoObject")
    channels = {f"ViewLayer.{name}".replace(".R", ".r").replace(".G", ".g"): value for name, value in channels.items()}
    path = exr(tmp_path / "a.exr", colours(0.5, "ViewLayer.Combined.") | channels, **attributes)
    assert plane_of_file(path, "Tree_2")[0, 20] == 1
    channels, attributes = crypto()
    spec = oiio.ImageSpec(W, H, 3, "half")
    spec.attribute("oiio:subimagename", "rgba")
    second = oiio.ImageSpec(W, H, len(channels), "float")
    second.channelnames = tuple(channels)
    second.attribute("oiio:subimagename", "crypto")
    for name, value in attributes.items():
        second.attribute(name.replace("__", "/"), value)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "b.exr"), [spec, second]) and out.write_image(np.stack(list(colours(0.5).values()), 2))
    assert out.open(str(tmp_path / "b.exr"), second, "AppendSubimage")
    assert out.write_image(np.stack(list(channels.values()), 2)) and out.close()
    assert plane_of_file(str(tmp_path / "b.exr"), "Tree_2")[0, 20] == 1
    picture = read_image(tmp_path / "b.exr")
    write_image(tmp_path / "c.exr", picture.linear(), picture)  # the mattes go on
    assert plane_of_file(str(tmp_path / "c.exr"), "Tree_2")[0, 20] == 1
    write_image(tmp_path / "c.png", np.clip(picture.linear(), 0, 1), None)
    assert not any(item.name.startswith("cryptomatte") for item in read_image(tmp_path / "c.png").spec.extra_attribs)


@pytest.mark.parametrize("manifest", ["{", "[1]", '{"a": 1}', '{"a": "xyz"}', "[" * 100000])
def test_a_broken_manifest_is_none(tmp_path, manifest):
    channels, attributes = crypto()
    attributes["cryptomatte__1234567__manifest"] = manifest
    assert plane_of_file(exr(tmp_path / "a.exr", channels, **attributes), "crypto_object/Tree_2")[0, 20] == 1


def test_channels_and_layers(tmp_path):
    path = exr(tmp_path / "a.exr", colours(0.5) | {"matte.A": flat(0.25), "Z": flat(np.inf), "id.x": flat(3)} | colours(0.75, "key."))
    assert plane_of_file(path, "matte.a")[0, 0] == plane_of_file(path, "matte")[0, 0] == 0.25
    assert plane_of_file(path, "key")[0, 0] == pytest.approx(0.75) and plane_of_file(path, "key.G")[0, 0] == 0.75
    assert plane_of_file(path, "R")[0, 0] == 0.5
    with pytest.raises(AirlightError, match=r"did you mean 'matte.A'\? \(it has R, G, B, Z, id.x, key.R, key.G, key.B\)"):
        plane_of_file(path, "mate.A")
    png = tmp_path / "a.png"
    write_image(png, np.zeros((H, W, 3), np.float32))
    with pytest.raises(AirlightError, match="no EXR"):
        plane_of_file(png, "A")


def test_masks_by_the_command(tmp_path, capsys):
    """Only the tree shines: with the name of the tree, the picture is that with a mask drawn by hand."""
    channels, attributes = crypto()
    source = exr(tmp_path / "a.exr", colours(0.5) | channels, **attributes)
    drawn = exr(tmp_path / "mask.exr", {"Y": plane_of_file(source, "Tree_1")})
    outs = [tmp_path / f"{n}.exr" for n in range(4)]
    for out, options in zip(
        outs,
        (
            ["--mask", drawn],
            ["--mask-layer", "Tree_1"],
            ["--mask", source, "--mask-layer", "crypto_object/Tree_1"],
            ["--mask-layer", "rock*"],
        ),
        strict=True,
    ):
        assert main(["image", source, "-o", str(out), *options, *LIT, "--look", "classic", "--threshold", "0"]) == 0
    pixels = [read_image(out).linear() for out in outs]
    np.testing.assert_array_equal(pixels[1], pixels[0])
    np.testing.assert_array_equal(pixels[2], pixels[0])
    assert (pixels[3] != pixels[0]).any()
    capsys.readouterr()
    assert main(["image", source, "-o", str(tmp_path / "x.exr"), "--mask-layer", "Tree", *LIT]) == 2
    said = capsys.readouterr().err
    assert "did you mean 'Tree_" in said and said.count("\n") == 1


def test_depths_of_another_file(tmp_path):
    source = exr(tmp_path / "a.exr", colours(0.5))
    far = np.tile(np.linspace(1, 9, W, dtype=np.float32), (H, 1))
    depths = exr(tmp_path / "z.exr", {"distance.z": far, "Z": flat(1)})
    from airlight.jobs.planes import Reading

    reading = Reading(depth_layer="distance.z")
    np.testing.assert_array_equal(reading.depth(depths, reading.picture(source)), far)


@pytest.mark.parametrize("kind", ["one part", "parts"])
def test_views(tmp_path, kind, capsys):
    """The first view is the default, of which a line tells; another takes its own channels, and the others stay."""
    path = tmp_path / "a.exr"
    if kind == "parts":
        left, right = colours(0.25) | {"Z": flat(1)}, colours(0.75) | {"Z": flat(2)}
        parts(path, ("rgb_left", "left", left), ("rgb_right", "right", right), ("d", "right", colours(0.125, "diffuse.")))
    else:
        more = colours(0.125, "diffuse.right.") | {"Z": flat(1), "right.Z": flat(2)}
        exr(path, colours(0.25) | colours(0.75, "right.") | more, multiView=("left", "right"))
    with pytest.warns(AirlightWarning, match="holds the views left, right; left is used .--view names another"):
        assert read_image(path).linear().max() == 0.25
    assert read_image(path, view="left").linear().max() == 0.25
    picture = read_image(path, view="right")
    assert picture.linear().max() == picture.linear().min() == 0.75
    assert read_image(path, view="right", layer="diffuse").linear().max() == 0.125
    assert plane_of_picture(picture, "Z", "right").max() == plane_of_file(path, "Z", view="right").max() == 2
    assert plane_of_picture(picture, "Z").max() == 1
    assert read_mask(path, depth=True, view="right").max() == 2 and read_mask(path, depth=True, view="left").max() == 1
    with pytest.raises(AirlightError, match="has no view 'middle'; it has left, right"):
        read_image(path, view="middle")
    write_image(tmp_path / "b.exr", picture.linear() * 2, picture)
    assert read_image(tmp_path / "b.exr", view="right").linear().max() == 1.5
    assert read_image(tmp_path / "b.exr", view="left").linear().max() == 0.25
    assert main(["image", str(path), "-o", str(tmp_path / "c.exr"), "--view", "right", "--light", "0.5,0.5;strength=0"]) == 0
    assert "the views" not in capsys.readouterr().err
    assert read_image(tmp_path / "c.exr", view="right").linear().max() == 0.75


def test_shafts_of_two_views(tmp_path, capsys):
    """Each view has its layer, as multi-view EXRs name it; a second run keeps that of the first."""
    one = colours(0.1)
    for c in "RGB":
        one[c] = one[c].copy()
        one[c][4:8, 5:20:3] = 1
    two = one | {f"right.{name}": values for name, values in one.items()} | {"Z": flat(1)}
    path = exr(tmp_path / "a.exr", two, multiView=("left", "right"))
    light = ["--light", "0.5,0.5", "--look", "classic", "--threshold", "0.5"]
    assert main(["image", str(path), "-o", str(tmp_path / "b.exr"), "--view", "right", *light]) == 0
    names = oiio.ImageBuf(str(tmp_path / "b.exr")).spec().channelnames
    assert "airlight.right.R" in names and "airlight.R" not in names
    assert main(["image", str(tmp_path / "b.exr"), "-o", str(tmp_path / "c.exr"), "--view", "left", *light]) == 0
    both = oiio.ImageBuf(str(tmp_path / "c.exr")).spec().channelnames
    assert sorted(both) == sorted([*names, *(f"airlight.{c}" for c in "RGB")])
    assert main(["image", str(tmp_path / "c.exr"), "-o", str(tmp_path / "d.exr"), "--view", "right", *light]) == 0
    assert sorted(oiio.ImageBuf(str(tmp_path / "d.exr")).spec().channelnames) == sorted(both)
    capsys.readouterr()
    assert main(["image", str(path), "-o", str(tmp_path / "a.png"), "--view", "right", *light]) == 0
    assert "cannot keep the view left; use .exr" in capsys.readouterr().err


def test_a_clip_of_two_views_tells_them_once(tmp_path, capsys):
    for k in (1, 2, 3):
        exr(tmp_path / f"a.{k}.exr", colours(0.5) | colours(0.5, "right."), multiView=("left", "right"))
    assert main(["image", str(tmp_path / "a.%d.exr"), "-o", str(tmp_path / "b.%d.exr"), "--light", "0.5,0.5;strength=0"]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "the views" in line]
    assert len(lines) == 2 and "a.1.exr: holds the views left, right" in lines[0] and "2 more: holds the views" in lines[1]


def test_a_picture_of_one_view(tmp_path):
    path = exr(tmp_path / "a.exr", colours(0.5))
    with pytest.raises(AirlightError, match="is of one view: leave --view out"):
        read_image(path, view="right")
    write_image(tmp_path / "a.png", np.zeros((H, W, 3), np.float32))
    with pytest.raises(AirlightError, match="is of one view"):
        read_image(tmp_path / "a.png", view="right")


@pytest.mark.parametrize("at", [(0, 0), (5, 3), (-2, -4), (20, 20), (40, 0)])
def test_a_cropped_matte_lies_where_it_was(tmp_path, at):
    """The data window of mattes is often smaller than the picture's; beyond it there is nothing, and depths are far."""
    picture = read_image(exr(tmp_path / "a.exr", colours(0.5)))
    matte = np.arange(1, 61, dtype=np.float32).reshape(6, 10)
    spec = oiio.ImageSpec(10, 6, 1, "float")
    spec.channelnames, (spec.x, spec.y) = ("matte.A",), at
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, W, H
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "m.exr"), spec) and out.write_image(matte[..., None]) and out.close()
    for far, beyond in ((False, 0), (True, 60)):
        expected = np.full((H + 100, W + 100), beyond, np.float32)
        expected[at[1] + 50 : at[1] + 56, at[0] + 50 : at[0] + 60] = matte
        found = plane_of_file(str(tmp_path / "m.exr"), "matte.A", like=picture, far=far)
        np.testing.assert_array_equal(found, expected[50 : 50 + H, 50 : 50 + W])
    assert plane_of_file(str(tmp_path / "m.exr"), "matte.A").shape == (6, 10)


@pytest.mark.parametrize("names", [("key.red", "key.green", "key.blue"), ("key_R", "key_G", "key_B"), ("Key:r", "Key:g", "Key:b")])
def test_layers_in_spellings_of_renderers(tmp_path, names):
    file = exr(tmp_path / "a.exr", colours(0.5) | {name: flat(0.25) for name in names})
    np.testing.assert_allclose(plane_of_file(file, "key"), 0.25, atol=1e-6)


def test_alpha_of_a_further_part_is_none_of_the_picture(tmp_path):
    file = parts(tmp_path / "a.exr", ("rgb", "", colours(0.5)), ("matte", "", colours(0) | {"A": flat(0.25), "Z": flat(3)}))
    picture = read_image(file)
    assert picture.alpha is None and picture.extra_names == ("matte.R", "matte.G", "matte.B", "matte.A", "Z")
    np.testing.assert_array_equal(plane_of_picture(picture, "matte.A"), 0.25)
