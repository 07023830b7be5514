"""Folders as input: which files are taken, in which order, and where they go."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from airlight.cli import main
from airlight.errors import AirlightError
from airlight.files import read_image, write_image
from airlight.files.folder import clip_of, natural, pictures_in
from airlight.process import temporaries

LIGHT = ["--light", "0.5,0.5;strength=0"]  # changes nothing


def put(path: Path, value: float = 0.5) -> Path:
    path.parent.mkdir(exist_ok=True)
    write_image(path, np.full((4, 6, 3), value, np.float32))
    return path


def call(*args: object) -> int:
    return main(["image", *[str(a) for a in args]])


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """Four pictures, of which one cannot be written in its own format and one has a wrong ending; and what is none."""
    folder = tmp_path / "photos"
    for name in ("a10.png", "a2.jpg", "b.tif"):
        put(folder / name)
    os.rename(put(folder / "c.png"), folder / "c.txt")
    Image.new("RGB", (6, 4), (128, 128, 128)).save(folder / "B.bmp")
    (folder / "notes.md").write_text("no picture")
    (folder / "empty").touch()
    (folder / ".DS_Store").write_text("hidden")
    put(folder / "raw" / "d.png")
    return folder


def test_pictures_in_natural_order(photos):
    found, files, folders = pictures_in(str(photos))
    assert [os.path.basename(path) for path in found] == ["a2.jpg", "a10.png", "B.bmp", "b.tif", "c.txt"]
    assert (files, folders) == (2, 1)
    assert sorted(["x10y2", "x9", "X1", "x10y10", "10", "9"], key=natural) == ["9", "10", "X1", "x9", "x10y2", "x10y10"]


def test_a_folder_into_a_folder_that_is_made(photos, tmp_path, capsys):
    (photos / "b.tif").rename(photos / "e.tif")
    assert call(photos, "-o", tmp_path / "out", *LIGHT) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[0] == f"{photos}: left out: 2 files that are no pictures, 1 folder" and said[-1] == "5 of 5 pictures written"
    assert sorted(os.listdir(tmp_path / "out")) == ["B.png", "a10.png", "a2.jpg", "c.png", "e.tif"]
    assert read_image(tmp_path / "out" / "B.png").codes[0, 0].tolist() == [128, 128, 128]
    assert call(photos, "-o", tmp_path / "out", *LIGHT) == 2  # nothing is overwritten
    assert "4 more" in capsys.readouterr().err
    (tmp_path / "out" / "a2.jpg").unlink()
    assert call(photos, "-o", tmp_path / "out", *LIGHT, "--resume") == 0
    assert "1 of 1 pictures written" in capsys.readouterr().err and len(os.listdir(tmp_path / "out")) == 5


def test_a_format_for_all(photos, tmp_path):
    (photos / "b.tif").unlink()  # beside B.bmp
    assert call(photos, "-o", f"{tmp_path}/out/", "--layer", tmp_path / "layers", "--format", "exr", *LIGHT) == 0
    for folder in ("out", "layers"):
        assert sorted(os.listdir(tmp_path / folder)) == ["B.exr", "a10.exr", "a2.exr", "c.exr"]


def test_one_that_fails_stops_no_other(photos, tmp_path, capsys):
    (photos / "a10.png").write_bytes((photos / "a10.png").read_bytes()[:60])
    (photos / "b.tif").unlink()
    assert call(photos, "-o", tmp_path / "out", *LIGHT) == 2
    said = capsys.readouterr().err.splitlines()
    assert sum("a10.png: is damaged" in line for line in said) == 1 and said[-1] == "3 of 4 pictures written"


def test_one_whose_bytes_say_nothing_is_named(photos, tmp_path, capsys, monkeypatch):
    """A picture by its name is none to be left out in silence: it is empty, cut at its start, no picture at all, or closed to us."""
    (photos / "b.tif").unlink()
    (photos / "gone.jpg").symlink_to("nowhere")
    for name, data in (("e.jpg", b""), ("f.JPG", b"\xff\xd8"), ("g.dng", b"I"), ("h.png", b"<html>")):
        (photos / name).write_bytes(data)
    assert call(photos, "-o", tmp_path / "out", *LIGHT) == 2
    said = capsys.readouterr().err.splitlines()
    for name, says in (("e.jpg", "is empty"), ("f.JPG", "is not an image"), ("g.dng", "is not an image"), ("h.png", "is not an image")):
        assert sum(f"{name}: {says}" in line for line in said) == 1, said
    assert sum("gone.jpg: cannot be read" in line for line in said) == 1 and said[-1] == "4 of 9 pictures written"
    assert "left out: 2 files that are no pictures, 1 folder" in said[0]
    os_open = os.open
    monkeypatch.setattr(os, "open", lambda path, *more: _closed(path) if str(path).endswith("a2.jpg") else os_open(path, *more))
    assert str(photos / "a2.jpg") in pictures_in(str(photos))[0]


def _closed(path: object) -> int:
    raise PermissionError(13, "Permission denied", str(path))


def test_a_folder_that_stays_empty_goes(photos, tmp_path, monkeypatch):
    """What is made for pictures that never come."""
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.png").touch()
    assert call(tmp_path / "bad", "-o", tmp_path / "out", *LIGHT) == 2 and not (tmp_path / "out").exists()
    (tmp_path / "there").mkdir()
    assert call(tmp_path / "bad", "-o", tmp_path / "there", *LIGHT) == 2 and (tmp_path / "there").exists()  # the user's own
    announced: list[str] = []
    monkeypatch.setattr(temporaries, "announce", announced.append)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("airlight.jobs.image.run", stop)
    (photos / "b.tif").unlink()
    assert call(photos, "-o", tmp_path / "out", *LIGHT) == 130 and not (tmp_path / "out").exists()
    assert announced == [str(tmp_path / "out")]  # for where this process is killed


def test_planes_of_the_same_names(photos, tmp_path, capsys):
    for name in ("a2.png", "a10.exr", "B.png", "c.png"):
        put(tmp_path / "masks" / name, 1.0)
    (photos / "b.tif").unlink()
    assert call(photos, "-o", tmp_path / "out", "--mask", tmp_path / "masks", *LIGHT) == 0
    (tmp_path / "masks" / "c.png").unlink()
    capsys.readouterr()
    assert call(photos, "-o", tmp_path / "more", "--mask", tmp_path / "masks", *LIGHT) == 2
    assert "nothing in it has the name of c.txt" in capsys.readouterr().err and not (tmp_path / "more").exists()


def test_what_looks_like_a_clip_is_told(tmp_path, capsys):
    """Pictures are pictures: a holiday's are numbered too. But the pattern that keeps one light is named."""
    for number in (8, 9, 10):
        put(tmp_path / "clip" / f"shot.{number:04d}.png")
    assert call(tmp_path / "clip", "-o", tmp_path / "out", *LIGHT) == 0
    pattern = f"{tmp_path}/clip/shot.####.png"
    assert f'if they are frames of one clip, give "{pattern}"' in capsys.readouterr().err
    assert call(pattern, "-o", tmp_path / "clip out.####.png", *LIGHT) == 0  # what was said works
    for others in ("a1 a2", "a1 a2 a4", "a1 a2 b3", "a1 a1 a1", "9 10 11"):
        assert clip_of([f"{name}.png" for name in others.split()]) is None
    assert clip_of(["a1.png", "a2.jpg", "a3.png"]) is None
    for names, written in (("1 2 3", "%d"), ("01 02 03", "##")):
        found = clip_of([f"{name}.png" for name in names.split()])
        assert found is not None and found.written == written


def test_what_is_refused(photos, tmp_path, capsys):
    (tmp_path / "nothing").mkdir()
    (tmp_path / "folders" / "in").mkdir(parents=True)
    put(tmp_path / "single" / "a.png")
    for args, says in (
        ([photos, "-o", photos], "is also an input"),
        ([photos, "-o", tmp_path / "one.png"], "5 pictures do not go into one file"),
        ([photos, "-o", tmp_path / "a" / "b"], "the folder cannot be made"),
        ([photos, "-o", tmp_path / "out.####.png"], "frames are numbered by an input that is a pattern"),
        ([photos, "-o", tmp_path / "out", "--frames", "1-3"], "--frames needs a pattern"),
        ([photos, "-o", tmp_path / "out", "--format", "gif"], "'gif' is none of"),
        ([photos / "a2.jpg", "-o", tmp_path / "a.png", "--format", "png"], "leave --format out"),
        ([tmp_path / "nothing", "-o", tmp_path / "out"], "holds no pictures: it is empty"),
        ([tmp_path / "folders", "-o", tmp_path / "out"], "holds no pictures, but 1 folder: give it instead"),
        ([tmp_path / "photo", "-o", tmp_path / "out"], f"did you mean '{photos}'?"),
        ([photos, "--candidates", tmp_path / "c.png"], "--candidates shows one picture"),
        ([tmp_path / "single", photos / "raw", "-o", tmp_path / "out", "--file-quality", "5"], "--file-quality means something for"),
    ):
        assert call(*args, *LIGHT) == 2
        said = [line for line in capsys.readouterr().err.splitlines() if "left out" not in line]
        assert len(said) == 1 and says in said[0], said
        assert not (tmp_path / "out").exists()
    assert call(tmp_path / "single", "-o", tmp_path / "one.jpg", *LIGHT) == 0  # of one there is no doubt
    with pytest.raises(AirlightError, match="cannot be read"):
        pictures_in(str(tmp_path / "nosuch"))


@pytest.mark.parametrize(
    ("source", "says"),
    [
        ("*.nothing", "*.nothing: stands for no file: nothing has such a name"),
        ("*.[jp][pn]g", "*.[jp][pn]g: stands for 2 files: leave its quotes out"),
        ("a.jp*", "a.jp*: stands for 1 file: leave its quotes out"),
        ("airship.glb", "airship.glb: is a 3-D scene, which airlight render draws"),
        ("table", "table: is a 3-D scene, which airlight render draws"),
    ],
)
@pytest.mark.parametrize("output", ["out.png", "x/"])
def test_what_is_no_picture(
    source: str, says: str, output: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.jpg", "b.png"):
        Path(name).write_bytes(b"any")
    assert main(["image", source, "-o", output]) == 2
    assert capsys.readouterr().err == f"airlight: {says}\n"
