"""What is misspelt is answered by what was meant, in the same words wherever it is."""

import numpy as np
import pytest

import airlight
from airlight.cli import main
from airlight.errors import AirlightError
from airlight.files import read_image, write_image
from airlight.messages import close, nearest, nearest_file, number
from airlight.options import Parameters, presets


def test_nearest():
    assert nearest("densty", ["decay", "density"]) == "; did you mean 'density'?"
    assert nearest("DENSITY", ["decay", "density"]) == nearest("densty", ["Density"]).lower() == "; did you mean 'density'?"
    assert nearest("xyz", ["decay", "density"], "; use decay") == "; use decay" and nearest("xyz", []) == ""
    assert [number(value, 2) for value in (114.0, 3.14159, 0.00123, 999999.0)] == ["110", "3.1", "0.0012", "1e+06"]
    assert close("tree", ["Tree", "TREE", "trees"], 3) == ["Tree", "TREE", "trees"]


def test_nearest_file(tmp_path, monkeypatch):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "beach.jpg").touch()
    meant = f"; did you mean '{tmp_path / 'photos' / 'beach.jpg'}'?"
    for wrong in ("photos/beech.jpg", "photos/beach.jpeg", "photo/beach.jpg", "Photos/beach.jpg"):
        if not (tmp_path / wrong).exists():  # on a file system without cases
            assert nearest_file(str(tmp_path / wrong)) == meant
    monkeypatch.chdir(tmp_path / "photos")
    assert nearest_file("bech.jpg") == "; did you mean 'beach.jpg'?"
    (tmp_path / "photos" / "opening.jpg").touch()
    for nothing in ("nothing.jpg", "bright.jpg", "mountain.png", "/nosuch/bech.jpg", "", "a\0b"):
        assert nearest_file(nothing, "; no") == "; no"


@pytest.mark.parametrize(
    ("args", "meant"),
    [
        (["imge"], "image"),
        (["image", "a.png", "--densty", "1"], "--density"),
        (["image", "a.png", "--method", "epipoler"], "epipolar"),
        (["image", "a.png", "--look", "smrt"], "smart"),
        (["image", "a.png", "--quality", "finel"], "final"),
        (["image", "a.png", "--depth-near", "whte"], "white"),
        (["image", "a.png", "--blend", "screan"], "screen"),
        (["image", "a.png", "--on-damage", "warm"], "warn"),
        (["image", "a.png", "--debug", "masks"], "mask"),
        (["image", "a.png", "--format", "jpgg"], "jpg"),
        (["image", "a.png", "--preset", "misti"], "misty"),
        (["image", "a.png", "--preset", "min.toml"], "mine.toml"),
        (["image", "a.png", "--preset", "mine.tml"], "mine.toml"),
        (["image", "a.png", "--light", "0,0;colour=1,1,1"], "color"),
        (["image", "a.png", "--light", "0,0;kind=disk"], "disc"),
        (["image", "b.png"], "a.png"),
        (["image", "a.png", "--mask", "ab.png"], "a.png"),
        (["image", "a.png", "--settings-from", "b.png"], "a.png"),
        (["image", "a.png", "-o", "out.pmg"], ".png"),
        (["image", "a.png", "-o", "foldr/out.png"], "{here}/folder"),
        (["image", "a.png", "-o", "x.exr", "--compression", "zps"], "zips"),
        (["image", "a.png", "--light", "aut"], "auto"),
        (["image", "a.png", "--light", "aut:2"], "auto"),
        (["image", "a.png", "--preset", "dramatc.toml"], "dramatic"),
        (["image", "a.png", "--preset", "other/min.toml"], None),
        (["render", "table", "--medium", "hze.toml"], "haze"),
        (["render", "table", "--steps", "exat"], "exact"),
        (["render", "tble"], "table"),
        (["render", "romm.glb"], "room.glb"),
        (["render", "table", "--medium", "hase"], "haze"),
        (["render", "table", "--camera", "frnt"], None),
        (["view", "flyng"], "flying"),
        (["compare", "a.pmg"], "a.png"),
        (["compare", "a.png", "--against", "tracr"], "tracer"),
        (["compare", "a.png", "--variant", "samplse=3"], "samples"),
        (["bench", "--jsn", "a"], "--json"),
    ],
)
def test_what_was_meant(args, meant, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "mine.toml").write_text("strength = 1\n")
    (tmp_path / "empty.toml").touch()
    (tmp_path / "room.glb").touch()
    write_image(tmp_path / "a.png", np.zeros((4, 4, 3), np.float32))
    output = [] if "-o" in args or args[0] not in ("image", "render", "compare") else ["-o", "x.png"]
    assert main([*args, *output]) == 2
    said = capsys.readouterr().err
    assert said.startswith("airlight: ") and said.count("\n") == 1
    if meant is not None:
        assert f"did you mean {meant.format(here=tmp_path)!r}?" in said
    else:
        assert "it has " in said or "give a preset's name" in said


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (
            ["image", "a.png", "--medium", "haze"],
            "--medium is no option of `airlight image`; `airlight render`, `airlight view` and `airlight compare` have it",
        ),
        (
            ["bench", "--medium", "haze"],
            "--medium is no option of `airlight bench`; `airlight render`, `airlight view` and `airlight compare` have it",
        ),
        (["view", "table", "--screenshot", "a.jpgg"], "a.jpgg: unknown extension '.jpgg'; did you mean '.jpg'?"),
        (["view", "a.png", "--browsr"], "--browsr is no option of `airlight view`; did you mean '--browser'?"),
        (["info", "--qwertz"], "--qwertz is no option of `airlight info`; --help-all shows all"),
        (
            ["--sun"],
            "--sun is no option of `airlight`; `airlight image`, `airlight render`, `airlight view` and `airlight compare` have it",
        ),
        (["--qwertz"], "--qwertz is no option of `airlight`; --help shows all"),
        (["image", "-o", "a.png"], "Missing argument 'IN...'; `airlight image --help` shows examples"),
        (["fly"], "there is no command 'fly'; there is image, render, view, compare, info, bench"),
    ],
)
def test_options_of_other_commands(args, says, capsys):
    assert main(args) == 2 and capsys.readouterr().err == f"airlight: {says}\n"


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--light", "left"], "write x,y as in 0.5,0.2 or 960px,200px or 50%,20%; or auto, which finds it"),
        (["--samples", "many"], "'many' is no whole number."),
        (["--strength", "much"], "'much' is no number."),
    ],
)
def test_what_is_no_number(args, says, capsys):
    assert main(["image", "a.png", "-o", "b.png", *args]) == 2 and capsys.readouterr().err.endswith(f"{says}\n")


def test_what_was_meant_in_python(tmp_path):
    image = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(AirlightError, match="not 'aut'; did you mean 'auto'"):
        airlight.add_light_shafts(image, light="aut")
    with pytest.raises(AirlightError, match=r"not 'auto'; airlight\.find_light finds one"):
        airlight.light_shafts(image, "auto")
    for words, meant in (({"densty": 1}, "density"), ({"method": "radail", "look": "classic"}, "radial"), ({"qualty": "draft"}, "quality")):
        with pytest.raises(AirlightError, match=f"did you mean '{meant}'"):
            airlight.add_light_shafts(image, (0.5, 0.5), **words)
    with pytest.raises(AirlightError, match="did you mean 'epipolar'"):
        Parameters(method="epipoler")
    with pytest.raises(AirlightError, match="did you mean 'golden'"):
        presets.load("goldn")
    with pytest.raises(AirlightError, match="did you mean 'lamps'"):
        airlight.Light((0, 0), kind="lamp")
    write_image(tmp_path / "a.png", image)
    with pytest.raises(AirlightError, match="did you mean"):
        read_image(tmp_path / "aa.png")
