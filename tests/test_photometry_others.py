"""Other readers of photometric files say the same in 10,000 directions a file: photompy of IES LM-63, pyldt of EULUMDAT."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from photometric_files import FORMS, SHIPPED, STORED, form, ldt, values
from test_photometry import pointed

from airlight.files.photometry import IntensityDistribution, read_photometry

COUNT = 10_000


def directions(kind: str, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
    return np.stack([pointed(kind, v, h) for v, h in zip(vertical, horizontal, strict=True)])


def agree(found: IntensityDistribution, truth: np.ndarray, vertical: np.ndarray, horizontal: np.ndarray) -> None:
    assert np.ptp(truth) > 0.1 * truth.max()
    error = found.at(directions(found.kind, vertical, horizontal)) - truth / found.peak
    assert np.abs(error).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", [*(path.stem for path in SHIPPED), *(name for name in FORMS if name != "up-light")])
def test_photompy(name: str, tmp_path: Path) -> None:
    """It says nothing of lamps that shine upwards alone, lets light that ends at 90 degrees fade over a step beyond, and its version 0.3.1
    mirrors the upper half of type B to the lower one a step amiss: there it is not asked."""
    import photompy

    path = next((path for path in SHIPPED if path.stem == name), tmp_path / "made.ies")
    if path.parent == tmp_path:
        path.write_bytes(form(name, factors=(2.5, 1, 1)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = photompy.IESFile.read(path).photometry.expanded()
    found, random = read_photometry(str(path)), np.random.default_rng(3)
    downward = found.vertical[-1] <= 90
    low, high = (0.0, 90.0 if downward else 180.0) if found.kind == "C" else (0.0 if found.upright else -90.0, 90.0)
    vertical = random.uniform(low, high, COUNT)
    sides = (0, 359 if len(found.horizontal) == 1 else 360) if found.kind == "C" else (-90, 90)
    horizontal = random.uniform(*sides, COUNT)
    agree(found, whole.get_intensity(vertical, horizontal), vertical, horizontal)
    assert found.peak == pytest.approx(whole.values.max())
    if found.kind == "C" and downward:
        assert not found.at(directions("C", random.uniform(90.001, 180, COUNT), horizontal)).any()


@pytest.mark.slow
@pytest.mark.parametrize("symmetry", STORED)
def test_pyldt(symmetry: int, tmp_path: Path) -> None:
    import pyldt

    (tmp_path / "made.ldt").write_bytes(ldt(symmetry, values(np.linspace(0, 180, 13), range(STORED[symmetry])), flux=3000))
    other, found = pyldt.LdtReader.read(tmp_path / "made.ldt"), read_photometry(str(tmp_path / "made.ldt"))
    whole = 3.0 * np.array([*other.intensities, other.intensities[0]])  # candela per 1000 lumens, in planes of 30 degrees
    random = np.random.default_rng(4)
    vertical, horizontal = random.uniform(0, 180, COUNT), random.uniform(0, 360, COUNT)
    i, j = (horizontal / 30).astype(int), (vertical / 15).astype(int)
    s, t = horizontal / 30 - i, vertical / 15 - j
    low, high = ((1 - s) * whole[i, k] + s * whole[i + 1, k] for k in (j, j + 1))
    agree(found, (1 - t) * low + t * high, vertical, horizontal)
