"""Looks by the command line: which is chosen, and what settings keep."""

import json

import numpy as np
import pytest
import thumbs
from look_commands import LIGHT, codes, refused, run

import airlight
from airlight.composite.blend import auto_levels_of, blend, resolve
from airlight.files import encode, read_settings, to_linear, write_image
from airlight.options import Composite


@pytest.mark.parametrize(
    ("extension", "args"),
    [
        ("png", []),
        ("jpg", ["--depth", "near.png", "--near-range", "0.1,0.9"]),
        ("exr", ["--depth", "far.png", "--depth-near", "white", "--light", "auto:1+", "--shade", "0.2"]),
        ("png", ["--depth", "near.png", "--no-depth-aware"]),
        ("tif", ["--subject", "subject.png", "--wrap", "0.7", "--strength", "0.6"]),
        ("png", ["--rays", "9", "--rays-seed", "3", "--rays-shimmer", "0.25", "--light", "0.6,0.2;kind=glow;color=1,0.8,0.6"]),
        ("exr", ["--preset", "dramatic", "--fineness", "1.5", "--length", "0.3", "--warmth", "-0.4", "--quality", "draft", "--mist", "1"]),
        ("png", ["--mask", "near.png", "--mask-invert", "--light", "0.5,0.4;strength=2", "--light", "-0.2,0.1"]),
    ],
)
def test_settings_of_the_smart_look_repeat_to_the_byte(shots, photo, tmp_path, capsys, monkeypatch, extension, args):
    monkeypatch.chdir(shots)
    one, two = (tmp_path / f"{name}.{extension}" for name in ("one", "two"))
    said = run(capsys, photo, "-o", one, *args)
    held = json.loads(read_settings(one))
    assert held["look"] == "smart" and (("light at" in said) == ("--light" not in args or "auto:1+" in args))
    if "light at" in said:
        assert held["light"][0].endswith(";kind=opening")  # found: what it is, and where
    assert "light at" not in run(capsys, photo, "-o", two, "--settings-from", one)
    assert two.read_bytes() == one.read_bytes()
    plain = tmp_path / f"plain.{extension}"
    if args and "--no-depth-aware" not in args:  # each option shapes the result
        run(capsys, photo, "-o", plain)
        assert not np.array_equal(codes(plain), codes(one))


def test_settings_from_before_there_were_looks_are_of_the_sum(photo, tmp_path, capsys):
    old, classic = tmp_path / "old.png", tmp_path / "classic.png"
    for settings, args in (
        ('{"light": ["0.5,0.4"]}', []),
        ('{"decay": 0.9, "light": ["0.5,0.4"], "samples": 60}', ["--decay", "0.9", "--samples", "60"]),
        ('{"light": ["0.5,0.4"], "quality": "draft"}', ["--quality", "draft"]),
    ):
        write_image(old, None, encoded=codes(photo), settings=settings, overwrite=True)
        run(capsys, photo, "-o", classic, "-y", "--light", "0.5,0.4", "--look", "classic", *args)
        run(capsys, photo, "-o", tmp_path / "again.png", "-y", "--settings-from", old)
        assert (tmp_path / "again.png").read_bytes() == classic.read_bytes()
        assert json.loads(read_settings(classic))["look"] == "classic"
        assert "strength" in refused(capsys, "image", photo, "-o", tmp_path / "no.png", "--settings-from", old, "--strength", "2")
    run(capsys, photo, "-o", tmp_path / "smart.png", *LIGHT)
    for more in (["--samples", "9"], ["--preset", "classic-soft"], ["--look", "smart", "--preset", "pmndrs"]):
        refused(capsys, "image", photo, "-o", tmp_path / "no.png", "--settings-from", tmp_path / "smart.png", *more)
    assert not (tmp_path / "no.png").exists()


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--strength", "1", "--samples", "9"], "samples belongs to the classic look, strength does not"),
        (["--look", "smart", "--exposure", "1.5"], "exposure belongs to the classic look"),
        (["--look", "classic", "--mist", "0.5"], "mist belongs to the smart look"),
        (["--angle", "30", "--strength", "1"], "--angle belongs to the classic look"),
        (["--preset", "natural", "--threshold", "1"], "threshold belongs to the classic look"),
        (["--preset", "natural", "--look", "classic"], "strength belongs to the smart look"),
        (["--preset", "classic-soft", "--rays", "3"], "classic look, rays does not"),
        (["--preset", "both.toml"], "samples belongs to the classic look, strength does not"),
        (["--preset", "smart.toml", "--blend", "add"], "blend belongs to the classic look"),
        (["--preset", "classic.toml", "--look", "smart"], "samples belongs to the classic look"),
        (["--preset", "classic.toml", "--warmth", "0"], "samples belongs to the classic look, warmth does not"),
        (["--debug", "mask", "--strength", "1"], "--debug belongs to the classic look"),
        (["--occlusion-fraction", "f.png", "--shade", "0.5"], "--occlusion-fraction belongs to the classic look"),
        (["--depth", "near.png", "--occlusion", "depth", "--fineness", "1"], "occlusion belongs to the classic look"),
        (["--subject", "subject.png", "--look", "classic"], "--subject is for the smart look"),
        (["--subject", "subject.png", "--decay", "0.9"], "--subject is for the smart look"),
        (["--wrap", "0.5"], "add --subject FILE"),
        (["--near-range", "0.1,0.5"], "add --depth FILE"),
        (["--no-depth-aware"], "add --depth FILE"),
        (["--depth", "near.png", "--look", "classic", "--near-range", "0.1,0.5"], "leave the classic look"),
        (["--depth", "near.png", "--near-range", "0.5,0.1"], "the first the smaller"),
        (["--depth", "near.png", "--near-range", "low,high"], "two numbers"),
        (["--depth", "near.png", "--depth-layer", "Z"], "near.png: has no channel 'Z': it is no EXR"),
        (["--subject", "near.png", "--subject-layer", "Z"], "near.png: has no channel 'Z': it is no EXR"),
        (["--depth-layer", "Z"], "has no channel 'Z'"),
        (["--subject-layer", "Z"], "has no channel 'Z'"),
        (["--depth", "small.png"], "the depth is 5 x 4 pixels, the image 96 x 64"),
        (["--subject", "small.png"], "the subject is 5 x 4 pixels, the image 96 x 64"),
        (["--mask", "small.png"], "the mask is 5 x 4 pixels, the image 96 x 64"),
    ],
)
def test_what_does_not_go_together_is_refused_in_one_line(shots, photo, tmp_path, capsys, monkeypatch, args, says):
    monkeypatch.chdir(tmp_path)
    for name in ("near", "subject"):
        (tmp_path / f"{name}.png").write_bytes((shots / f"{name}.png").read_bytes())
    write_image(tmp_path / "small.png", None, encoded=np.zeros((4, 5, 3), np.uint8))
    for name, text in {"both": "strength = 1.0\nsamples = 9", "smart": "mist = 0.2", "classic": "samples = 9"}.items():
        (tmp_path / f"{name}.toml").write_text(text)
    light = [] if "--angle" in args else LIGHT
    before = sorted(tmp_path.iterdir())
    assert says in refused(capsys, "image", photo, "-o", "out.png", *light, *args)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("command", "says"),
    [
        (["render", "box", "--preset", "natural"], "belongs to a look, which a scene has not"),
        (["render", "box", "--strength", "1"], "--strength"),
        (["compare", "PHOTO", "--variant", "strength=1"], "which a comparison of methods has not"),
        (["compare", "PHOTO", "--variant", "misty", "--variant", "samples=9"], "which a comparison of methods has not"),
        (["compare", "PHOTO", "--preset", "soft"], "which a comparison of methods has not"),
    ],
)
def test_looks_are_of_pictures_alone(photo, tmp_path, capsys, command, says):
    words = [str(photo) if word == "PHOTO" else word for word in command]
    assert says in refused(capsys, *words, "-o", tmp_path / "out.png")
    assert not list(tmp_path.iterdir())


def test_quality_is_of_both_looks(photo, tmp_path, capsys):
    run(capsys, photo, "-o", tmp_path / "a.png", *LIGHT, "--quality", "draft")
    assert json.loads(read_settings(tmp_path / "a.png"))["look"] == "smart"
    run(capsys, photo, "-o", tmp_path / "b.png", *LIGHT, "--quality", "draft", "--look", "classic")
    assert json.loads(read_settings(tmp_path / "b.png"))["look"] == "classic"
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_classic_look_is_what_the_default_was(photo, tmp_path, capsys, dtype):
    """The sum of `light_shafts`, put on the picture as ever; the same whether it is named or implied."""
    linear = thumbs.linear()
    image = {"f4": linear.copy(), "u1": thumbs.codes()}.get(np.dtype(dtype).str[1:], encode(linear, np.uint16))
    classic = airlight.add_light_shafts(image, (0.52, 0.42), look="classic")
    for implied in ({"exposure": 1.5}, {"samples": 100, "density": 0.97}, {"occlusion": "luminance"}, {"blend": "auto"}):
        assert np.array_equal(classic, airlight.add_light_shafts(image, (0.52, 0.42), **implied))
    assert not np.array_equal(classic, airlight.add_light_shafts(image, (0.52, 0.42)))
    layer = np.asarray(airlight.light_shafts(image, (0.52, 0.42)))
    if dtype == np.float32:
        assert np.array_equal(classic, image + layer)
        return
    values = to_linear(image)[0]
    out, added = blend(values, layer, auto_levels_of(values, layer, resolve(Composite(), False)))
    expected = encode(out, dtype, added.any(axis=2), image)
    assert np.abs(expected.astype(int) - classic.astype(int)).max() <= (1 if dtype == np.uint8 else 300)
    if dtype == np.uint8:
        for name, more in (("a", ["--look", "classic"]), ("b", ["--exposure", "1.5"])):
            run(capsys, photo, "-o", tmp_path / f"{name}.png", *LIGHT, *more)
            assert np.array_equal(codes(tmp_path / f"{name}.png"), classic)
