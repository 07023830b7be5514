"""Volumes and particles in the air of a scene: as they are written, on the command line, and as they follow frames."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing import mutate
from volume_files import npy, npz, seeds

import airlight
from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image
from airlight.files.volumes import Volume
from airlight.jobs.densities import add_density, put_densities, suit, tell_idle
from airlight.jobs.volume_text import FileVolume, VolumeText, read_volume_text
from airlight.medium.field import Field, as_field
from airlight.options import March, Medium, Parameters, build
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot, Studio

BALL = np.ones((6, 6, 6), np.float32)
BOUNDS = np.array([[0.0, 1, 0], [2, 3, 2]])
SMALL = ["--width", "32", "--quality", "draft", "--no-antialias", "--shadow-size", "64"]


def stored(folder: Path, name: str = "smoke.npz", factor: float = 1.0, **more: Any) -> Path:
    path = folder / name
    path.write_bytes(npz(**{"density": factor * BALL, "bounds": BOUNDS} | more))
    return path


def test_what_is_written() -> None:
    assert read_volume_text("a.vdb") == VolumeText("a.vdb")
    text = " b/Smoke.NPZ ; blend=max;factor = 2;grid=heat;bounds=0,1,2,3,4,5;scale=0.01;up=z;"
    assert read_volume_text(text) == VolumeText("b/Smoke.NPZ", "max", 2, "heat", (0, 1, 2, 3, 4, 5), 0.01, "z")


@pytest.mark.parametrize(
    "text, line",
    [
        ("", "cannot read the volume '': write FILE"),
        ("a.vdb;blnd=add", "cannot read 'blnd=add' .*did you mean 'blend'"),
        ("a.vdb;qwerty=1", "cannot read 'qwerty=1' .*: write FILE"),
        ("a.vdb;factor=", "factor has no value"),
        ("a.vdb;blend=plus", "blend is 'plus' .*use add, multiply, replace, min, max"),
        ("a.vdb;up=x", "up is 'x' .*use y, z"),
        ("a.vdb;factor=-1", "factor is -1 .*give a number of 0 to 1e.09"),
        ("a.vdb;factor=nan", "factor is nan .*give a number"),
        ("a.vdb;scale=0", "scale is 0 .*give a number of 1e-09 to 1e.09"),
        ("a.npy;bounds=0,1,2", "bounds is 0,1,2 .*give numbers, x0,y0,z0,x1,y1,z1"),
        ("a.vdb;factor=1;factor=2", "factor stands twice"),
        ("dust.csv", "holds particles, not a volume; give it by --particles"),
    ],
)
def test_what_cannot_be_read(text: str, line: str) -> None:
    with pytest.raises(AirlightError, match=line) as told:
        read_volume_text(text)
    assert "\n" not in str(told.value)


def test_a_file_is_read_once_and_follows_the_frame(tmp_path: Path) -> None:
    for number in (2, 3):
        stored(tmp_path, f"smoke.{number:04}.npz", number)
    found = FileVolume(read_volume_text(f"{tmp_path}/smoke.####.npz;factor=2;blend=max"))
    fields = {}
    for frame in (1, 2, 3, 9):
        found.frame = frame
        fields[frame] = as_field(found)
    assert fields[1] is fields[2] and fields[3] is fields[9] is as_field(found, 64)
    assert (fields[2].factor, fields[2].blend) == (2, "max") and fields[3].volume.density.max() == 3
    with pytest.raises(AirlightError, match="did you mean 'add'"):
        Field(fields[2].volume, "ad")


def test_what_lies_outside_the_scene_is_told(tmp_path: Path) -> None:
    stage = open_scene("slats")
    far = stored(tmp_path, bounds=BOUNDS + 500)
    with pytest.warns(AirlightWarning, match=r"smoke\.npz: lies outside the scene, at 500, 501, 500 to 502, 503, 502 m"):
        words = put_densities(stage, [str(far)], [])
    assert words == (f"--volume={far}",) and len(stage.fields) == 1
    with pytest.warns(AirlightWarning, match=r"outside the scene, at 1000000, 1, 0 to 1000002, 3, 2 m"):
        add_density(stage, str(stored(tmp_path, "map.npz", bounds=BOUNDS + (1e6, 0, 0))), 32)
    stage.fields.pop()
    near = stored(tmp_path, "near.npz")
    assert add_density(stage, str(near), 32) == (f"--volume={near}",) and len(stage.fields) == 2
    dust = stored(tmp_path, "dust.npz", density=np.ones(2), positions=np.zeros((2, 3)), radius=np.ones(2))
    assert add_density(stage, str(dust), 32) == (f"--particles={dust}",) and stage.fields[-1].field(32).volume.mass > 0


def render(folder: Path, *more: str, out: str = "out.exr") -> tuple[int, Path]:
    path = folder / out
    return main(["render", "slats", "-o", str(path), "-y", *SMALL, *more]), path


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = stored(tmp_path)
    pictures = []
    for more in ([], ["--air", "1"], ["--air", "1", "--volume", f"{path};factor=3"], ["--volume", f"{path};factor=3"]):
        code, out = render(tmp_path, *more)
        assert code == 0, capsys.readouterr().err
        pictures.append(read_image(str(out)).linear())
    even, air, both, alone = pictures
    assert np.array_equal(even, air) and np.abs(both - even).max() > 0.01 * even.max()
    assert np.abs(alone - both).max() > 0.01 * even.max()  # there is no air but the volume
    # What was done is kept, and repeated
    code, again = render(tmp_path, "--settings-from", str(tmp_path / "out.exr"), out="again.exr")
    assert code == 0 and np.array_equal(read_image(str(again)).linear(), alone), capsys.readouterr().err


@pytest.mark.parametrize(
    "more, line",
    [
        (["--volume", "none.vdb"], "none.vdb: cannot be read"),
        (["--volume", "bare.npy"], "bare.npy: .*bounds"),
        (["--volume", "nan.npz"], "nan.npz: .*no finite numbers"),
        (["--volume", "negative.npz"], "negative.npz: has negative densities"),
        (["--volume", "order.npz"], "order.npz: .*bounds"),
        (["--volume", "smoke.npz", "--method", "article"], "--volume .*method article"),
        (["--volume", "smoke.npz;blend=plus"], "blend is 'plus'"),
        (["--particles", "smoke.npz;raduis=1"], "did you mean 'radius'"),
    ],
)
def test_bad_input_is_a_line(
    more: list[str], line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    stored(tmp_path)
    (tmp_path / "bare.npy").write_bytes(npy(BALL))
    stored(tmp_path, "nan.npz", np.nan)
    stored(tmp_path, "negative.npz", -1)
    stored(tmp_path, "order.npz", bounds=BOUNDS[::-1])
    code, out = render(tmp_path, *more)
    said = capsys.readouterr().err
    assert code == 2 and len(said.splitlines()) == 1 and not out.exists(), said
    with pytest.raises(AirlightError, match=line):
        raise AirlightError(said.strip())


def test_mutants_are_drawn_or_refused_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chance, files = random.Random(18), seeds()
    codes = []
    for i in range(12):
        path = tmp_path / f"mutant{i}.vdb"
        path.write_bytes(mutate(chance, files[i % len(files)], chance.choice(files)) if i >= 2 else files[i])
        code, _ = render(tmp_path, "--volume", f"{path};bounds=0,1,0,2,3,2" if files[i % len(files)][:1] != b"\x20" else str(path))
        lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("airlight: warning: ")]
        assert code in (0, 2) and len(lines) == (code == 2) and "unexpected" not in "".join(lines), lines
        codes.append(code)
    assert 0 in codes and 2 in codes


def test_a_public_volume_is_a_field() -> None:
    volume = airlight.particles(np.zeros((1, 3)), 0.5, 2.0, cells=16)
    field = as_field(volume)
    assert isinstance(field, Field) and field.volume is volume and as_field(field) is field


def test_what_lies_in_the_air_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without an extinction of the user's or the scene's, one follows from the densest way through it; what is not seen is told."""
    stage = open_scene("slats")
    put_densities(stage, [str(stored(tmp_path))], [])
    del stage.settings["sigma_t"]
    suit(stage, {}, 128)
    assert stage.settings["sigma_t"] == (1.0, 1.0, 1.0) and "an optical depth of 2" in capsys.readouterr().err
    suit(stage, {"sigma_t": (0.3, 0.3, 0.3)}, 128)
    assert not capsys.readouterr().err
    with pytest.warns(AirlightWarning, match=r"an optical depth of 0\.02; give ;factor=100 behind"):
        suit(stage, {"sigma_t": (0.01, 0.01, 0.01)}, 128)
    with pytest.warns(AirlightWarning, match="fog and noise are of the air.*give --air 1"):
        suit(stage, {"fog": "linear", "sigma_t": (1.0, 1.0, 1.0)}, 128)
    put_densities(stage, [], [])
    volume = stage.fields[0].field().volume
    stage.fields = [Field(volume, "multiply", 5.0), Field(volume, "min", 5.0)]
    with pytest.warns(AirlightWarning, match="nothing to act on, as there is no air beside them: give --air 1"):
        suit(stage, {}, 128)
    stage.fields = [Field(volume), Field(volume, "min", 5.0)]
    suit(stage, {"sigma_t": (0.3, 0.3, 0.3)}, 128)
    stage.fields = [Field(volume, "add", 0.0)]
    with pytest.warns(AirlightWarning, match="hold no density, and beside them there is no air"):
        suit(stage, {}, 128)


@pytest.mark.parametrize(
    ("written", "values", "line"),
    [
        (("fog_depth", "fog_base"), {}, "--fog-base, --fog-depth do nothing without --fog$"),
        (("fog_above",), {"fog": "exponential"}, "--fog-above does nothing without --fog linear"),
        (("wind",), {}, "--wind does nothing without --noise-amount"),
        (("basin_density",), {}, "--basin-density does nothing without --basin-level"),
        (("sun_extinction",), {"sun_extinction": "all", "noise_amount": 2.0}, "--sun-extinction does nothing without --fog, --volume or"),
    ],
)
def test_what_does_nothing_is_told(written: tuple[str, ...], values: dict[str, Any], line: str) -> None:
    with pytest.warns(AirlightWarning, match=line):
        tell_idle(frozenset(written), Medium(**values))


def test_what_does_something_is_not_told(recwarn: pytest.WarningsRecorder) -> None:
    medium = Medium(fog="linear", fog_depth=2.0, fog_above=0.1, noise_amount=1.0, wind=(1.0, 0.0, 0.0), basin_level=1.0)
    tell_idle(frozenset({"fog", "fog_depth", "fog_above", "noise_size", "wind", "basin_density"}), medium)
    tell_idle(frozenset({"wind"}), Medium(), numbered=True)
    tell_idle(frozenset({"sun_extinction"}), Medium(sun_extinction="all"), alone=False)
    tell_idle(frozenset({"sun_extinction"}), Medium(sun_extinction="all", fog="linear"))
    assert not recwarn.list


@pytest.mark.slow
def test_a_grid_of_ones_is_even_air() -> None:
    """In the exact walk of spots, whose cones' borders are narrow, and in steps."""
    matrix = np.diag([25.0, 25, 25, 1])
    matrix[:3, 3] = -37.5
    ones = Volume(np.ones((4, 4, 4), np.float32), matrix, 0.5, "")
    stage = open_scene("two-spots")
    built = build(stage.settings | {"method": "march", "quality": "final", "air": 1.0})
    for steps in ("exact", 16):
        march = March(steps=steps, shadow_size=256)
        studio = Studio(stage, Shot(32, 18, samples=1), built[Parameters], medium=built[Medium], march=march)
        layers = []
        for fields in ([], [Field(ones, "multiply")]):
            studio.shafts.fields = fields
            layers.append(studio.frame(layer=True).layer[..., :3])
        even, ones_there = layers
        assert np.abs(ones_there - even).max() < 0.01 * even.mean() and abs(ones_there.mean() / even.mean() - 1) < 2e-4


def test_a_volume_alone_is_not_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = stored(tmp_path)
    assert main(["view", str(path)]) == 2
    assert f"`airlight view table --volume {path}`" in capsys.readouterr().err
