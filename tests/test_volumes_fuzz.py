"""Mutants of volume files: each becomes a volume that keeps its word, or is refused in one line, soon and in little memory."""

import random
import resource
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from fuzzing import mutate
from volume_files import BOX, seeds

from airlight.errors import AirlightError, AirlightWarning
from airlight.files.volumes import MAX_VOXELS, Volume, read_volume

HANG = 10  # seconds
GROWTH = 1 << 20  # KiB


def is_sound(volume: Volume) -> bool:
    density = volume.density
    kept = density.dtype == np.float32 and density.ndim == 3 and density.flags.c_contiguous and density.size <= MAX_VOXELS * 1.05
    placed = np.isfinite(volume.matrix).all() and np.isfinite(volume.bounds).all()
    return bool(kept and placed and np.isfinite(density).all() and density.min() >= 0)


def attempt(path: Path, chance: random.Random) -> tuple[bool, str]:
    """Read a mutant: whether it was read, and what is wrong, or nothing."""
    given = {"bounds": BOX} if chance.random() < 0.4 else {}
    given |= {"grid": chance.choice(("0", "density", "other"))} if chance.random() < 0.3 else {}
    began = time.monotonic()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AirlightWarning)
            volume = read_volume(str(path), up=chance.choice((None, "z")), limit=chance.choice((MAX_VOXELS, 500)), **given)
        read, fault = True, "" if is_sound(volume) else "is no sound volume"
    except AirlightError as error:
        read, fault = False, "" if "; " in str(error) and "\n" not in str(error) and len(str(error)) < 500 else f"says {error!r}"
    except Exception as error:  # what is looked for
        read, fault = False, f"raises {error!r}"
    took = time.monotonic() - began
    return read, fault or (f"takes {took:.1f} s" if took > HANG else "")


@pytest.mark.parametrize("number, seed", [(700, 1), pytest.param(12_000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    files, before = seeds(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    faults, reads = [], 0
    path = tmp_path / "mutant"
    for i in range(number):
        chance = random.Random(f"{seed}:{i}")
        data = files[i % len(files)]
        path.write_bytes(mutate(chance, data, chance.choice(files), chance.choice((96, 1000))) if chance.random() < 0.95 else data)
        read, fault = attempt(path, chance)
        reads += read
        if fault:
            path.rename(tmp_path / f"harmful-{i}")
            faults.append(f"{tmp_path}/harmful-{i}: {fault}")
    assert not faults, f"{len(faults)} faults:\n" + "\n".join(faults[:5])
    assert number // 20 < reads < number * 19 // 20, "the mutations are too coarse, or too tame"
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < GROWTH
