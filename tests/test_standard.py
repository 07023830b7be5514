"""`-`: pictures, scenes and settings that are piped in, and outputs that are piped out."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airlight.cli import main
from airlight.files import extras, read_image, write_image
from airlight.files.storage import jpeg_quality
from airlight.options.storage import Storage
from airlight.process import standard

COMMAND = [sys.executable, "-m", "airlight"]
LIGHT = ["--light", "0.4,0.3", "--rays", "9"]
pytestmark = pytest.mark.skipif(os.name == "nt", reason="handles of POSIX")


@pytest.fixture
def pipe(tmp_path, capsys):
    """Run a command in this process, with bytes as its standard input: its exit code, what it wrote to stdout, and to stderr."""

    def run(args, given=b""):
        (tmp_path / "stdin").write_bytes(given)
        kept = os.dup(0), os.dup(1)
        handles = os.open(tmp_path / "stdin", os.O_RDONLY), os.open(tmp_path / "stdout", os.O_RDWR | os.O_CREAT | os.O_TRUNC)
        try:
            for number, handle in enumerate(handles):
                os.dup2(handle, number)
            code = main([str(one) for one in args])
        finally:
            for number, handle in enumerate(kept):
                os.dup2(handle, number)
            for handle in (*kept, *handles):
                os.close(handle)
        return code, (tmp_path / "stdout").read_bytes(), capsys.readouterr().err

    return run


@pytest.fixture
def photo(tmp_path) -> Path:
    pixels = np.random.default_rng(2).random((24, 32, 3)).astype(np.float32) * 0.6
    write_image(tmp_path / "in.jpg", pixels)
    return tmp_path / "in.jpg"


@pytest.mark.parametrize("format", [None, "png", "exr", "tif", "webp"])
def test_the_bytes_are_those_of_files(photo, tmp_path, pipe, format):
    code, out, said = pipe(["image", "-", "-o", "-", *LIGHT, *(["--format", format] if format else [])], photo.read_bytes())
    assert (code, said) == (0, "")
    other = tmp_path / f"out.{format or 'jpg'}"
    assert main(["image", str(photo), "-o", str(other), *LIGHT]) == 0 and other.read_bytes() == out
    assert standard.local("a") == "a" and pipe(["image", photo, "-o", f"-.{format or 'jpg'}", *LIGHT])[1] == out
    assert not (tmp_path / "-.png").exists()


def test_a_dpx_is_a_files_but_for_the_name_in_its_header(photo, tmp_path, pipe):
    code, out, _ = pipe(["image", photo, "-o", "-", "--format", "dpx", *LIGHT])
    assert code == 0 and main(["image", str(photo), "-o", str(tmp_path / "a.dpx"), *LIGHT]) == 0
    written = (tmp_path / "a.dpx").read_bytes()
    assert out[36:136] == bytes(100) and written[36:136] == b"a.dpx".ljust(100, b"\0")
    created = slice(136, 160)  # the time
    assert out[160:] == written[160:] and out[:36] == written[:36] and len(out[created]) == len(written[created])


def test_input_unchanged_is_copied(photo, pipe):
    code, out, _ = pipe(["image", "-", "-o", "-", "--light", "0.5,0.5;strength=0"], photo.read_bytes())
    assert code == 0 and out == photo.read_bytes()


def test_the_quality_of_what_is_piped_in(photo, tmp_path, pipe):
    write_image(tmp_path / "poor.jpg", read_image(photo).linear(), storage=Storage(file_quality=40))
    assert main(["image", str(tmp_path / "poor.jpg"), "-o", str(tmp_path / "file.jpg"), *LIGHT]) == 0
    assert pipe(["image", "-", "-o", tmp_path / "piped.jpg", *LIGHT], (tmp_path / "poor.jpg").read_bytes())[0] == 0
    assert (tmp_path / "piped.jpg").read_bytes() == (tmp_path / "file.jpg").read_bytes()
    assert jpeg_quality(str(tmp_path / "piped.jpg")) == 40


def test_masks_presets_and_settings(photo, tmp_path, pipe):
    write_image(tmp_path / "mask.png", np.ones((24, 32, 3), np.float32))
    assert pipe(["image", photo, "-o", tmp_path / "a.png", *LIGHT, "--mask", "-"], (tmp_path / "mask.png").read_bytes())[0] == 0
    assert pipe(["image", photo, "-o", tmp_path / "b.png", *LIGHT, "--preset", "-"], b"strength = 0.5\nshade = 0\n")[0] == 0
    assert pipe(["image", photo, "-o", tmp_path / "c.png", "--settings-from", "-"], (tmp_path / "b.png").read_bytes())[0] == 0
    assert np.array_equal(read_image(tmp_path / "b.png").codes, read_image(tmp_path / "c.png").codes)
    code, out, _ = pipe(["image", "-", "--candidates", "-"], photo.read_bytes())
    assert code == 0 and isinstance(json.loads(out), list)


def test_scenes(tmp_path, pipe):
    model = Path(__file__).parent / "data" / "hawk.glb"
    size = ["--width", "32", "--quality", "draft"]
    code, out, _ = pipe(["render", "-", "-o", "-", "--format", "exr", *size], model.read_bytes())
    (tmp_path / "piped.exr").write_bytes(out)
    assert code == 0 and main(["render", str(model), "-o", str(tmp_path / "a.exr"), *size]) == 0
    assert np.array_equal(read_image(tmp_path / "piped.exr").codes, read_image(tmp_path / "a.exr").codes)
    code, _, said = pipe(["render", "-", "-o", "-", *size], b"glTF")
    assert code == 2 and said == "airlight: -: is cut off; copy or export it again\n"


def test_comparisons_are_told_on_stderr(photo, pipe):
    """What else a command prints on stdout stands beside the bytes, never among them."""
    args = ["--variant", "decay=0.9", "--light", "0.4,0.3", "--runs", "1"]
    done = subprocess.run([*COMMAND, "compare", photo, "-o", "-", *args], capture_output=True, timeout=60)
    assert done.returncode == 0 and done.stdout.startswith(b"\x89PNG") and done.stdout.endswith(b"IEND\xaeB`\x82")
    assert done.stderr.startswith(b"decay 0.9  error ") and done.stderr.count(b"\n") == 1
    code, out, _ = pipe(["compare", photo, "-o", "-", "--html", *args])
    assert code == 0 and out.startswith(b"<!") and out.rstrip().endswith(b"</html>")


def test_records_of_timings(pipe, monkeypatch):
    from airlight import bench
    from airlight.files import replacing

    def measured(json_path, overwrite, **_):
        with replacing(json_path, overwrite) as file:
            file.write(b"{}")

    monkeypatch.setattr(bench, "run", measured)
    assert pipe(["bench", "--json", "-"])[:2] == (0, b"{}")


@pytest.mark.parametrize(
    ("args", "given", "says"),
    [
        (["image", "-", "-o", "x.png"], b"", "-: is empty"),
        (["image", "-", "-o", "x.png"], b"hello", "-: is not an image"),
        (["image", "-", "-o", "x.png"], b"\x89PNG\r\n\x1a\n" + b"\0" * 30, "-: is damaged"),
        (["image", "PHOTO", "-o", "-", "--layer", "-"], b"", "-: is named for two outputs"),
        (["image", "PHOTO", "PHOTO", "-o", "-"], b"", "-: 2 pictures do not go into one file"),
        (["render", "-", "-o", "x.png"], b"\xff\xd8\xff\xe0 of a photo", "-: is a picture, not a scene; airlight image"),
        (["render", "-", "-o", "x.png"], b"hello", "-: is not a scene; give table, flying, or a .glb"),
        (["image", "-", "-o", "x.png"], b"glTF\2\0\0\0", "-: is a 3-D scene, which airlight render draws"),
        (["view", "-", "--screenshot", "x.png"], b"glTF\2\0\0\0", "-: is a 3-D scene, which airlight render draws"),
        (["render", "-", "-o", "x.png"], b"", "-: is empty"),
        (["image", "FOLDER", "-o", "-"], b"", "-: 2 pictures do not go into one file"),
        (["image", "FOLDER", "-o", "-", "--format", "png"], b"", "-: 2 pictures do not go into one file"),
        (["image", "PHOTO", "-o", "x", "--layer", "-", "--frames", "1-2"], b"", "--frames needs a pattern"),
        (["render", "table", "-o", "-", "--turntable", "4"], b"", "airlight: -: 4 frames do not go into one picture"),
        (["render", "table", "-o", "-.####.png", "--turntable", "4"], b"", "files of that name are ./-.####.png"),
        (["render", "table", "-o", "-.#.mp4", "--turntable", "4"], b"", "files of that name are ./-.#.mp4"),
        (["render", "table", "-o", "a.#.png", "--layer", "-.#.exr", "--frames", "1-2"], b"", "files of that name are ./-.#.exr"),
        (["render", "table", "-o", "-####.png", "--turntable", "4"], b"", "files of that name are ./-####.png"),
        (["image", "FOLDER/%d.png", "-o", "-%02d.png"], b"", "files of that name are ./-%02d.png"),
        (["image", "FOLDER/%d.png", "-o", "-.%02d.png"], b"", "files of that name are ./-.%02d.png"),
        (["image", "PHOTO", "-o", "-.gif"], b"", "unknown extension '.gif'"),
        (["image", "PHOTO", "-o", "a.png", "--format", "png"], b"", "leave --format out"),
        (["render", "table", "-o", "a.png", "--format", "png"], b"", "leave --format out"),
        (["image", "PHOTO", "-o", "-", "--preset", "-"], b"strngth = 1", "-: unknown key 'strngth'; did you mean 'strength'?"),
        (["image", "PHOTO", "-o", "-", "--settings-from", "-"], b"", "-: is empty"),
    ],
)
def test_what_is_refused(photo, pipe, monkeypatch, tmp_path, args, given, says):
    monkeypatch.chdir(tmp_path)
    for number in (1, 3):
        (tmp_path / "folder").mkdir(exist_ok=True)
        write_image(tmp_path / "folder" / f"{number}.png", np.zeros((2, 2, 3), np.float32))
    code, out, said = pipe([str(photo) if one == "PHOTO" else one.replace("FOLDER", "folder") for one in args], given)
    assert code == 2 and out == b"" and says in said and said.count("\n") == 1
    assert sorted(os.listdir(tmp_path)) == ["folder", "in.jpg", "stdin", "stdout"]


def test_folders_of_that_name(photo, tmp_path, pipe, monkeypatch):
    """They are ./-: the name alone is standard input and output even then."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "-").mkdir()
    write_image(tmp_path / "-" / "a.png", np.zeros((2, 2, 3), np.float32))
    assert pipe(["image", "-", "-o", "q.png", *LIGHT], photo.read_bytes())[0] == 0
    assert read_image(tmp_path / "q.png").codes.shape[:2] == (24, 32)
    assert isinstance(json.loads(pipe(["image", "-", "--candidates", "-"], photo.read_bytes())[1]), list)
    code, out, _ = pipe(["image", photo, "-o", "-", "--mask", "-", *LIGHT], (tmp_path / "q.png").read_bytes())
    assert code == 0 and out.startswith(b"\xff\xd8") and os.listdir(tmp_path / "-") == ["a.png"]
    assert main(["image", "./-", "-o", "folder", *LIGHT]) == 0 and os.listdir(tmp_path / "folder") == ["a.png"]


def test_a_reader_that_goes_and_a_full_disk(photo):
    """One line, and the exit code of a failure of the machine."""
    reader, writer = os.pipe()
    os.close(reader)
    for target, says in ((writer, b"-: what reads the output ended"), (os.open("/dev/full", os.O_WRONLY), b"-: could not be written")):
        done = subprocess.run([*COMMAND, "image", photo, "-o", "-", *LIGHT], stdout=target, stderr=subprocess.PIPE, timeout=60)
        os.close(target)
        assert done.returncode == 1 and says in done.stderr and done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("args", [["-o", "-"], ["--candidates", "-"]])
def test_a_closed_output_is_no_success(photo, args):
    done = subprocess.run(
        ["sh", "-c", '"$@" >&-', "sh", *COMMAND, "image", photo, *args, *LIGHT], stderr=subprocess.PIPE, timeout=60, check=False
    )
    assert done.returncode == 1 and done.stderr.startswith(b"airlight: -: standard output is closed") and done.stderr.count(b"\n") == 1


def test_terminals_are_refused(photo, monkeypatch, capsys):
    """Before any work: a picture on a terminal is signs, and from one nothing comes."""
    ours, theirs = pty.openpty()
    kept = os.dup(0), os.dup(1)
    try:
        os.dup2(theirs, 0)
        os.dup2(theirs, 1)
        assert main(["image", str(photo), "-o", "-"]) == 2
        assert "-: is a terminal" in capsys.readouterr().err
        assert main(["image", "-", "-o", "out.png"]) == 2
        assert "nothing is piped into it" in capsys.readouterr().err
    finally:
        for number, handle in enumerate(kept):
            os.dup2(handle, number)
        for handle in (*kept, ours, theirs):
            os.close(handle)


def test_too_much_is_refused(pipe, monkeypatch):
    monkeypatch.setattr(standard, "MOST_INPUT", 1000)
    code, _, said = pipe(["image", "-", "-o", "x.png"], b"x" * 1001)
    assert code == 2 and "are piped in; give the name of a file" in said


def test_files_of_these_names(photo, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["image", "in.jpg", "-o", "./-.png", *LIGHT]) == 0 and (tmp_path / "-.png").exists()
    assert main(["image", "./-.png", "-o", "out.png", *LIGHT]) == 0
    assert all(standard.is_output(name) for name in ("-", "-.png", "-.jxl"))
    assert not any(standard.is_output(name) for name in ("./-.png", "--.png", "-a.png", "a-.png"))


def test_camera_files_without_a_name():
    """Their TIFF holds a small preview, which would be read in their place."""
    head = b"II*\0\x08\0\0\0\x01\0" + b"%s\x04\0\x01\0\0\0%s\0\0\0" + b"\0" * 40
    subfile, version, width = b"\xfe\0", b"\x12\xc6", b"\0\x01"
    for tag, value, kind in ((subfile, b"\x01", "raw"), (subfile, b"\0", None), (version, b"\x01", "raw"), (width, b"\x01", None)):
        assert extras.kind("-", head % (tag, value)) == kind
        assert extras.kind("a.tif", head % (tag, value)) is None
    assert extras.kind("-", b"II*\0\x10\0\0\0CR\x02\0" + b"\0" * 40) == "raw"
    assert extras.kind("-", b"MM\0*\xff\xff\xff\xff") is None
