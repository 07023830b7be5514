"""`airlight render` to films."""

import contextlib
import json
import os
import signal
import struct
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from render_stage import SIZE, picture, refused, render, stage

from airlight import scenes
from airlight.cli import main
from airlight.errors import AirlightError, MachineError
from airlight.files import read_image, read_settings, video
from airlight.scenes import offline


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "a.mp4"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "open_scene", stage)
        assert render("-o", path, "--fps", "12000/1001", "--crf", "10") == 0
    return path


def test_a_film_is_tagged_and_converted_as_bt709(film, tmp_path):
    import av

    with av.open(str(film)) as container:
        stream = container.streams.video[0]
        codec = stream.codec_context
        assert (codec.name, codec.pix_fmt, codec.width, codec.height) == ("h264", "yuv420p", 64, 48)
        assert stream.average_rate == Fraction(12000, 1001) and stream.frames == 12
        assert (codec.color_primaries, codec.color_trc, codec.colorspace, codec.color_range) == (1, 1, 1, 1)
        frames = [frame.to_ndarray(format="rgb24", src_colorspace="ITU709") for frame in container.decode(stream)]
    assert len(frames) == 12
    data = film.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")
    assert render("-o", tmp_path / "f.##.png", "--frames", "1,9", "--fps", "12000/1001") == 0
    for number in (1, 9):
        still = read_image(tmp_path / f"f.{number:02d}.png").codes.astype(float)
        assert np.abs(frames[number - 1] - still).mean() < 2.5
        assert np.abs(frames[number - 1].mean((0, 1)) - still.mean((0, 1))).max() < 1.2  # the matrix: BT.601's is off by more


def test_colours_of_a_film_need_its_matrix(tmp_path):
    """Saturated colours come back within the codec's error by BT.709's matrix and not by BT.601's."""
    import av

    codes = np.zeros((32, 48, 3), np.uint8)
    codes[:, :16], codes[:, 16:32], codes[:, 32:] = (200, 30, 30), (30, 180, 40), (40, 50, 210)
    with video.film(tmp_path / "c.mp4", 48, 32, Fraction(25), crf=4) as add:
        for _ in range(3):
            add(codes)
    with av.open(str(tmp_path / "c.mp4")) as container:
        frame = next(container.decode(video=0))
    right, wrong = (frame.to_ndarray(format="rgb24", src_colorspace=space).astype(int)[:, [8, 24, 40]] for space in ("ITU709", "ITU601"))
    assert np.abs(right - codes[:, [8, 24, 40]]).max() <= 4 < 8 < np.abs(wrong - codes[:, [8, 24, 40]]).max()


def test_a_film_is_the_same_bytes_whatever_lies_in_memory(tmp_path):
    random = np.random.default_rng(2)
    noise = random.integers(0, 256, (48, 64, 3), np.uint8)
    found = set()
    for i in range(6):
        held = [random.bytes(3_000_000 + 1000 * i) for _ in range(2)]
        path = tmp_path / f"{i}.mp4"
        with video.film(path, 64, 48, Fraction(30), settings="{}") as add:
            for k in range(30):
                frame = np.roll(noise, k, axis=1)
                frame[:, : 2 * k] = 255
                add(frame)
        del held
        found.add(path.read_bytes())
    assert len(found) == 1


def test_settings_of_a_film_repeat_it(film, tmp_path):
    path = tmp_path / "again.mp4"
    assert main(["render", "box", "-o", str(path), "--settings-from", str(film)]) == 0
    assert path.read_bytes() == film.read_bytes()
    assert main(["render", "box", "-o", str(path), "--settings-from", str(film), "-n"]) == 0


def test_a_film_of_a_turn(tmp_path):
    import av

    assert render("-o", tmp_path / "t.mp4", "--turntable", "5") == 0
    with av.open(str(tmp_path / "t.mp4")) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 5 and np.abs(frames[0].astype(int) - frames[2]).mean() > 2


def test_what_fails_on_the_way_leaves_no_film(tmp_path, monkeypatch, capsys):
    def full(self, data):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(video.FileCursor, "write", full)
        assert "the disk is full" in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "a.mp4", code=1)
    frame = offline.Studio.frame

    def broken(self, time=0.0, *rest, **more):
        if time > 0.2:
            raise AirlightError("the scene fell apart; mend it")
        return frame(self, time, *rest, **more)

    with monkeypatch.context() as patch:
        patch.setattr(offline.Studio, "frame", broken)
        assert "fell apart" in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "a.mp4", code=1)
    assert not list(tmp_path.iterdir())


def test_frames_of_a_film_are_encoded_in_turn(tmp_path, monkeypatch):
    """A slow encoder is not given the next frame before it is done with the last."""
    original, order = video.film, []

    @contextlib.contextmanager
    def slow_film(*args, **more):
        with original(*args, **more) as add:

            def slow(codes):
                order.append("begun")
                time.sleep(0.02)
                add(codes)
                order.append("done")

            yield slow

    monkeypatch.setattr(scenes, "open_scene", stage)
    monkeypatch.setattr(video, "film", slow_film)
    assert render("-o", tmp_path / "a.mp4", "--fps", "12") == 0
    assert order == ["begun", "done"] * 12


def test_a_film_that_lost_a_frame_is_noticed(film):
    import av

    with open(film, "rb") as file:
        video.verify_film(av, file, "a.mp4", 64, 48, 12)
        for width, count in ((64, 13), (66, 12)):
            with pytest.raises(MachineError, match="did not read back"):
                video.verify_film(av, file, "a.mp4", width, 48, count)


GLB = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36}],
}


@pytest.fixture
def glb(tmp_path) -> Path:
    """A triangle."""
    text = json.dumps(GLB).encode()
    text += b" " * (-len(text) % 4)
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32).tobytes()
    path = tmp_path / "triangle.glb"
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of POSIX")
def test_ctrl_c_ends_a_film_within_a_second_and_leaves_nothing(glb, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    command = [sys.executable, "-m", "airlight", "render", str(glb), "-o", str(folder / "a.mp4"), "--turntable", "100000", "--width", "320"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    while process.poll() is None and time.monotonic() < until:
        begun = [path for path in folder.iterdir() if path.stat().st_size > 0]
        if begun:
            break
        time.sleep(0.05)
    assert begun and process.poll() is None
    process.send_signal(signal.SIGINT)
    told = time.monotonic()
    _, err = process.communicate(timeout=30)
    assert time.monotonic() - told < 2.0  # a second, on a machine with nothing else to do
    assert (process.returncode, err) == (130, "airlight: stopped; nothing half-written is left\n")
    assert os.listdir(folder) == []


@pytest.mark.parametrize("scene", [pytest.param("flying", marks=pytest.mark.slow), "table", "file"])
def test_the_scenes_themselves(scene, glb, tmp_path, monkeypatch):
    monkeypatch.undo()
    path = tmp_path / "a.png"
    command = ["render", str(glb) if scene == "file" else scene, "--quality", "draft", *SIZE]
    assert main([*command, "-o", str(path)]) == 0
    assert np.ptp(picture(path)) > 0.1
    if scene == "flying":
        assert main([*command, "-o", str(path.with_suffix(".exr")), "--time", "3", "--draw-path", "--seed", "8"]) == 0
        assert main([*command, "-o", str(path), "-y", "--settings-from", str(path.with_suffix(".exr"))]) == 0
        kept = json.loads(read_settings(str(path)))
        assert kept == json.loads(read_settings(str(path.with_suffix(".exr")))) and kept["seed"] == 8 and kept["draw_path"] is True
