"""Depths, subjects and places of light for the looks by the command line."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest
import thumbs
from look_commands import LIGHT, SHAPE, codes, layer_of, plane_of_subject, refused, run
from test_compositing import load, store

import airlight
from airlight.detect import ASK
from airlight.files import read_settings


@pytest.mark.parametrize("more", [[], ["--near-range", "0.2,0.5"]])
def test_depths_in_metres_within_an_exr(tmp_path, capsys, more):
    """Shafts pass behind the near half; the sky is infinitely far."""
    depth = np.full((*SHAPE, 1), 80, np.float32)
    depth[:, : SHAPE[1] // 2] = np.linspace(1.5, 1.6, SHAPE[1] // 2)[:, None]
    depth[: SHAPE[0] // 4, SHAPE[1] // 2 :] = np.inf
    pixels = np.concatenate([thumbs.linear(), depth], axis=2)
    source = store(tmp_path / "in.exr", pixels, "RGBZ", ["half"] * 3 + ["float"])
    run(capsys, source, "-o", tmp_path / "free.exr", *LIGHT)
    run(capsys, source, "-o", tmp_path / "out.exr", *LIGHT, "--depth-layer", "Z", *more)
    free, layer = layer_of(tmp_path / "free.exr"), layer_of(tmp_path / "out.exr")
    half = SHAPE[1] // 2
    assert free[:, :half].max() > 0.02 and layer[:, half:].max() > 0.02
    assert layer[:, : half - 1].max() == 0 and layer[: SHAPE[0] // 4, half:].max() > 0
    run(capsys, source, "-o", tmp_path / "off.exr", *LIGHT, "--depth-layer", "Z", "--no-depth-aware")
    assert np.array_equal(layer_of(tmp_path / "off.exr"), free)
    assert "did you mean 'Z'" in refused(capsys, "image", source, "-o", tmp_path / "no.exr", *LIGHT, "--depth-layer", "ZZ")
    assert np.array_equal(load(tmp_path / "out.exr")[1]["Z"], depth[..., 0])


def test_depth_maps_either_way_round(shots, photo, tmp_path, capsys):
    for name, more in (("near", []), ("far", ["--depth-near", "white"])):
        run(capsys, photo, "-o", tmp_path / f"{name}.exr", *LIGHT, "--depth", shots / f"{name}.png", *more)
    layer = layer_of(tmp_path / "near.exr")
    assert layer[:, : SHAPE[1] // 2 - 1].max() == 0 and layer[:, SHAPE[1] // 2 + 1 :].max() > 0.02
    assert np.array_equal(layer, layer_of(tmp_path / "far.exr"))


def test_depths_that_emit_are_of_the_sum(shots, photo, tmp_path, capsys):
    run(capsys, photo, "-o", tmp_path / "a.png", *LIGHT, "--depth", shots / "near.png", "--occlusion", "depth")
    held = json.loads(read_settings(tmp_path / "a.png"))
    assert (held["look"], held["occlusion"]) == ("classic", "depth")
    far = codes(shots / "near.png")[..., 0].astype(np.float32) / 255
    expected = airlight.add_light_shafts(codes(photo), (0.52, 0.42), occlusion="depth", depth=far)
    assert np.array_equal(codes(tmp_path / "a.png"), expected)
    run(capsys, photo, "-o", tmp_path / "b.png", *LIGHT, "--depth", shots / "near.png", "--look", "classic")  # what else for?
    assert np.array_equal(codes(tmp_path / "b.png"), expected)


def test_shafts_pass_behind_a_subject_and_wrap_round_its_edge(shots, photo, tmp_path, capsys):
    subject = plane_of_subject()
    edge = subject.copy()
    edge[SHAPE[0] // 2 + 2 :, SHAPE[1] // 4 + 2 : 3 * SHAPE[1] // 4 - 2] = False
    deep = np.zeros_like(subject)
    deep[SHAPE[0] // 2 + 12 :, SHAPE[1] // 4 + 12 : 3 * SHAPE[1] // 4 - 12] = True
    layers = []
    for wrap in ("0", "1"):
        out = tmp_path / f"{wrap}.exr"
        run(capsys, photo, "-o", out, *LIGHT, "--subject", shots / "subject.png", "--wrap", wrap, "--mist", "1")
        layers.append(layer_of(out).max(axis=2))
    hard, soft = layers
    assert hard[subject].max() == 0 and hard[~subject].max() > 0.02
    assert soft[edge].max() > 0.001 and soft[deep].max() < 0.1 * soft[edge].max() and (soft[subject] >= 0).all()


def test_candidates_are_shown_and_listed(shots, tmp_path, capsys):
    source, sheet, listed = shots / "dandelions.png", tmp_path / "sheet.png", tmp_path / "list.json"
    said = run(capsys, source, "--candidates", sheet)
    found = [line for line in said.splitlines() if line[0].isdigit()]
    assert len(found) >= 2 and found[0].startswith("1: 0.5") and "glow, confidence 0." in found[0] and found[1].startswith("2: ")
    assert codes(sheet).shape == codes(source).shape and not np.array_equal(codes(sheet), codes(source))
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]
    run(capsys, source, "--candidates", listed, "-o", tmp_path / "out.png")
    places = json.loads(listed.read_text())
    assert len(places) == len(found) and set(places[0]) == {"position", "kind", "confidence", "guess", "lamps"}
    assert places[0]["confidence"] >= places[1]["confidence"]
    assert [f"{v:.3f}" for v in places[0]["position"]] == found[0].split()[1].split(",")
    assert not np.array_equal(codes(tmp_path / "out.png"), codes(source))
    for path in (sheet, listed):
        old = path.read_bytes()
        assert "exists already" in refused(capsys, "image", source, "--candidates", path)
        assert path.read_bytes() == old
        run(capsys, source, "--candidates", path, "-y")
        assert path.read_bytes() == old


def test_candidates_that_cannot_be_shown(shots, photo, tmp_path, capsys):
    out = tmp_path / "sheet.png"
    for sources in ([photo, shots / "dandelions.png"], [shots / "shot.####.png"]):
        assert "--candidates shows one picture" in refused(capsys, "image", *sources, "--candidates", out)
    assert "input" in refused(capsys, "image", photo, "--candidates", photo, "-y")
    assert ".xyz" in refused(capsys, "image", photo, "--candidates", tmp_path / "sheet.xyz")
    assert "does not exist" in refused(capsys, "image", photo, "--candidates", tmp_path / "no" / "sheet.json")
    assert not list(tmp_path.iterdir())
    assert "no light found: give --light X,Y" in run(capsys, shots / "dark.png", "--candidates", tmp_path / "none.json")
    assert json.loads((tmp_path / "none.json").read_text()) == []


def test_the_next_place_and_the_best_together(shots, tmp_path, capsys):
    source = shots / "dandelions.png"
    found = airlight.detect.find_lights(codes(source))

    def lights(name: str, text: str) -> list[str]:
        run(capsys, source, "-o", tmp_path / name, "--light", text)
        return json.loads(read_settings(tmp_path / name))["light"]

    def near(text: str, place: tuple[float, float]) -> bool:
        return np.allclose([float(v) for v in text.split(";")[0].split(",")], place, atol=1e-3)

    (second,) = lights("a.png", "auto:2")
    assert near(second, found[1].position) and second.endswith(f";kind={found[1].kind}")
    both = lights("b.png", "auto:2+")
    assert len(both) == 2 and all(near(text, one.position) for text, one in zip(both, found, strict=False))
    line = refused(capsys, "image", source, "-o", tmp_path / "c.png", "--light", "auto:9")
    assert f"only {len(found)} places look like a light" in line and "--candidates FILE" in line and not (tmp_path / "c.png").exists()
    source = shots / "night-light-frames.png"
    lamps = lights("d.png", "auto:3+")
    assert len(lamps) == 3 and all(text.endswith(";kind=lamps") for text in lamps)


def test_an_unsure_light_leaves_the_bytes_of_a_jpeg(shots, tmp_path, capsys):
    """And everything that is no JPEG its codes; the exit code is 0, so that a batch goes on."""
    from airlight.detect import find_lights

    assert not find_lights(codes(shots / "dark.png")) or find_lights(codes(shots / "dark.png"))[0].confidence < ASK
    jpeg = oiio.ImageOutput.create("jpeg")
    assert jpeg.open(str(tmp_path / "in.jpg"), oiio.ImageSpec(96, 64, 3, "uint8"))
    assert jpeg.write_image(np.full((64, 96, 3), 9, np.uint8)) and jpeg.close()
    for look in ("smart", "classic"):
        said = run(capsys, tmp_path / "in.jpg", "-o", tmp_path / "out.jpg", "-y", "--look", look)
        assert said.endswith("in.jpg: no light found, left as it is: give --light X,Y\n") and said.count("\n") == 1
        assert (tmp_path / "out.jpg").read_bytes() == (tmp_path / "in.jpg").read_bytes()
    store(tmp_path / "in.exr", np.full((64, 96, 4), 0.01, np.float32), "RGBA", "float")
    run(capsys, tmp_path / "in.exr", "-o", tmp_path / "out.exr")
    assert np.array_equal(codes(tmp_path / "in.exr"), codes(tmp_path / "out.exr")) and layer_of(tmp_path / "out.exr").max() == 0
    run(capsys, shots / "dark.png", "-o", tmp_path / "out.png", "--layer", tmp_path / "layer.png")
    assert np.array_equal(codes(shots / "dark.png"), codes(tmp_path / "out.png")) and codes(tmp_path / "layer.png").max() == 0
