"""Particles as a user writes them."""

from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from particle_files import npz, rows, table

import airlight
from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs.density_text import npz_kind
from airlight.jobs.particle_text import FileParticles, ParticleText, load_particles, read_particle_text
from airlight.jobs.volume_text import FileVolume, read_volume_text
from airlight.pygfx import ParticleField

pytestmark = pytest.mark.filterwarnings("error")
ROWS = rows()


def test_what_is_written() -> None:
    assert read_particle_text("a.csv") == ParticleText("a.csv")
    text = " b/Dust.NPZ ; radius = 0.2;density=3;sprite=puff.png;blend=max;factor=2;scale=0.01;up=z;"
    assert read_particle_text(text) == ParticleText("b/Dust.NPZ", 0.2, 3, "puff.png", "max", 2, 0.01, "z")
    assert read_particle_text("smoke;draw=0") == ParticleText("smoke", draw=False)
    assert read_particle_text("a.ply").is_file and not read_particle_text("smoke.csv.old").is_file


@pytest.mark.parametrize(
    "text, line",
    [
        ("", "cannot read the particles '': write FILE or NAME"),
        (";radius=1", "cannot read the particles"),
        ("a.csv;raduis=1", "cannot read 'raduis=1' in the particles 'a.csv;raduis=1'; did you mean 'radius'"),
        ("a.csv;qwerty=1", "cannot read 'qwerty=1' .*: write FILE or NAME"),
        ("a.csv;radius", "radius has no value"),
        ("a.csv;radius=", "radius has no value"),
        ("a.csv;radius=wide", "radius is wide in the particles 'a.csv;radius=wide'; give a number of 0 to 1e.09"),
        ("a.csv;radius=-1", "radius is -1"),
        ("a.csv;factor=nan", "factor is nan"),
        ("a.csv;scale=0", "scale is 0"),
        ("a.csv;blend=ad", "blend is 'ad' .*did you mean 'add'.*use add, multiply, replace, min, max"),
        ("a.csv;up=x", "up is 'x' .*use y, z"),
        ("smoke;draw=no", "draw is 'no' .*use 0, 1"),
        ("a.csv;radius=1;radius=2", "radius stands twice"),
        ("a.csv;draw=0", "cannot use draw .*particles of a file are never drawn; leave it out"),
        ("smoke;scale=2", "cannot use scale .*it goes with a file, as .csv or .npz or .ply; leave it out"),
        ("smoke.vdb", "smoke.vdb: is a volume, not particles; give it by --volume"),
    ],
)
def test_what_cannot_be_read(text: str, line: str) -> None:
    with pytest.raises(AirlightError, match=line) as told:
        read_particle_text(text)
    assert "\n" not in str(told.value)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(["a.csv", ";", "=", "radius", "scale", "draw", "up", "1", "-", "1e999", "z", "\0", "é", " ", "NaN"])))
def test_whatever_is_written_is_read_or_refused_in_a_line(parts: list[str]) -> None:
    try:
        assert read_particle_text("".join(parts)).source
    except AirlightError as error:
        assert "\n" not in str(error) and len(str(error)) < 1000


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "dust.csv"
    path.write_bytes(table(ROWS))
    loaded = load_particles(read_particle_text(f"{path};blend=max;factor=2"), None, 48)
    field = loaded.field(48)
    assert field is loaded.field(48) and (field.blend, field.factor) == ("max", 2) and not loaded.draw
    expected = airlight.particles(ROWS[:, :3], ROWS[:, 3], ROWS[:, 4], cells=48)
    np.testing.assert_allclose(field.volume.density, expected.density, rtol=1e-5, atol=1e-6)
    assert loaded.field(32) is not field and loaded.field(32).volume.density.shape[0] <= 32
    own = load_particles(read_particle_text(f"{path};radius=0.5;density=2;up=z;scale=0.5"), None).field(48).volume
    points = ROWS[:, [0, 2, 1]] * (0.5, 0.5, -0.5)
    np.testing.assert_allclose(own.density, airlight.particles(points, 0.5, 2.0, cells=48).density, rtol=1e-4, atol=1e-5)
    with pytest.raises(AirlightError, match=r"dust\.csb\.csv: cannot be read"):
        load_particles(read_particle_text(f"{tmp_path}/dust.csb.csv"), None)
    with pytest.raises(AirlightError, match=r"none\.png: cannot be read"):
        load_particles(read_particle_text(f"{path};sprite={tmp_path}/none.png"), None)
    (tmp_path / "none.npz").write_bytes(npz(positions=np.zeros((0, 3))))
    with pytest.warns(AirlightWarning, match="has no particles"):
        assert load_particles(read_particle_text(f"{tmp_path}/none.npz"), None).field().volume.mass == 0
    (tmp_path / "bare.npz").write_bytes(npz(positions=ROWS[:, :3]))
    with pytest.warns(AirlightWarning, match=r"bare\.npz: has no radius: .* twice the mean spacing; no density: 0\.13"):
        load_particles(read_particle_text(f"{tmp_path}/bare.npz"), None)


def test_numbered_files_follow_the_frame(tmp_path: Path) -> None:
    for number in (2, 3):
        (tmp_path / f"dust.{number:04}.csv").write_bytes(table(ROWS + (number, 0, 0, 0, 0)))
    loaded = load_particles(read_particle_text(f"{tmp_path}/dust.####.csv"), None, 32)
    assert isinstance(loaded, FileParticles)
    found = {}
    for frame in (1, 2, 3, 9):
        loaded.frame = frame
        found[frame] = loaded.field(32)
    assert found[1] is found[2] and found[3] is found[9] and found[1] is not found[3]
    np.testing.assert_allclose(found[3].volume.bounds - found[2].volume.bounds, [[1, 0, 0]] * 2, atol=0.2)


def test_points_of_the_scene(tmp_path: Path) -> None:
    scene, group, other = gfx.Scene(), gfx.Group(name="chimney"), gfx.Points(gfx.Geometry(positions=ROWS[:, :3].astype(np.float32)))
    smoke = gfx.Points(gfx.Geometry(positions=ROWS[:, :3].astype(np.float32)), gfx.PointsMaterial(size=1, size_space="world"))
    smoke.name, other.name = "smoke", "sparks"
    group.add(smoke, other)
    scene.add(group)
    loaded = load_particles(read_particle_text("smoke;density=2;draw=0"), scene, 32)
    assert isinstance(loaded, ParticleField) and loaded.points == [smoke] and not loaded.draw
    expected = airlight.particles(ROWS[:, :3], 0.5, 2.0, cells=32)
    np.testing.assert_allclose(loaded.field(32).volume.density, expected.density, rtol=1e-4, atol=1e-5)
    assert load_particles(read_particle_text("chimney;radius=1"), scene).points == [smoke, other]
    with pytest.raises(AirlightError, match="sparks: particle 0 has the radius -1"):
        other.geometry.radii = gfx.Buffer(np.full(len(ROWS), -1, np.float32))
        load_particles(read_particle_text("sparks"), scene)
    with pytest.raises(AirlightError, match=r"--particles smok: the scene has no points of that name; did you mean 'smoke'"):
        load_particles(read_particle_text("smok"), scene)
    with pytest.raises(AirlightError, match=r"--particles qqq: .*; there is smoke, chimney, sparks"):
        load_particles(read_particle_text("qqq"), scene)
    with pytest.raises(AirlightError, match=r"it has no points: give a file, \.csv"):
        load_particles(read_particle_text("smoke"), gfx.Scene())
    (tmp_path / "dust.txt").write_bytes(table(ROWS))
    for name, line in (("dust.txt", r"files of particles end with \.csv"), ("dust.tx", r"did you mean '.*dust\.txt'")):
        with pytest.raises(AirlightError, match=line):
            load_particles(read_particle_text(f"{tmp_path}/{name}"), scene)


def test_an_archive_of_the_other_kind_is_told(tmp_path: Path) -> None:
    """By its arrays; those of a volume may have any names beside density."""
    points, grid, box = ROWS[:, :3], np.ones((2, 3, 4)), [[0, 0, 0], [1, 1, 1]]
    for name, arrays, kind in (
        ("a", {"positions": points, "density": ROWS[:, 4]}, "particles"),
        ("b", {"P": points}, "particles"),
        ("c", {"density": grid, "bounds": box}, "volume"),
        ("d", {"density": grid, "P": grid, "x": np.zeros(4)}, "volume"),
        ("e", {"P": grid, "bounds": box}, None),
        ("f", {"x": points[:, 0], "y": points[:, 1], "z": points[:, 2]}, None),
    ):
        (tmp_path / f"{name}.npz").write_bytes(npz(**arrays))
        assert npz_kind(str(tmp_path / f"{name}.npz")) == kind
    assert npz_kind(str(tmp_path / "none.npz")) is npz_kind(str(tmp_path / "a.csv")) is None
    with pytest.raises(AirlightError, match=r"a\.npz: holds particles, not a volume; give it by --particles"):
        FileVolume(read_volume_text(f"{tmp_path}/a.npz")).field()
    with pytest.raises(AirlightError, match=r"c\.npz: holds a volume, not particles; give it by --volume"):
        load_particles(read_particle_text(f"{tmp_path}/c.npz"), None)
    (tmp_path / "broken.npz").write_bytes(npz(positions=points)[:-30])
    assert npz_kind(str(tmp_path / "broken.npz")) is None
