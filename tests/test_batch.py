"""Many pictures in one run: names, order, what is done again, and what one bad file does."""

import contextlib
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import thumbs

from airlight.cli import main
from airlight.errors import AirlightError, MachineError
from airlight.files import read_image, write_image
from airlight.files.sequence import frames, numbered
from airlight.jobs.run import AHEAD, run
from airlight.jobs.tasks import PictureTask

LIGHT = ["--light", "0.4,0.3"]
RAYS = [*LIGHT, "--rays", "24"]  # of noise: nothing else stands before the light


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("7", [7]),
        ("1-4", [1, 2, 3, 4]),
        ("1-10x4,20", [1, 5, 9, 20]),
        ("3-1", [3, 2, 1]),
        ("-2-1", [-2, -1, 0, 1]),
        ("1-3,2-4", [1, 2, 3, 4]),
    ],
)
def test_frames(text, numbers):
    assert frames(text) == numbers


@pytest.mark.parametrize(("file", "pattern", "cure"), [("a.1.png", "a.#.png", "%d"), ("a.0001.png", "a.##.png", "%04d")])
def test_frames_of_other_digits_are_named(tmp_path, capsys, file, pattern, cure):
    write_image(tmp_path / file, np.zeros((4, 4, 3), np.float32))
    args = ["-o", str(tmp_path / "b.####.png"), "--light", "0.5,0.5;strength=0"]
    assert main(["image", str(tmp_path / pattern), *args]) == 2
    assert f"for {tmp_path / file} write {cure}, or give --frames\n" in capsys.readouterr().err
    assert main(["image", str(tmp_path / pattern.replace(pattern[2:-4], cure)), *args]) == 0


@pytest.mark.parametrize(
    ("pattern", "cure"),
    [
        ("shot-####.png", "; did you mean '{}shot-####.jpg'?"),
        ("shto-%04d.jpg", "; did you mean '{}shot-####.jpg'?"),
        ("film.####.exr", "; check the pattern, or give --frames"),
    ],
)
def test_a_pattern_without_files(tmp_path, capsys, pattern, cure):
    (tmp_path / "shot-0001.jpg").touch()
    assert main(["image", str(tmp_path / pattern), "-o", str(tmp_path / "b.####.png")]) == 2
    there = cure.format(str(tmp_path / "x")[:-1])
    assert capsys.readouterr().err == f"airlight: {tmp_path / pattern}: there are no such files{there}\n"


@pytest.mark.parametrize("text", ["", "1-", "a", "1-5x0", "1:5", "1-999999999", "1.5"])
def test_bad_frames(text):
    with pytest.raises(AirlightError, match="frames"):
        frames(text)


def test_patterns(tmp_path):
    for name, number, expected in (
        ("shot.####.exr", 7, "shot.0007.exr"),
        ("shot.#.exr", 12, "shot.0012.exr"),
        ("shot.%04d.exr", 12345, "shot.12345.exr"),
        ("s##_%03d.png", 5, "s##_005.png"),
        ("a%d.png", -3, "a-3.png"),
    ):
        assert numbered(str(tmp_path / name)).frame(number) == str(tmp_path / expected)
    assert numbered("plain.exr") is None and numbered("sh#ots/plain.exr") is None
    for name in ("a.0001.x", "a.0010.x", "a.12345.x", "a.1.x", "a.00001.x", "b.0002.x", "a.-0004.x", "a.0003.xx"):
        (tmp_path / name).touch()
    assert numbered(str(tmp_path / "a.####.x")).on_disk() == [-4, 1, 10, 12345]
    (tmp_path / "real#.png").touch()
    assert numbered(str(tmp_path / "real#.png")) is None  # a file of that name


@pytest.fixture
def shots(tmp_path: Path) -> Path:
    random = np.random.default_rng(3)
    for i in range(1, 6):
        pixels = random.random((12, 16, 3)).astype(np.float32)
        pixels[3, 6] = 1
        write_image(tmp_path / f"shot.{i:04d}.png", pixels)
    return tmp_path


def call(*args: object) -> int:
    return main(["image", *[str(a) for a in args]])


def test_a_sequence_by_pattern(shots, capsys):
    assert call(shots / "shot.####.png", "-o", shots / "out.%04d.exr", *LIGHT, "--frames", "1-5x2", "--threshold", "0.5") == 0
    assert sorted(p.name for p in shots.glob("out*")) == ["out.0001.exr", "out.0003.exr", "out.0005.exr"]
    assert capsys.readouterr().err == "3 of 3 pictures written\n"
    alone = shots / "alone.exr"
    assert call(shots / "shot.0003.png", "-o", alone, *LIGHT, "--threshold", "0.5") == 0
    assert np.array_equal(read_image(alone).codes, read_image(shots / "out.0003.exr").codes)


def test_into_a_folder_with_layers_and_masks_of_the_same_frame(shots):
    (shots / "out").mkdir()
    for i in range(1, 6):
        write_image(shots / f"mask.{i:04d}.png", np.full((12, 16, 3), 1.0 if i == 2 else 0.0, np.float32))
    args = [shots / "shot.#.png", "-o", shots / "out", *LIGHT, "--mask", shots / "mask.####.png", "--layer", shots / "layer.####.exr"]
    assert call(*args, "--occlusion", "none") == 0
    assert len(list((shots / "out").iterdir())) == 5
    lit = [read_image(shots / f"layer.{i:04d}.exr").codes.max() > 0 for i in range(1, 6)]
    assert lit == [False, True, False, False, False]


def test_one_bad_file_is_told_and_the_rest_done(shots, capsys):
    (shots / "shot.0002.png").write_bytes(b"no picture")
    assert call(shots / "shot.####.png", "-o", shots / "out.####.png", *RAYS) == 2
    err = capsys.readouterr().err.splitlines()
    assert len(err) == 2 and "shot.0002.png" in err[0] and err[1] == "4 of 5 pictures written"
    assert len(list(shots.glob("out.*"))) == 4


@pytest.mark.skipif(os.name == "nt", reason="a terminal of its own")
def test_lines_are_not_glued_to_the_progress_bar(shots):
    import pty

    bad = [shots / f"shot.000{i}.png" for i in (2, 4)]
    for path in bad:
        path.write_bytes(b"no picture")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "airlight", "image", str(shots / "shot.####.png"), "-o", str(shots / "out.####.png"), *LIGHT]
    process = subprocess.Popen(command, stderr=theirs, env={**os.environ, "TERM": "xterm", "COLUMNS": "300"})
    os.close(theirs)
    said = b""
    with contextlib.suppress(OSError):  # Linux tells so that the other end is closed
        while part := os.read(ours, 1 << 16):
            said += part
    os.close(ours)
    assert process.wait(60) == 2
    for line in (b"airlight: " + os.fsencode(path) for path in bad):
        before = said.split(line)[0]  # nothing, where the bar is not shown yet
        assert said.count(line) == 1 and (not before or before.endswith((b"\n", b"\r", b"\x1b[2K"))), said


@pytest.mark.parametrize("look", [["--rays", "24"], ["--look", "classic"]])
def test_resume_does_what_is_missing_or_damaged(shots, capsys, look):
    assert call(shots / "shot.####.png", "-o", shots / "out.####.png", *LIGHT, *look) == 0
    whole = {p.name: p.read_bytes() for p in shots.glob("out.*")}
    (shots / "out.0001.png").unlink()
    (shots / "out.0004.png").write_bytes(whole["out.0004.png"][:100])
    stamps = {p.name: p.stat().st_mtime_ns for p in shots.glob("out.*")}
    capsys.readouterr()
    args = [shots / "shot.####.png", "-o", shots / "out.####.png", *LIGHT, *look]
    assert call(*args) == 2
    assert "3 more" in capsys.readouterr().err
    assert call(*args, "--resume") == 0
    assert capsys.readouterr().err.splitlines() == ["3 of 5 exist: skipped", "2 of 2 pictures written"]
    assert {p.name: p.read_bytes() for p in shots.glob("out.*")} == whole
    assert all((shots / name).stat().st_mtime_ns == stamps[name] for name in ("out.0002.png", "out.0003.png", "out.0005.png"))
    assert call(*args, "--resume") == 0 and call(*args, "-n") == 0


def test_frames_keep_what_the_first_settled(shots, tmp_path):
    """The same picture twice as bright later gets the same threshold, veil and mix: no flicker. Alone it would not."""
    random = np.random.default_rng(4)
    pixels = (0.3 * random.random((40, 60, 3))).astype(np.float32)
    pixels[8:20, 20:36] = 0.6
    for i, factor in ((1, 1.0), (2, 0.5)):
        write_image(tmp_path / f"f.{i:04d}.png", pixels * np.float32(factor))
    classic = [*LIGHT, "--look", "classic"]
    assert call(tmp_path / "f.#.png", "-o", tmp_path / "o.#.png", *classic, "--layer", tmp_path / "l.#.exr") == 0
    assert call(tmp_path / "f.0002.png", "-o", tmp_path / "alone.png", *classic, "--layer", tmp_path / "alone.exr") == 0
    together, alone = (read_image(tmp_path / name).codes for name in ("l.0002.exr", "alone.exr"))
    assert together.max() < 0.2 * alone.max()  # half as bright is below the first frame's threshold


def test_what_cannot_be_named(shots, capsys):
    (shots / "out").mkdir()
    for args, says in (
        (["shot.####.png", "-o", "one.png"], "folder or a pattern"),
        (["shot.0001.png", "-o", "out.####.png"], "numbered by an input"),
        (["none.####.png", "-o", "out.####.png"], "no such files"),
        (["shot.0001.png", "-o", "x.png", "--frames", "1-3"], "--frames"),
        (["shot.####.png", "-o", "out.####.png", "--frames", "1-"], "frames"),
        (["shot.0001.png", "./shot.0001.png", "-o", "out"], "would go there"),
        (["shot.0001.png", "shot.0002.png", "-o", "."], "also an input"),
        (["shot.0001.png", "shot.0002.png", "-o", "nosuch/"], "does not exist"),
        (["shot.0001.png", "-o", "a.png", "-y", "--resume"], "exclude"),
    ):
        here = os.getcwd()
        os.chdir(shots)
        try:
            assert call(*args, *LIGHT) == 2
        finally:
            os.chdir(here)
        err = capsys.readouterr().err
        assert says in err and err.count("\n") == 1, err
    assert len(list(shots.iterdir())) == 6


@pytest.mark.parametrize(("look", "by"), [("smart", "render_look"), ("classic", "render_picture")])
def test_interrupt_and_machine_errors_end_the_run(shots, capsys, monkeypatch, look, by):
    from airlight import pictures

    true, calls = getattr(pictures, by), []

    def third(error):
        def render(*args, **more):
            calls.append(1)
            if len(calls) == 3:
                raise error
            return true(*args, **more)

        return render

    for error, code in ((KeyboardInterrupt(), 130), (MachineError("the disk is full"), 1)):
        calls.clear()
        monkeypatch.setattr(pictures, by, third(error))
        assert call(shots / "shot.####.png", "-o", shots / "out.####.png", *LIGHT, "-y", "--look", look) == code
        written = sorted(p.name for p in shots.glob("out.*"))
        assert set(written) <= {"out.0001.png", "out.0002.png"} and not list(shots.glob(".airlight*"))
        for name in written:
            read_image(shots / name)
            (shots / name).unlink()


def test_work_overlaps():
    """While one picture is rendered the next is read and the last is written, a bounded number of them."""
    log: list[tuple[str, int]] = []
    todo = [PictureTask(i, str(i), source=str(i)) for i in range(8)]

    def step(name):
        def work(task, *_):
            log.append((name, int(task.source)))
            return task.source

        return work

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(todo, step("read"), step("render"), step("write")) == []
    for name in ("read", "render", "write"):
        assert sorted(i for n, i in log if n == name) == list(range(8))
    reads = [at for at, (n, _) in enumerate(log) if n == "read"]
    renders = [at for at, (n, _) in enumerate(log) if n == "render"]
    assert all(reads[i + 1] < renders[i + 1] for i in range(7))
    ahead = max(sum(1 for n, _ in log[:at] if n == "read") - sum(1 for n, _ in log[:at] if n == "render") for at in range(len(log)))
    assert 1 <= ahead <= AHEAD + 1


@pytest.mark.parametrize("extra", [["--adapt", "1"], ["--adapt", "1", "--mix", "0.5"], ["--look", "classic"], ["--rays", "24"]])
def test_frames_keep_their_level_also_when_resumed(tmp_path, capsys, extra):
    """A sequence is adapted by its first frame's ramp, so that it does not pump; a resumed run gives the bytes of one run."""
    random = np.random.default_rng(5)
    pixels = (0.3 * random.random((40, 60, 3))).astype(np.float32)
    pixels[8:20, 20:36] = 0.6
    for i, factor in enumerate((1.0, 0.5, 0.25, 2.0), 1):
        write_image(tmp_path / f"f.{i:04d}.exr", pixels * np.float32(factor))
    args = [tmp_path / "f.#.exr", "-o", tmp_path / "o.#.png", *LIGHT, *extra]
    assert call(*args) == 0
    whole = {p.name: p.read_bytes() for p in tmp_path.glob("o.*")}
    codes = [read_image(tmp_path / f"o.{i:04d}.png").linear() for i in range(1, 5)]
    means = [float(c.mean()) for c in codes]
    assert means[3] > means[0] > 1.3 * means[1] > 1.5 * means[2]  # levels follow the input's as they would without
    for gone, resume in (((3, 4), "--resume"), ((2,), "-n"), ((1, 2, 3), "--resume")):
        for i in gone:
            (tmp_path / f"o.{i:04d}.png").unlink()
        capsys.readouterr()
        assert call(*args, resume) == 0
        assert capsys.readouterr().err.splitlines()[-1] == f"{len(gone)} of {len(gone)} pictures written"
        assert {p.name: p.read_bytes() for p in tmp_path.glob("o.*")} == whole


def test_resume_after_a_first_frame_that_cannot_be_read(tmp_path, capsys):
    pixels = np.random.default_rng(6).random((40, 60, 3)).astype(np.float32)
    (tmp_path / "f.0001.exr").write_bytes(b"no picture")
    for i, factor in ((2, 1.0), (3, 0.3)):
        write_image(tmp_path / f"f.{i:04d}.exr", pixels * np.float32(factor))
    args = [tmp_path / "f.#.exr", "-o", tmp_path / "o.#.png", *LIGHT, "--adapt", "1"]
    assert call(*args) == 2
    whole = (tmp_path / "o.0003.png").read_bytes()
    (tmp_path / "o.0003.png").unlink()
    capsys.readouterr()
    assert call(*args, "--resume") == 2
    assert capsys.readouterr().err.splitlines()[-1] == "1 of 2 pictures written"
    assert (tmp_path / "o.0003.png").read_bytes() == whole


@pytest.mark.parametrize("look", ["smart", "classic"])
def test_each_sequence_keeps_what_its_own_first_frame_settled(tmp_path, capsys, look):
    """Two clips in one run, and a picture between them: the bytes of runs of their own, also when resumed."""
    pixels = thumbs.linear(thumbs.SUN)
    for i in (1, 2):
        write_image(tmp_path / f"a.{i:04d}.png", pixels * np.float32(i / 2))
        write_image(tmp_path / f"b.{i:04d}.png", pixels[:, ::-1] * np.float32(i / 2))
    write_image(tmp_path / "plain.png", pixels[::-1])
    clips = [tmp_path / "a.#.png", tmp_path / "plain.png", tmp_path / "b.#.png"]
    (tmp_path / "alone").mkdir()
    (tmp_path / "both").mkdir()
    args = ["--look", look]
    for one in clips:
        assert call(one, "-o", tmp_path / "alone", *args) == 0
    assert capsys.readouterr().err.count("light at") == 3
    assert call(*clips, "-o", tmp_path / "both", *args) == 0
    whole = {p.name: p.read_bytes() for p in (tmp_path / "alone").iterdir()}
    assert {p.name: p.read_bytes() for p in (tmp_path / "both").iterdir()} == whole and len(whole) == 5
    for name in ("a.0002.png", "b.0002.png"):
        (tmp_path / "both" / name).unlink()
    capsys.readouterr()
    assert call(*clips, "-o", tmp_path / "both", *args, "--resume") == 0
    assert capsys.readouterr().err.splitlines()[-1] == "2 of 2 pictures written"
    assert {p.name: p.read_bytes() for p in (tmp_path / "both").iterdir()} == whole


def test_names_with_a_number_sign(shots, capsys):
    """For a picture without a number one # or %d is part of the name; ## and %04d can only be meant as a pattern."""
    for name in ("shot #1.png", "C#.png", "100%d.png"):
        assert call(shots / "shot.0001.png", "-o", shots / name, *LIGHT) == 0 and (shots / name).is_file()
        assert call(shots / name, "-o", shots / "again.png", "-y", *LIGHT) == 0  # a file of that name is no pattern
    for name in ("a##.png", "a%02d.png"):
        assert call(shots / "shot.0001.png", "-o", shots / name, *LIGHT) == 2
        assert "numbered by an input" in capsys.readouterr().err


def test_an_occlusion_that_the_picture_lacks_is_told_before_the_work(shots, capsys):
    assert call(shots / "shot.0001.png", "-o", shots / "a.png", "--occlusion", "alpha") == 2
    err = capsys.readouterr().err
    assert "alpha channel" in err and err.count("\n") == 1  # no `light at`


def test_a_warning_is_told_once(shots, capsys, monkeypatch):
    pixels = np.random.default_rng(3).random((12, 16, 3)).astype(np.float32)
    pixels[4, 5] = np.nan
    import OpenImageIO as oiio

    out = oiio.ImageOutput.create("openexr")
    spec = oiio.ImageSpec(16, 12, 3, "float")
    assert out.open(str(shots / "nan.exr"), spec) and out.write_image(pixels) and out.close()
    args = [*LIGHT, "--occlusion-fraction", shots / "d.png", "--threshold", "0.5"]
    assert call(shots / "nan.exr", "-o", shots / "a.exr", *args, "--mask", shots / "nan.exr") == 0
    assert capsys.readouterr().err.count("NaN") == 1

    monkeypatch.setattr("airlight.gpu.device.adapters", lambda: [])
    assert call(shots / "shot.0001.png", "-o", shots / "b.png", *args, "-y", "--device", "none") == 0
    assert capsys.readouterr().err.count("no graphics adapter") == 1
    assert call(shots / "nan.exr", "-o", shots / "c.exr", *RAYS, "--subject", shots / "nan.exr", "--device", "none") == 0
    said = capsys.readouterr().err
    assert said.count("no graphics adapter") == said.count("NaN") == said.count("\n") / 2 == 1
