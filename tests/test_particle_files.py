"""Files of particles: what is read of each kind, what is refused in a line, and mutants, which do no harm."""

import io
import re
import warnings
import zipfile
from pathlib import Path

import numpy as np
import particle_files as made
import pytest
from particle_files import npz, ply, rows, table
from reading_mutants import campaign

from airlight.errors import AirlightError, AirlightWarning
from airlight.files.particles import Particles, read_particles
from airlight.files.particles.columns import MAX_PARTICLES

pytestmark = pytest.mark.filterwarnings("error")
ROWS = rows()


def kept(folder: Path, data: bytes, name: str = "a.csv") -> str:
    (folder / name).write_bytes(data)
    return str(folder / name)


def assert_rows(found: Particles, columns: int = 5, expected: np.ndarray = ROWS) -> None:
    np.testing.assert_allclose(found.positions, expected[:, :3], rtol=1e-6)
    for values, column in ((found.radii, 3), (found.densities, 4)):
        if column < columns:
            np.testing.assert_allclose(values, expected[:, column], rtol=1e-6)
        else:
            assert values is None


@pytest.mark.parametrize("columns", [3, 4, 5])
@pytest.mark.parametrize("divider", [",", ";", "\t", " ", ", "])
@pytest.mark.parametrize("head", [True, False])
def test_tables(columns: int, divider: str, head: bool, tmp_path: Path) -> None:
    names = divider.join(made.NAMES[:columns]) if head else None
    assert_rows(read_particles(kept(tmp_path, table(ROWS[:, :columns], names, divider))), columns)


@pytest.mark.parametrize(
    "names, order",
    [
        ("density,z,x,radius,y", (4, 2, 0, 3, 1)),
        ("id,P.x,P.y,P.z,pscale,rho", (0, 0, 1, 2, 3, 4)),
        ("Density,Points:0,Points:1,Points:2,Radius", (4, 0, 1, 2, 3)),
        ("pos_x [m],pos_y [m],pos_z [m],radius (m),density", (0, 1, 2, 3, 4)),
        ("r,g,b,x,y,z,rad,density", (3, 3, 3, 0, 1, 2, 3, 4)),
        ("px,x,y,z,Position[0],radius,density", (4, 0, 1, 2, 4, 3, 4)),
        ('"X","Y","Z","R","density"', (0, 1, 2, 3, 4)),
        ("# x y z radius density", (0, 1, 2, 3, 4)),
        ("x y z radius density", (0, 1, 2, 3, 4)),
    ],
)
def test_names_of_columns(names: str, order: tuple[int, ...], tmp_path: Path) -> None:
    assert_rows(read_particles(kept(tmp_path, table(ROWS[:, order], names))))


def test_how_tables_are_written(tmp_path: Path) -> None:
    halved = ROWS * (1, 1, 1, 2, 1)
    for data in (
        b"\xef\xbb\xbf" + table(ROWS, end="\r\n"),
        table(halved, "x,y,z,diameter,density"),
        table(ROWS, "# made by hand\n# x,y,z,radius,density\n\n", ","),
        table(ROWS).replace(b"\n", b",\n"),
        table(ROWS, None, ";").replace(b".", b","),
        b"x,y,z,radius,density\n" + b"\n".join(b'"' + line.replace(b",", b'","') + b'"' for line in table(ROWS, None).split()),
        table(ROWS).rstrip() + b"\n# the end",
    ):
        assert_rows(read_particles(kept(tmp_path, data)))
    assert len(read_particles(kept(tmp_path, b"x,y,z\n")).positions) == 0
    assert_rows(read_particles(kept(tmp_path, table(ROWS[:1]))), expected=ROWS[:1])


def test_archives(tmp_path: Path) -> None:
    points, radius, density = ROWS[:, :3], ROWS[:, 3], ROWS[:, 4]
    for arrays in (
        {"positions": points, "radius": radius, "density": density},
        {"P": np.asfortranarray(points), "pscale": radius.astype(np.float32)[:, None], "rho": density},
        {"x": points[:, 0], "y": points[:, 1], "z": points[:, 2], "radii": radius, "density": density, "velocity": points},
    ):
        assert_rows(read_particles(kept(tmp_path, npz(**arrays), "a.npz")))
    found = read_particles(kept(tmp_path, npz(positions=points, density=np.float64(3))))  # told by its bytes, not its name
    assert found.radii is None and (found.densities == 3).all() and found.densities.shape == (20,)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply(order: str, tmp_path: Path) -> None:
    for kind in ("float", "double"):
        assert_rows(read_particles(kept(tmp_path, ply(ROWS, order=order, kind=kind), "a.ply")))
    assert_rows(read_particles(kept(tmp_path, ply(ROWS[:, [3, 2, 1, 0]], ("radius", "z", "y", "x"), order))), 4)
    empty = b"element camera 0\nproperty float fov\n"
    assert_rows(read_particles(kept(tmp_path, ply(ROWS, order=order, before=empty), "a.ply")))
    assert len(read_particles(kept(tmp_path, ply(ROWS[:0], order=order))).positions) == 0


def test_scale_and_up(tmp_path: Path) -> None:
    found = read_particles(kept(tmp_path, table(ROWS)), scale=0.01, up="z")
    np.testing.assert_allclose(found.positions, ROWS[:, [0, 2, 1]] * (0.01, 0.01, -0.01), rtol=1e-6)
    np.testing.assert_allclose(found.radii, ROWS[:, 3] * 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.densities, ROWS[:, 4], rtol=1e-6)


def test_columns_that_are_nearly_named_are_told(tmp_path: Path) -> None:
    for data in (table(ROWS, "x,y,z,raduis,densty"), npz(positions=ROWS[:, :3], raduis=ROWS[:, 3], densty=ROWS[:, 4])):
        with pytest.warns(AirlightWarning) as told:
            found = read_particles(kept(tmp_path, data))
        assert found.radii is None and len(told) == 2
        assert re.search(r"'raduis' is not read; name it 'radius' if it is that", str(told[0].message))


def zipped(name: str, data: bytes) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return held.getvalue()


def header(shape: str, kind: str = "<f4") -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}\n"
    return b"\x93NUMPY\1\0" + len(text).to_bytes(2, "little") + text.encode()


def vertices(count: str, properties: str = "property float x\nproperty float y\nproperty float z\n", order: str = "ascii") -> bytes:
    return f"ply\nformat {order} 1.0\nelement vertex {count}\n{properties}end_header\n".encode()


@pytest.mark.parametrize(
    "data, line",
    [
        (b"", "is empty; give .csv, .npz, .ply"),
        (b"\0\1\2\3", "holds no particles that Airlight reads"),
        (b"\n\n", "holds no numbers"),
        (b"1,2\n3,4\n", "has 2 columns without names; begin it with a line"),
        (table(np.ones((2, 6)), None), "has 6 columns without names"),
        (table(ROWS, "x,y,w,radius,density"), "has no column z, but 'x', 'y', 'w', 'radius', 'density'; name its columns"),
        (table(ROWS, "x,x,y,z,density"), "has more than one column x"),
        (table(ROWS) + b"1,2,three,4,5\n", "its line 22 holds what is no number"),
        (table(ROWS) + b"1,2,3\n", "its line 22 has fewer columns than the first"),
        (table(ROWS[:, :3]), "has 3 numbers in a line, but names for 5 columns"),
        (b"x,y,z\n" + b"1" * 20_000, "its line 2 is longer than 16384 bytes"),
        (table(rows(200)) + b"1,2,3\0,4,5\n", "bytes that are no text"),
        (b"x,y,z," + b",".join(b"c%d" % i for i in range(300)) + b"\n" + b",".join([b"1"] * 303), "more than 256 columns"),
        (npz(points_=ROWS), "has no array 'positions', but 'points_'"),
        (npz(positions=ROWS), r"its array 'positions' has the shape \(20, 5\); give \(N, 3\)"),
        (npz(positions=ROWS[:, :3], radius=ROWS[:7, 3]), "has 20 positions, but 7 values of 'radius'"),
        (npz(x=ROWS[:, 0], y=ROWS[:3, 1], z=ROWS[:, 2]), "is damaged: its archive cannot be read"),
        (npz(positions=ROWS[:, :3].astype(complex)), "holds values of type <c16"),
        (zipped("positions.npy", header(f"({MAX_PARTICLES + 1}, 3)")), f"has {MAX_PARTICLES + 1} particles, more than"),
        (zipped("positions.npy", header("(1000000, 3)")), "its archive cannot be read .positions is cut off"),
        (zipped("positions.npy", header("(1, 3)", "|O")), "Python objects, which are not read"),
        (zipped("positions.npy", b"nonsense"), "does not begin as NumPy's do"),
        (b"plyx\n", "its header makes no sense"),
        (vertices("2").replace(b"ascii", b"morse") + b"1 2 3\n4 5 6\n", "its header makes no sense"),
        (vertices("3") + b"1 2 3\n4 5 6\n", "is cut off: it has 2 of its 3 vertices"),
        (vertices("3"), "is cut off: it has none of its 3 vertices"),
        (vertices("2") + b"1 2 3\n4 5\n", "a vertex holds what is no number, or too few"),
        (vertices("999999999999999"), "has 999999999999999 particles, more than"),
        (vertices("3", order="binary_little_endian") + bytes(35), "is cut off"),
        (vertices("1", "property float x\nproperty float y\n"), "has no column z"),
        (vertices("1", "property list uchar int x\n"), "its vertices hold lists"),
        (vertices("1", "property float x\nproperty float x\n"), "a name twice"),
        (ply(ROWS).replace(b"vertex", b"cornet"), "has no vertices; export it with its points"),
    ],
)
def test_what_is_refused(data: bytes, line: str, tmp_path: Path) -> None:
    with pytest.raises(AirlightError, match=line) as told:
        read_particles(kept(tmp_path, data, "a.bin"))
    assert "\n" not in str(told.value) and "; " in str(told.value)


def test_how_it_is_asked(tmp_path: Path) -> None:
    path = kept(tmp_path, table(ROWS))
    for more, line in (({"scale": 0}, "scale is 0; give metres a unit"), ({"up": "x"}, "up is 'x'; use y or z")):
        with pytest.raises(AirlightError, match=line):
            read_particles(path, **more)
    with pytest.raises(AirlightError, match=r"b\.csv: cannot be read .*did you mean '.*a\.csv'"):
        read_particles(str(tmp_path / "b.csv"))
    with pytest.raises(AirlightError, match="is a folder; give the name of a file of particles"):
        read_particles(str(tmp_path))


@pytest.mark.parametrize("whole", made.seeds())
def test_cut_off(whole: bytes, tmp_path: Path) -> None:
    """What is binary, or says how many there are, is refused; of a table the lines that are there are read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirlightWarning)
        count = len(read_particles(kept(tmp_path, whole)).positions)
        for end in [*range(0, len(whole) - 1, max(1, len(whole) // 40)), len(whole) - 2]:
            path = kept(tmp_path, whole[:end])
            try:
                assert len(read_particles(path).positions) <= count
                assert whole[:3] != b"ply" or end > len(whole) - 8  # the last number may lose a digit
            except AirlightError as error:
                assert "; " in str(error)


def is_sound(found: Particles) -> bool:
    count = len(found.positions)
    columns = [one for one in (found.radii, found.densities) if one is not None]
    return found.positions.shape == (count, 3) and all(one.shape == (count,) and one.dtype == np.float64 for one in columns)


@pytest.mark.parametrize("number, seed", [(500, 1), pytest.param(20_000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    campaign(tmp_path, made.seeds(), number, seed, lambda path, chance: read_particles(path, up=chance.choice((None, "z"))), is_sound)
