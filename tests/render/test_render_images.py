"""`airlight render` to images: what an EXR holds, layers, samples."""

import math

import numpy as np
import pytest
from render_stage import channels, picture, render, stage

from airlight.files import read_image
from airlight.scenes import offline


def test_the_same_command_gives_the_same_bytes(tmp_path):
    for extension in ("png", "exr", "jpg"):
        paths = [tmp_path / f"{i}.{extension}" for i in range(2)]
        for path in paths:
            assert render("-o", path, "--adapt", "0.5", "--time", "0.3") == 0
        assert paths[0].read_bytes() == paths[1].read_bytes()
    assert read_image(tmp_path / "0.png").codes.shape == (48, 64, 3)


def test_an_exr_holds_light_layer_and_depth(tmp_path):
    assert render("-o", tmp_path / "a.exr", "--no-antialias", "--view-transform", "filmic") == 0
    assert render("-o", tmp_path / "plain.exr", "--no-antialias", "--mix", "0") == 0
    found, plain = channels(tmp_path / "a.exr"), channels(tmp_path / "plain.exr")
    assert list(found) == ["R", "G", "B", "A", "Z", "airlight.R", "airlight.G", "airlight.B"]
    assert (found["A"] == 1).all()
    wall, sky = found["Z"][24, 32], found["Z"][2, 2]
    assert wall == pytest.approx(5.0, rel=1e-4)
    assert sky == np.float32(offline.FAR_METRES)
    inside = found["Z"] < 6
    assert np.ptp(found["Z"][inside]) < 1e-3  # planar: the same all over the wall
    assert found["airlight.R"].max() > 0.05
    for c in "RGB":
        assert not plain["airlight." + c].any()
        assert np.abs(found[c] - found["airlight." + c] - plain[c]).max() < 4e-3 * max(1.0, found[c].max())
    lamp = found["Z"] == np.float32(offline.FAR_METRES)
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
    options = ("--mix", "0", "--view-transform", "none", "--eye", "0.3,0.2,5", "--target", "0.3,0.2,0", "--fov", "50")
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


MEDIUM = ("--method", "march", "--resolution", "1", "--sigma-t", "0.05,0.1,0.2", "--light", "0.5,1,2;strength=40")
MEDIUM += ("--view-transform", "none")


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
