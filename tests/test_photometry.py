"""Photometric files: what is read of them, over all directions; and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from photometric_files import FORMS, SHIPPED, STORED, form, ies, ldt, seeds, values
from reading_mutants import campaign

from airlight.errors import AirlightError, AirlightWarning
from airlight.files.photometry import IntensityDistribution, parse_photometry, read_photometry

RANDOM = np.random.default_rng(7)
SPHERE = RANDOM.normal(size=(4000, 3))
RIGHT, UP, AHEAD = np.eye(3)


def read(data: bytes) -> IntensityDistribution:
    return parse_photometry(data, "lamp.ies")


def turned(axis: int, degrees: float, v: Any) -> np.ndarray:
    """Turn (3,) around an axis, from the next axis to the one after it."""
    i, j, c, s = (axis + 1) % 3, (axis + 2) % 3, np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(3)
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn @ v


def pointed(kind: str, vertical: float, horizontal: float) -> np.ndarray:
    """Point (3,) where two angles do, by rotations of ahead, as a goniometer makes them."""
    if kind == "C":
        return turned(2, horizontal, turned(1, vertical, AHEAD))
    if kind == "B":
        return turned(0, -vertical, turned(1, horizontal, AHEAD))
    return turned(1, horizontal, turned(0, -vertical, AHEAD))


def looked_up(table: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Interpolate (...) bilinearly in a table as textures are, in directions q (..., 3)."""
    rows, columns = table.shape
    y = np.degrees(np.arccos(q[..., 2] / np.linalg.norm(q, axis=-1))) / 180 * (rows - 1)
    x = np.degrees(np.arctan2(q[..., 1], q[..., 0])) % 360 / 360 * columns
    i, j = np.minimum(y.astype(int), rows - 2), x.astype(int)
    top, bottom = (table[row, j % columns] * (1 - x + j) + table[row, (j + 1) % columns] * (x - j) for row in (i, i + 1))
    return top * (1 - y + i) + bottom * (y - i)


def test_axes() -> None:
    """A lamp that hangs down has angle 0 at the nadir, C90 on the way from right to up; headlamps' angles go up and to the right."""
    assert np.allclose(pointed("C", 90, 0), RIGHT) and np.allclose(pointed("C", 90, 90), UP) and np.allclose(pointed("C", 180, 0), -AHEAD)
    for kind in "AB":
        assert np.allclose(pointed(kind, 90, 0), UP) and np.allclose(pointed(kind, 0, 90), RIGHT)
    assert np.allclose(pointed("A", 45, 90), (0.5**0.5, 0.5**0.5, 0)) and np.allclose(pointed("B", 45, 90), RIGHT)


@pytest.mark.parametrize("name", FORMS)
def test_values_stand_where_the_file_says(name: str) -> None:
    kind, vertical, horizontal = FORMS[name]
    candela, found = values(vertical, horizontal), read(form(name))
    assert found.kind == kind and found.peak == candela.max()
    for i, h in enumerate(horizontal):
        for j, v in enumerate(vertical):
            pole = {"A": abs(v) == 90, "B": abs(h) == 90, "C": False}[kind]
            if not pole:
                assert found.at(pointed(kind, v, h) * 3.0) * found.peak == pytest.approx(candela[i, j], abs=1e-6)
    assert found.at(SPHERE).min() >= 0 and found.at(SPHERE).max() <= 1
    between = found.at(pointed(kind, (vertical[2] + vertical[3]) / 2, horizontal[0])) * found.peak
    assert between == pytest.approx((candela[0, 2] + candela[0, 3]) / 2)


@pytest.mark.parametrize("name, signs", [
    ("axial", [(-1, 1), (1, -1)]), ("quadrant", [(-1, 1), (1, -1)]), ("half", [(1, -1)]), ("a-half", [(-1, 1)]), ("b-half", [(-1, 1)]),
    ("b-quadrant", [(-1, 1), (1, -1)]), ("whole", []), ("a-whole", []), ("b-whole", []),
])  # fmt: skip
def test_symmetries(name: str, signs: list[tuple[int, int]]) -> None:
    """What a file leaves out is the mirror image of what it has; of others, nothing is."""
    found = read(form(name))
    for mirror in [(-1, 1), (1, -1)]:
        same = np.allclose(found.at(SPHERE), found.at(SPHERE * (*mirror, 1)), atol=1e-9)
        assert same == (mirror in signs)
    if name == "axial":
        assert np.allclose(found.at(SPHERE), found.at(np.stack([turned(2, 33.0, q) for q in SPHERE])))


def test_other_ranges_of_horizontal_angles() -> None:
    """The plane of symmetry of 90 to 270 degrees (1995) is that of up; a circle without its last plane is closed."""
    vertical, candela = np.arange(0, 91, 15), values(np.arange(0, 91, 15), np.arange(90, 271, 30))
    found = read(ies("C", vertical, np.arange(90, 271, 30), candela))
    assert np.allclose(found.at(SPHERE), found.at(SPHERE * (-1, 1, 1))) and not np.allclose(found.at(SPHERE), found.at(SPHERE * (1, -1, 1)))
    assert found.at(pointed("C", 60, 120)) * found.peak == pytest.approx(candela[1, 4])
    whole = values(vertical, np.arange(0, 361, 45))
    closed, open_ = (read(ies("C", vertical, np.arange(0, end, 45), whole[: end // 45 + 1])) for end in (361, 359))
    assert np.allclose(closed.at(SPHERE), open_.at(SPHERE), atol=1e-12)


@pytest.mark.parametrize("name", FORMS)
def test_constant_files_are_one_wherever_they_say_anything(name: str) -> None:
    kind, vertical, horizontal = FORMS[name]
    found = read(ies(kind, vertical, horizontal, np.full((len(horizontal), len(vertical)), 350.0)))
    assert found.peak == 350
    ahead = {"axial-down": SPHERE[:, 2] > 0, "up-light": SPHERE[:, 2] < 0}.get(name, SPHERE[:, 2] > 0 if kind != "C" else SPHERE[:, 2] > -9)
    np.testing.assert_array_equal(found.at(SPHERE), ahead.astype(float))
    if kind == "C" and ahead.all():
        np.testing.assert_array_equal(found.table, 1.0)


@pytest.mark.parametrize("data, bound", [
    *[pytest.param(path.read_bytes(), 1e-3, id=path.stem) for path in SHIPPED],
    *[pytest.param(form(name), 1e-3, id=name) for name, form_of in FORMS.items() if form_of[0] == "C"],
    *[pytest.param(form(name), 0.02, id=name) for name in ("a-whole", "b-half")],  # from dark to full, by chance, in 7 degrees
])  # fmt: skip
def test_tables(data: bytes, bound: float) -> None:
    """Lookups in the table are as good as the file; but for its own border, where that ends at once."""
    found = read(data)
    rows, columns = found.table.shape
    assert rows * columns <= 2**22 and rows >= 181 and found.table.max() <= 1 and found.table.min() >= 0
    error = np.abs(looked_up(found.table, SPHERE) - found.at(SPHERE))
    unit = SPHERE / np.linalg.norm(SPHERE, axis=1)[:, None]
    inside = np.abs(unit[:, 2]) > np.sin(np.radians(0.5))
    if found.kind != "C":  # where all angles around it meet a pole has many values
        inside &= np.abs(unit[:, 1 if found.kind == "A" else 0]) < np.cos(np.radians(8))
    assert error[inside].max() < bound and np.mean(error > bound) < 0.02


def test_narrow_beams_have_finer_tables() -> None:
    found = read(ies("C", [0, 0.3, 0.65, 1.1, 2, 90], [0], np.array([[9000.0, 8000, 3000, 200, 0, 0]])))
    assert found.table.shape == (3601, 4)
    angles = np.radians(np.linspace(0, 3, 999))
    q = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)
    assert np.abs(looked_up(found.table, q) - found.at(q)).max() < 1e-3


def test_versions_and_ways_to_write() -> None:
    """All say the same: with and without the first line, commas, one number a line, other ends of lines and letters."""
    plain = read(form("half"))
    for more in (
        {"version": ""}, {"version": "IESNA91\n[TEST] x\n"}, {"version": "IESNA:LM-63-1995\n"}, 
        {"version": "IES:LM-63-2019\n[LAMP] Stra\xdfe\n"}, {"version": "Acme, made in 86\nstreet lamp, 70 W\n"}, {"comma": True},
        {"wide": 1}, {"wide": 999}, {"ends": "\n"}, {"ends": "\r"},
        {"tilt": " tilt = none "}, {"lumens": 5000},
    ):  # fmt: skip
        found = read(form("half", **more))
        assert found.peak == plain.peak and np.array_equal(found.factors, plain.factors), more
    wide = b"\xff\xfe" + form("half").decode().encode("utf-16-le")
    for data in (wide, b"\xef\xbb\xbf" + form("half"), form("half") + b"\x1a", form("half").replace(b" ", b"\t ")):
        assert np.array_equal(read(data).factors, plain.factors)


@pytest.mark.parametrize("version, scale", [("", 3.0), ("IESNA91\n", 3.0), ("IESNA:LM-63-1995\n", 1.5), ("IES:LM-63-2019\n", 1.5)])
def test_factors_of_the_candela(version: str, scale: float) -> None:
    """Multiplier and ballast factor count, and in the first versions the ballast-lamp factor, where later ones have something else."""
    plain, found = read(form("half")), read(form("half", version=version, factors=(3.0, 0.5, 2.0)))
    assert found.peak == pytest.approx(scale * plain.peak) and np.allclose(found.factors, plain.factors, rtol=1e-14)
    with pytest.warns(AirlightWarning, match="ballast factor is 0, taken for 1"):
        assert read(form("half", factors=(1, 0, 1))).peak == plain.peak


def test_tilt() -> None:
    """Counts for the file's own candela alone, by how far the lamp is turned from straight down."""
    found = read(form("axial", tilt="TILT=INCLUDE\n1\n3\n0 90 180\n1 0.5 0.7"))
    assert [found.tilted(v) for v in ((0, -2, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0))] == pytest.approx([1, 0.5, 0.5, 0.7])
    assert found.tilted((1, -1, 0)) == pytest.approx(0.75) and read(form("axial")).tilted((1, 0, 0)) == 1
    assert np.array_equal(found.factors, read(form("axial")).factors)
    with pytest.warns(AirlightWarning, match="'lamp.tlt' of its TILT section is not read"):
        assert read(form("axial", tilt="TILT=lamp.tlt")).tilt is None


@pytest.mark.parametrize("symmetry", STORED)
@pytest.mark.parametrize("comma", [False, True])
def test_eulumdat(symmetry: int, comma: bool) -> None:
    vertical = np.linspace(0, 180, 13)
    candela = values(vertical, range(STORED[symmetry]))
    found = read(ldt(symmetry, candela, comma=comma, conversion=0.5))
    assert found.kind == "C" and found.peak == pytest.approx(candela.max())  # times 2000 lm / 1000 and by the conversion factor
    first = 270 if symmetry == 3 else 0
    for i in range(STORED[symmetry]):
        assert found.at(pointed("C", 75, first + 30 * i)) * found.peak == pytest.approx(candela[i, 5])
    mirrors = {0: [], 1: [(-1, 1), (1, -1)], 2: [(1, -1)], 3: [(-1, 1)], 4: [(-1, 1), (1, -1)]}[symmetry]
    for mirror in [(-1, 1), (1, -1)]:
        assert np.allclose(found.at(SPHERE), found.at(SPHERE * (*mirror, 1))) == (mirror in mirrors)
    empty = ldt(symmetry, candela, comma=comma).split(b"\r\n")
    empty[23] = b""  # the conversion factor
    assert read(b"\r\n".join(empty)).peak == pytest.approx(2 * candela.max())
    with pytest.warns(AirlightWarning, match="no luminous flux"):
        assert read(ldt(symmetry, candela, flux=0)).peak == pytest.approx(candela.max())


NEGATIVE = np.array([[100.0, 50, -0.5]]), np.array([[100.0, 50, -20]])


@pytest.mark.parametrize("data, says", [
    (b"", "is empty"), (b"hello", "is no photometric file"), (b"\x89PNG\r\n" * 30, "is no photometric file"),
    (form("half")[:-400], "is cut off: it ends among its intensities"), (form("half")[:60], "is cut off"),
    (form("half").replace(b" 60 ", b" nan ", 1), "'nan' stands among"), (form("half").replace(b" 60 ", b" 5x ", 1), "'5x' stands among"),
    (form("half").replace(b" 60 ", b" 9e999 ", 1), "is too large"), (form("half").replace(b" 60 ", b" 20 ", 1), "angles do not rise: "),
    (form("half").replace(b" 37 7 1 2 ", b" 37 7 4 2 "), "type of photometry is 4"),
    (form("half").replace(b" 37 7 1 2 ", b" 37 6.5 1 2 "), "6.5 stands among its numbers"),
    (form("half").replace(b" 37 7 1 2 ", b" 0 7 1 2 "), "0 stands among its numbers"),
    (form("half").replace(b" 37 7 1 2 ", b" 999999 1e200 1 2 "), "more than 2097152"),
    (form("half", factors=(-1, 1, 1)), "multiplier is -1"), (form("axial", tilt="TILT=INCLUDE\n1 1e9"), r"1e\+09 tilt angles"),
    (form("axial", tilt="TILT=INCLUDE\n1\n2\n5 0\n1 1"), "tilt angles do not rise"),
    (ies("C", [0, 45, 90], [0, 45], np.ones((2, 3))), "horizontal angles, 0 to 45 degrees, leave a part"),
    (ies("C", [0, 45, 190], [0], np.ones((1, 3))), "beyond 0 to 180"), (ies("B", [-90, 90], [0, 170], np.ones((2, 2))), "of type B"),
    (ies("C", [0], [0], np.ones((1, 1))), "one vertical angle"), (ies("C", [0, 90], [0], np.zeros((1, 2))), "greatest intensity is 0 cd"),
    (ies("C", [0, 45, 90], [0], NEGATIVE[1]), "light cannot be negative"),
    (ldt(2, values(range(5), range(7)))[:-30], "is cut off"), (ldt(7, values(range(5), range(7))), "symmetry, line 3, is 7"),
])  # fmt: skip
def test_refused(data: bytes, says: str) -> None:
    with pytest.raises(AirlightError, match=says) as caught:
        read(data)
    assert str(caught.value).startswith("lamp.ies: ") and "; " in str(caught.value) and "\n" not in str(caught.value)


def test_mended() -> None:
    with pytest.warns(AirlightWarning, match="1 intensity below 0, taken for 0"):
        assert read(ies("C", [0, 45, 90], [0], NEGATIVE[0])).at(RIGHT) == 0
    with pytest.warns(AirlightWarning, match="more numbers than the 37 times 7"):
        read(form("half") + b"12 13\r\n")


def test_files_that_are_none(tmp_path: Path) -> None:
    for path, says in ((tmp_path / "none.ies", "cannot be read"), (tmp_path, "is a folder; give the name of a photometric file")):
        with pytest.raises(AirlightError, match=says):
            read_photometry(str(path))


def is_sound(found: IntensityDistribution) -> bool:
    shares = found.at(SPHERE)
    sound = np.isfinite(shares).all() and shares.min() >= 0 and shares.max() <= 1 and found.factors.max() == 1
    return bool(sound and 0 < found.peak <= 1e9 and np.isfinite(found.tilted((1, 0, 0))))


@pytest.mark.parametrize("number, seed", [(500, 1), pytest.param(12_000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    campaign(tmp_path, seeds(), number, seed, lambda path, _: read_photometry(path), is_sound)
