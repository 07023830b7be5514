"""Writing image files: codes, layers and metadata that come back; what is refused; nothing half written."""

import os

import numpy as np
import OpenImageIO as oiio
import pytest
from picture_files import NOTHING, codes_like, store

from airlight.errors import AirlightError, MachineError
from airlight.files import atomic, check_output, read_image, read_mask, write_image
from airlight.options.storage import Storage


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
    write_image(tmp_path / "b.exr", picture.linear() + 1e6, picture, layer=layer, storage=Storage(compression="zips"))
    again = read_image(tmp_path / "b.exr")
    assert again.data_window == picture.data_window and again.display_window == picture.display_window
    assert again.codes[..., :3].max() == 65504
    np.testing.assert_array_equal(again.codes[..., 3], picture.codes[..., 3])
    np.testing.assert_array_equal(again.extra, picture.extra)
    assert again.spec.get_string_attribute("Copyright") == "me"
    assert set(again.spec.channelnames) == {*names, "airlight.R", "airlight.G", "airlight.B"}
    depth = read_mask(tmp_path / "b.exr", depth=True)
    assert depth[0, 0] == depth.max() == codes[5, 47, 4]


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


@pytest.mark.parametrize("compression", ["none", "zip", "zips", "piz"])
@pytest.mark.parametrize("damage", ["tail", "middle", "offset", "row", "whole", "header"])
def test_a_damaged_write_is_noticed(tmp_path, monkeypatch, compression, damage):
    """Of an EXR not all rows are decoded again; what an encoder may leave out is noticed all the same, and nothing is left."""
    from airlight.files import writing

    true = writing.encode_file
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

    monkeypatch.setattr(writing, "encode_file", encode)
    with pytest.raises(MachineError, match="read back"):
        write_image(tmp_path / "out.exr", picture.linear() * 2, picture)
    assert [p.name for p in tmp_path.iterdir()] == ["in.exr"]
    monkeypatch.setattr(writing, "encode_file", true)
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
