"""Presets: those that come with Airlight are valid; a bad one is refused with its file, its key, and a cure."""

import os
from pathlib import Path

import numpy as np
import pytest
import thumbs

import airlight
from airlight.errors import AirlightError
from airlight.files import read_image, write_image
from airlight.options import Composite, Daylight, Look, Parameters, build, chosen_look, presets

SUM = {*Parameters.__struct_fields__, *Composite.__struct_fields__}


@pytest.mark.parametrize("name", presets.names())
def test_our_presets_load(name):
    values = presets.load(name)
    assert values and presets.description(name)
    built = build(values)
    if built[Daylight] != Daylight():
        assert built[Daylight].daylight == "air" and {one.name for one in Daylight.options()} >= values.keys()
    elif chosen_look(values, values.get("look")) == "classic":
        assert built[Parameters] != Parameters()
    else:
        assert built[Look] != Look()


def test_looks_and_sums_by_their_names():
    """Those that were sums are looks now, and the sums have names that say so."""
    looks = {name for name in presets.names() if "daylight" not in presets.load(name) and chosen_look(presets.load(name)) == "smart"}
    assert looks == {"natural", "subtle", "dramatic", "long", "soft", "misty", "golden"}
    assert {f"classic-{name}" for name in ("subtle", "dramatic", "long", "soft")} <= set(presets.names()) - looks
    for name in presets.names():
        assert name.startswith("classic-") == presets.description(name).startswith("the sum alone"), name


def test_the_defaults_of_known_systems():
    assert set(presets.names()) >= {"vesper", "babylon", "pmndrs"}
    systems = {name: build(presets.load(name))[Parameters] for name in ("vesper", "babylon", "pmndrs")}
    assert systems["vesper"].lam == pytest.approx(1.5, abs=0.01)
    assert systems["babylon"].lam == pytest.approx(3.24, abs=0.01)
    assert systems["pmndrs"].lam == pytest.approx(6.3, abs=0.03)
    for one in systems.values():
        assert (one.method, one.normalization) == ("radial", "listing")


def write(tmp_path, text):
    path = tmp_path / "my.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_file_may_hold_any_parameter(tmp_path):
    path = write(tmp_path, 'description = "mine"\nsamples = 7\nweight = 1\n')
    assert presets.load(path) == {"samples": 7, "weight": 1}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("densty = 1.0", "'densty'; did you mean 'density'"),
        ("[shafts]\ndensity = 1.0", "'shafts'"),
        ('samples = "7"', "samples"),
        ("samples = 7.5", "samples"),
        ("samples = true", "samples"),
        ("decay = 2.0", "decay"),
        ("decay = nan", "decay"),
        ("weight = inf", "weight"),
        ('method = "magic"', "method"),
        ("scale = 0.3", "scale"),
        ("description = 3", "description"),
        ("decay = ", "not TOML"),
        ("decay = 0.9\ndecay = 0.8", "not TOML"),
        (b"\xff\xfe", "not TOML"),
        ("a = " + "[" * 5000, "my.toml"),
        ("a = " + "9" * 9999, "my.toml"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, says):
    with pytest.raises(AirlightError) as caught:
        presets.load(write(tmp_path, text))
    message = str(caught.value)
    assert says in message and "my.toml" in message


def test_what_is_no_file_is_refused(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.toml")
    for name in ("folder.toml", "pipe.toml", "nosuch.toml", "\0.toml"):
        with pytest.raises(AirlightError):
            presets.load(tmp_path / name)
    with pytest.raises(AirlightError, match="did you mean 'vesper'"):
        presets.load("vespr")


def test_a_preset_of_the_functions():
    """It stands for its values, keywords go before them, and what it says of scenes is left out."""
    image = thumbs.codes()

    def added(**keywords):
        return airlight.add_light_shafts(image, (0.5, 0.4), **keywords)

    assert np.array_equal(added(preset="long"), added(strength=1.3, length=1.5))
    assert np.array_equal(added(preset="long", strength=0.2), added(strength=0.2, length=1.5))
    assert not np.array_equal(added(preset="long"), added())
    assert np.array_equal(added(preset="vesper-scene"), added(**{k: v for k, v in presets.load("vesper-scene").items() if k in SUM}))
    with pytest.raises(AirlightError, match="did you mean 'long'"):
        added(preset="lnog")


@pytest.mark.parametrize("function", [airlight.add_light_shafts, airlight.find_light, lambda v: airlight.light_shafts(v, (0, 0))])
def test_a_path_is_no_image(tmp_path, function):
    path = tmp_path / "a.png"
    write_image(path, np.zeros((4, 4, 3), np.float32))
    for given in (str(path), path):
        with pytest.raises(AirlightError, match=r"image is a path, .*a\.png.: read it first, as airlight\.files\.read_image\(PATH\)"):
            function(given)
    with pytest.raises(AirlightError, match=r"give its array, its \.codes"):
        function(read_image(path))


def test_a_file_nested_deeply_is_refused_before_it_is_read(tmp_path: Path) -> None:
    """At Python's own limit destructors fail elsewhere, with lines on stderr."""
    file = tmp_path / "deep.toml"
    file.write_text("a = " + "[" * 201 + "]" * 201)
    with pytest.raises(AirlightError, match="nested too deeply"):
        presets.load(str(file))
