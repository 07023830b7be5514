"""Mutants of volume files: each becomes a volume that keeps its word, or is refused in one line, soon and in little memory."""

import random
from pathlib import Path

import numpy as np
import pytest
from reading_mutants import campaign
from volume_files import BOX, seeds

from airlight.files.volumes import MAX_VOXELS, Volume, read_volume


def is_sound(volume: Volume) -> bool:
    density = volume.density
    kept = density.dtype == np.float32 and density.ndim == 3 and density.flags.c_contiguous and density.size <= MAX_VOXELS * 1.05
    placed = np.isfinite(volume.matrix).all() and np.isfinite(volume.bounds).all()
    return bool(kept and placed and np.isfinite(density).all() and density.min() >= 0)


def read(path: str, chance: random.Random) -> Volume:
    given = {"bounds": BOX} if chance.random() < 0.4 else {}
    given |= {"grid": chance.choice(("0", "density", "other"))} if chance.random() < 0.3 else {}
    return read_volume(path, up=chance.choice((None, "z")), limit=chance.choice((MAX_VOXELS, 500)), **given)


@pytest.mark.parametrize("number, seed", [(700, 1), pytest.param(12_000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    campaign(tmp_path, seeds(), number, seed, read, is_sound)
