"""`airlight render`: frames, sequences and films of a stage; a small one stands for the scenes."""

import functools
import json
import math
import os
import signal
import struct
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest

from airlight import presets, scenes
from airlight.cli import main
from airlight.errors import AirlightError, MachineError
from airlight.files import read_image, read_settings, video
from airlight.jobs.light_text import PLACE, SUN, read_scene_light
from airlight.options import Composite, March, Medium, Parameters, SceneOptions
from airlight.pygfx import SceneLight
from airlight.scenes import Stage, offline

LAMP = (0.0, 1.0, -6.0)


def stage(*_, **__) -> Stage:
    """A wall of 2 x 2 m at z = 0 that goes up and down, before a grey background; a lamp behind it; two cameras."""
    scene = gfx.Scene()
    scene.add(gfx.Background.from_color("#808080"))
    wall = gfx.Mesh(gfx.plane_geometry(2, 2), gfx.MeshBasicMaterial(color="#202020"))
    wall.name = "wall"
    lamp = gfx.Mesh(gfx.sphere_geometry(0.4), gfx.MeshBasicMaterial(color=gfx.Color.from_physical(4, 3, 2)))
    lamp.local.position = LAMP
    scene.add(wall, lamp)
    front, follower = (gfx.PerspectiveCamera(50, depth_range=(0.1, 100)) for _ in range(2))
    front.local.position = (0, 0, 5)

    def pose(t, camera):
        wall.local.position = (0, 0.5 * math.sin(2 * math.pi * t), 0)
        if camera is follower:
            follower.local.position = (wall.local.x, wall.local.y, 4)

    pose(0.0, None)
    light = SceneLight(lamp)
    return Stage("box", scene, {"front": front, "follower": follower}, [light], 1.0, pose, np.zeros(3), 2.0, light)


@pytest.fixture(autouse=True)
def staged(monkeypatch):
    """The small stage instead of any other, and one renderer for each size: each one dropped leaks."""
    monkeypatch.setattr(scenes, "open_scene", stage)
    monkeypatch.setattr(offline, "_renderer", kept_renderer)


@functools.cache
def _renderer_of(width, height, samples):
    return make_renderer(offline.Shot(width, height, samples))


def kept_renderer(shot):
    return _renderer_of(shot.width, shot.height, shot.samples)


make_renderer = offline._renderer
SIZE = ["--width", "64", "--height", "48"]


def render(*args) -> int:
    return main(["render", "box", *SIZE, *[str(a) for a in args]])


def refused(capsys, *args, code=2) -> str:
    """The one line with which the command is refused."""
    assert main([str(a) for a in args]) == code
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("airlight: ") and err.count("\n") == 1 and "Traceback" not in err
    return err


def picture(path) -> np.ndarray:
    return read_image(path).linear()


def channels(path) -> dict[str, np.ndarray]:
    """Every channel of an EXR, by its name."""
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    pixels = file.read_image("float")
    return {name: pixels[..., i] for i, name in enumerate(file.spec().channelnames)}


def test_the_same_command_gives_the_same_bytes(tmp_path):
    for extension in ("png", "exr", "jpg"):
        paths = [tmp_path / f"{i}.{extension}" for i in range(2)]
        for path in paths:
            assert render("-o", path, "--adapt", "0.5", "--time", "0.3") == 0
        assert paths[0].read_bytes() == paths[1].read_bytes()
    assert read_image(tmp_path / "0.png").codes.shape == (48, 64, 3)


def test_an_exr_holds_light_layer_and_depth(tmp_path):
    assert render("-o", tmp_path / "a.exr", "--no-antialias", "--tone", "filmic") == 0
    assert render("-o", tmp_path / "plain.exr", "--no-antialias", "--mix", "0") == 0
    found, plain = channels(tmp_path / "a.exr"), channels(tmp_path / "plain.exr")
    assert list(found) == ["R", "G", "B", "A", "Z", "airlight.R", "airlight.G", "airlight.B"]
    assert (found["A"] == 1).all()
    wall, sky = found["Z"][24, 32], found["Z"][2, 2]
    assert wall == pytest.approx(5.0, rel=1e-4)
    assert sky == np.float32(offline.FAR)
    inside = found["Z"] < 6
    assert np.ptp(found["Z"][inside]) < 1e-3  # planar: the same all over the wall
    assert found["airlight.R"].max() > 0.05
    for c in "RGB":
        assert not plain["airlight." + c].any()
        assert np.abs(found[c] - found["airlight." + c] - plain[c]).max() < 4e-3 * max(1.0, found[c].max())
    lamp = found["Z"] == np.float32(offline.FAR)
    assert plain["R"][lamp].max() == pytest.approx(0.2159, rel=2e-3)  # the grey of the background, not what a display shows of it


def test_the_layer_gathers_with_the_distance_as_it_was_merged(tmp_path):
    options = ("--depth-aware", "4", "--mix", "0.8", "--eye", "1,0.5,4")
    assert render("-o", tmp_path / "a.exr", *options) == 0
    assert render("-o", tmp_path / "plain.exr", *options[:2], "--mix", "0", *options[4:]) == 0
    found, plain = channels(tmp_path / "a.exr"), channels(tmp_path / "plain.exr")
    for c in "RGB":
        assert np.abs(found[c] - found["airlight." + c] - plain[c]).max() < 4e-3 * max(1.0, found[c].max())
    assert found["Z"].min() < 4.5  # the nearest sample of a pixel on the wall's edge


def test_the_layer_of_the_pre_pass_is_that_part_of_it_that_the_view_shows(tmp_path):
    options = ("--occluders", "prepass", "--region", "1.5", "--eye", "0.6,0.3,5")
    for name, mix in (("a", 1), ("plain", 0)):
        assert render("-o", tmp_path / f"{name}.exr", *options, "--mix", mix) == 0
    found, plain = channels(tmp_path / "a.exr"), channels(tmp_path / "plain.exr")
    assert found["airlight.R"].max() > 0.05
    for c in "RGB":
        assert np.abs(found[c] - found["airlight." + c] - plain[c]).max() < 4e-3 * max(1.0, found[c].max())
    assert render("-o", tmp_path / "without.exr", *options, "--exclude", "wall") == 0  # the lamp is no longer hidden
    assert channels(tmp_path / "without.exr")["airlight.R"].mean() > 1.05 * found["airlight.R"].mean()


def test_one_sample_lies_at_each_pixels_centre(tmp_path):
    options = ("--mix", "0", "--tone", "none", "--eye", "0.3,0.2,5", "--target", "0.3,0.2,0", "--fov", "50")
    assert render("-o", tmp_path / "sharp.exr", "--no-antialias", *options) == 0
    assert render("-o", tmp_path / "smooth.exr", *options) == 0
    sharp, smooth = channels(tmp_path / "sharp.exr"), channels(tmp_path / "smooth.exr")
    half = math.tan(math.radians(25)) * 5  # of the picture's height, on the wall's plane
    x = 0.3 + ((np.arange(64) + 0.5) / 64 * 2 - 1) * half * 64 / 48
    y = 0.2 - ((np.arange(48) + 0.5) / 48 * 2 - 1) * half
    wall = (np.abs(x) < 1) & (np.abs(y) < 1)[:, None]
    assert np.array_equal(sharp["Z"] < 6, wall)
    dark = sharp["R"] < 0.1
    assert np.array_equal(dark, wall)
    between = (smooth["R"] > 0.02) & (smooth["R"] < 0.2)
    assert between.sum() > 20  # pixels at the edges
    assert np.abs(smooth["R"] - sharp["R"])[~between & (sharp["R"] < 0.3) & (smooth["R"] < 0.3)].max() < 1e-3


def test_quality_says_how_many_samples(tmp_path, monkeypatch):
    seen = []
    make = offline.Studio

    def studio(stage, shot, *rest, **more):
        seen.append((shot.samples, shot.smooth))
        return make(stage, shot, *rest, **more)

    monkeypatch.setattr(offline, "Studio", studio)
    for quality in ("draft", "normal", "final"):
        assert render("-o", tmp_path / f"{quality}.png", "--quality", quality) == 0
    assert render("-o", tmp_path / "draft.exr", "--quality", "draft", "--no-antialias") == 0
    assert seen == [(1, True), (2, False), (3, False), (1, False)]
    draft, final = picture(tmp_path / "draft.png"), picture(tmp_path / "final.png")
    assert 0 < np.abs(draft - final).mean() < 0.03


def test_layer_and_occlusion_buffer_in_files_of_their_own(tmp_path):
    assert render("-o", tmp_path / "a.png", "--layer", tmp_path / "l.exr", "--occlusion-buffer", tmp_path / "o.exr") == 0
    assert render("-o", tmp_path / "b.exr") == 0
    layer, beside = channels(tmp_path / "l.exr"), channels(tmp_path / "b.exr")
    assert np.array_equal(layer["G"], beside["airlight.G"])
    source = channels(tmp_path / "o.exr")
    assert source["R"].shape == (48, 64)  # half of the size that two samples a side give
    assert source["R"][24, 32] == 0 and source["R"][2, 2] == pytest.approx(0.2159, rel=2e-3)


MEDIUM = ("--method", "march", "--resolution", "1", "--sigma-t", "0.05,0.1,0.2", "--light", "0.5,1,2;strength=40", "--tone", "none")


def test_a_medium_in_files(tmp_path):
    """Plain radiance, transmittance and depth, as floats beside the picture; all again in an EXR output, as halves."""
    options = ("--no-antialias", *MEDIUM)
    assert render("-o", tmp_path / "a.exr", "--layer", tmp_path / "l.exr", "--mix", "0.5", *options) == 0
    assert render("-o", tmp_path / "p.png", "--layer", tmp_path / "l.png", *options) == 0
    assert render("-o", tmp_path / "plain.exr", *options, "--sigma-t", "0,0,0") == 0
    found, layer, plain = (channels(tmp_path / f"{name}.exr") for name in ("a", "l", "plain"))
    assert set(layer) == {"R", "G", "B", "transmittance.R", "transmittance.G", "transmittance.B", "Z"}
    assert layer["R"].dtype == layer["transmittance.B"].dtype == np.float32
    assert layer["R"].max() > 0.05 and np.ptp(layer["Z"]) > 1
    seen = layer["Z"] < 100
    assert 0.1 < seen.mean() < 0.9
    for name, sigma_t in (("R", 0.05), ("G", 0.1), ("B", 0.2)):
        left = layer[f"transmittance.{name}"]
        assert left[~seen] == pytest.approx(np.exp(-sigma_t * 8), rel=1e-5)  # four times the scene's radius
        assert (left[seen] < np.exp(-sigma_t * layer["Z"][seen]) * 1.00001).all()  # the way is not shorter than its part along the axis
        np.testing.assert_allclose(found[f"airlight.{name}"], layer[name], rtol=1e-3, atol=1e-6)
        np.testing.assert_allclose(found[f"transmittance.{name}"], left, rtol=1e-3)
        assert not plain[f"airlight.{name}"].any() and (plain[f"transmittance.{name}"] == 1).all()
        np.testing.assert_allclose(found[name], left * plain[name] + 0.5 * layer[name], rtol=3e-3, atol=1e-5)
    shown = picture(tmp_path / "l.png")
    assert shown.shape == (48, 64, 3) and shown.max() > 0.05


def test_the_layer_of_a_medium_is_the_mean_of_a_pixels_samples(tmp_path):
    assert render("-o", tmp_path / "a.png", "--layer", tmp_path / "l.exr", *MEDIUM) == 0
    assert (
        render("-o", tmp_path / "b.png", "--layer", tmp_path / "fine.exr", *MEDIUM, "--no-antialias", "--width", "128", "--height", "96")
        == 0
    )
    mean, fine = channels(tmp_path / "l.exr"), channels(tmp_path / "fine.exr")
    for name in ("R", "B", "transmittance.G"):
        np.testing.assert_allclose(mean[name], offline.box(fine[name][..., None], 2)[..., 0], rtol=1e-5, atol=1e-7)


def test_a_light_that_is_not_seen_leaves_a_black_occlusion_buffer(tmp_path):
    studio = offline.Studio(stage(), offline.Shot(64, 48))
    assert studio.frame(source=True).source[..., :3].any()
    assert not studio.frame(turn=0.5, source=True).source.any()  # behind the camera: not what the frame before left


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Frames 1 to 6 in one run, with light adaptation."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "open_scene", stage)
        assert render("-o", folder / "f.####.png", "--frames", "1-6", "--fps", "6", "--adapt", "0.6", "--camera", "follower") == 0
    return folder


def test_a_range_that_is_split_or_resumed_gives_the_same_bytes(whole, tmp_path, capsys):
    options = ("--fps", "6", "--adapt", "0.6", "--camera", "follower")
    for frames in ("4-6", "1-3x2"):
        assert render("-o", tmp_path / "f.%04d.png", "--frames", frames, *options) == 0
    (tmp_path / "f.0004.png").write_bytes(b"damaged")
    capsys.readouterr()
    assert render("-o", tmp_path / "f.%04d.png", *options, "--resume") == 0  # the whole animation: 1 s
    assert "4 of 6 exist" in capsys.readouterr().err
    for path in sorted(whole.iterdir()):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()
    assert len(list(tmp_path.iterdir())) == 6
    assert "exists already, as do 5 more" in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "f.%04d.png", *options)
    assert render("-o", tmp_path / "f.%04d.png", *options, "-n") == 0


def test_a_range_with_the_pre_pass_can_be_split_too(tmp_path):
    options = ("--fps", "6", "--occluders", "prepass", "--camera", "follower")
    for name, frames in (("a", "1-4"), ("b", "4")):
        buffer = tmp_path / f"o{name}.##.exr"
        assert render("-o", tmp_path / f"{name}.##.exr", "--occlusion-buffer", buffer, "--frames", frames, *options) == 0
    for name in ("", "o"):
        assert (tmp_path / f"{name}a.04.exr").read_bytes() == (tmp_path / f"{name}b.04.exr").read_bytes()


def test_a_frame_by_its_time_is_that_of_the_range(whole, tmp_path):
    assert render("-o", tmp_path / "a.png", "--time", "0.5", "--adapt", "0.6", "--camera", "follower") == 0
    assert np.array_equal(read_image(tmp_path / "a.png").codes, read_image(whole / "f.0004.png").codes)
    assert json.loads(read_settings(str(whole / "f.0004.png"))) == {"adapt": 0.6, "camera": "follower", "height": 48, "scene": "box"} | {
        "time": 0.5,
        "width": 64,
    }


def test_settings_of_a_frame_repeat_it(tmp_path):
    assert render("-o", tmp_path / "t.##.png", "--turntable", "8", "--frames", "3", "--light", "0,1,-3;color=1,0.5,0.25;strength=2") == 0
    assert main(["render", "-o", str(tmp_path / "again.png"), "--settings-from", str(tmp_path / "t.03.png")]) == 0  # the scene too
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "t.03.png").read_bytes()


def test_settings_of_another_command_are_refused(tmp_path, capsys):
    assert render("-o", tmp_path / "a.png") == 0
    line = refused(capsys, "image", tmp_path / "a.png", "-o", tmp_path / "b.png", "--settings-from", tmp_path / "a.png")
    assert "`airlight render`" in line
    assert main(["image", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png"), "--light", "0.5,0.5", "--rays", "24"]) == 0
    assert "`airlight image`" in refused(capsys, "render", "box", "-o", tmp_path / "c.png", "--settings-from", tmp_path / "b.png")


def test_a_turntable_goes_around_the_centre():
    studio = offline.Studio(stage(), offline.Shot(64, 48, 1))
    turned, straight = studio.frame(turn=1 / 8).pixels(), studio.frame().pixels()
    assert np.abs(straight - turned).mean() > 0.01
    assert np.array_equal(studio.frame(turn=1 / 8).pixels(), turned)
    at = 5 * math.sin(math.pi / 4)
    seen = offline.Studio(stage(), offline.Shot(64, 48, 1, eye=(at, 0, at), target=(0, 0, 0)))  # counter-clockwise from +z: towards +x
    assert np.abs(seen.frame().pixels() - turned).mean() < 1e-3


def test_a_turntable_as_numbered_frames(tmp_path):
    assert render("-o", tmp_path / "t.##.png", "--turntable", "4", "--layer", tmp_path / "l.##.exr") == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"{c}.{i:02d}.{e}" for c, e in (("l", "exr"), ("t", "png")) for i in range(1, 5)]
    front, back = picture(tmp_path / "t.01.png"), picture(tmp_path / "t.03.png")
    assert np.abs(front - back).mean() > 0.01


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
        patch.setattr(video._At, "write", full)
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


def test_a_film_that_lost_a_frame_is_noticed(film):
    import av

    with open(film, "rb") as file:
        video._verify(av, file, "a.mp4", 64, 48, 12)
        for width, count in ((64, 13), (66, 12)):
            with pytest.raises(MachineError, match="did not read back"):
                video._verify(av, file, "a.mp4", width, 48, count)


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["-o", "a.mp4", "--width", "63"], "even width and height"),
        (["-o", "a.mp4", "--resume"], "numbered frames"),
        (["-o", "a.mp4", "--layer", "l.exr"], "numbered frames"),
        (["-o", "a.png", "--frames", "1-3"], "a.png: 3 frames do not go into one picture"),
        (["-o", "a.png", "--turntable", "3"], "pattern"),
        (["-o", "a.#.png", "--layer", "l.exr"], "l.exr: "),
        (["-o", "a.#.png", "--frames", "0"], "frame 0 lies before"),
        (["-o", "a.png", "--camera", "side"], "it has front, follower"),
        (["-o", "a.png", "--camera", "front", "--eye", "0,0,1"], "exclude each other"),
        (["-o", "a.png", "--fov", "20"], "--eye"),
        (["-o", "a.png", "--eye", "0,0"], "x,y,z"),
        (["-o", "a.png", "--eye", "0,nan,0"], "x,y,z"),
        (["-o", "a.png", "--eye", "0,1,0", "--target", "0,1,0"], "one place"),
        (["-o", "a.png", "--light", "0,1"], "x,y,z"),
        (["-o", "a.png", "--light", "0,1,2;colour=1,1,1"], "color=R,G,B"),
        (["-o", "a.png", "--sun", "10,91"], "beyond 90"),
        (["-o", "a.png", "--light", "0,1,2;strength=-1"], "not negative"),
        (["-o", "a.png", "--fps", "0"], "frames a second"),
        (["-o", "a.png", "--fps", "1/0"], "frames a second"),
        (["-o", "a.png", "--exclude", "wall"], "prepass"),
        (["-o", "a.png", "--method", "march", "--occlusion-buffer", "o.exr"], "with march give --layer"),
        (["-o", "a.png", "--exclude", "wal", "--occluders", "prepass"], "did you mean 'wall'?"),
        (["-o", "a.png", "--occlusion", "none"], "occlusion"),
        (["-o", "a.png", "--draw-path"], "leave --draw-path out"),
        (["-o", "a.png", "--device", "no such thing"], "no adapter matches"),
        (["-o", "a.gif"], "unknown extension"),
        (["-o", "nowhere/a.mp4"], "does not exist"),
        (["-o", "a.png", "--width", "16384", "--height", "16384"], "too large"),
        (["-o", "a.png", "--turn", "3", "--turntable", "4"], "exclude"),
        (["-o", "a.png", "--preset", "vespr-scene"], "did you mean 'vesper-scene'?"),
    ],
)
def test_refusals_are_one_line(args, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    size = [] if "--width" in args else SIZE
    assert says in refused(capsys, "render", "box", *size, *args)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("module", "extra"), [("av", "airlight[video]"), ("pygfx", "airlight[scenes]")])
def test_a_missing_extra_is_named(module, extra, tmp_path, monkeypatch, capsys):
    for name in list(sys.modules):
        if name.startswith("airlight.scenes"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    assert extra in refused(capsys, "render", "box", *SIZE, "-o", tmp_path / "a.mp4")


def test_a_sun_is_written_by_azimuth_and_elevation():
    for text, direction in (("0,0", (0, 0, -1)), ("90,0", (1, 0, 0)), ("180,0", (0, 0, 1)), ("270,30", (-math.sqrt(0.75), 0.5, 0))):
        assert read_scene_light(text, SUN).direction == pytest.approx(direction, abs=1e-12)
    light = read_scene_light("1,2,3;color=1,0.5,0;strength=2", PLACE)
    assert light.position == (1, 2, 3) and light.color == (1, 0.5, 0) and light.strength == 2


def test_a_light_moves_the_lamp_of_the_scene():
    at = stage()
    asked = (read_scene_light("1,2,-4;strength=2", PLACE), read_scene_light("0,1,0", PLACE), read_scene_light("90,10", SUN))
    studio = offline.Studio(at, offline.Shot(64, 48, 1, lights=asked))
    studio.frame(0.25)
    lamp = at.lights[0].target
    assert tuple(lamp.world.position) == (1, 2, -4)
    first, second, third = studio.shafts.lights
    assert first.target is lamp and first.strength == 2 and second.position == (0, 1, 0) and third.direction[0] > 0.9


def test_a_sun_turns_the_lamp_that_is_one():
    at = stage()
    sun = gfx.DirectionalLight()
    sun.local.position = (0, 3, 0)
    at.scene.add(sun)
    at.lights.append(SceneLight(sun))
    studio = offline.Studio(at, offline.Shot(64, 48, 1, lights=(read_scene_light("90,0", SUN),)))
    studio.frame()
    assert [light.target for light in studio.shafts.lights] == [sun]
    assert tuple(sun.world.position) == pytest.approx((3, 0, 0), abs=1e-9)


def test_a_broken_scene_is_a_failure_and_not_a_hole(monkeypatch):
    at = stage()
    studio = offline.Studio(at, offline.Shot(64, 48, 1))
    import logging

    monkeypatch.setattr(studio.renderer, "render", lambda *_: logging.getLogger("pygfx").error("no such texture\nat line 3"))
    with pytest.raises(MachineError, match="no such texture at line 3"):
        studio.frame()


def test_the_values_of_the_command_reach_the_pass(tmp_path, monkeypatch):
    seen = []
    make = offline.Studio

    def studio(stage, shot, parameters, composite, in_scene, **more):
        seen.append((parameters, composite, in_scene, more))
        return make(stage, shot, parameters, composite, in_scene, **more)

    monkeypatch.setattr(offline, "Studio", studio)
    options = ("--preset", "vesper", "--samples", "64", "--occluders", "stencil", "--clear", "#102030", "--mix", "0.5")
    assert render("-o", tmp_path / "a.exr", *options) == 0
    assert seen[0][0] == Parameters(
        method="radial", samples=64, density=0.8 * 149 / 150, decay=0.99, weight=0.8, exposure=0.05, normalization="listing"
    )
    more = {"medium": Medium(), "march": March(), "exclude": (), "linear": True}
    assert seen[0][1:] == (Composite(mix=0.5), SceneOptions(clear="#102030"), more)


def test_a_medium_reaches_the_pass_and_is_repeated(tmp_path, monkeypatch, capsys):
    seen = []
    make = offline.Studio

    def studio(*given, **more):
        seen.append((given[2], more["medium"], more["march"]))
        return make(*given, **more)

    monkeypatch.setattr(offline, "Studio", studio)
    options = ("--medium", "clear-air", "--albedo", "0.5,0.25,1", "--steps", "exact", "--shadow-size", "64", "--no-extinction", "--snap")
    assert render("-o", tmp_path / "a.exr", *options) == 0
    air = presets.load("clear-air", presets.MEDIA)
    assert seen[0] == (
        Parameters(method="march", quality=seen[0][0].quality),
        Medium(**air | {"albedo": (0.5, 0.25, 1)}, extinction=False),
        March(steps="exact", shadow_size=64, snap=True),
    )
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and err.startswith("airlight: warning: the medium is too thin to be seen")
    assert render("-o", tmp_path / "b.exr", "--settings-from", tmp_path / "a.exr") == 0
    assert seen[1] == seen[0] and json.loads(read_settings(str(tmp_path / "a.exr"))) == json.loads(read_settings(str(tmp_path / "b.exr")))
    assert render("-o", tmp_path / "c.exr", "--settings-from", tmp_path / "a.exr", "--sigma-t", "0.1", "--extinction") == 0
    assert seen[2][1] == Medium(**air | {"albedo": (0.5, 0.25, 1), "sigma_t": (0.1, 0.1, 0.1)})
    assert capsys.readouterr().err.count("warning") == 1  # of b, not of c


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


@pytest.mark.parametrize("scene", ["flying", "table", "file"])
def test_the_scenes_themselves(scene, glb, tmp_path, monkeypatch):
    monkeypatch.undo()
    path = tmp_path / "a.png"
    command = ["render", str(glb) if scene == "file" else scene, "--quality", "draft", *SIZE]
    assert main([*command, "-o", str(path)]) == 0
    assert np.ptp(picture(path)) > 0.1
    if scene == "flying":
        for option in (["--draw-path"], ["--seed", "8"]):
            assert main([*command, "-o", str(path.with_suffix(".exr")), "-y", "--time", "3", *option]) == 0
            assert main([*command, "-o", str(path), "-y", "--settings-from", str(path.with_suffix(".exr"))]) == 0
            assert json.loads(read_settings(str(path))) == json.loads(read_settings(str(path.with_suffix(".exr"))))
