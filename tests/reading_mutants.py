"""Reads mutants of files within this process: each is read and sound, or refused in one line, soon and in little memory."""

import random
import resource
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fuzzing import mutate

from airlight.errors import AirlightError, AirlightWarning

Read, Judge = Callable[[str, random.Random], Any], Callable[[Any], bool]
HANG = 10  # seconds
GROWTH = 1 << 20  # KiB


def attempt(path: Path, chance: random.Random, read: Read, is_sound: Judge) -> tuple[bool, str]:
    """Read a mutant: whether it was read, and what is wrong, or nothing."""
    began = time.monotonic()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AirlightWarning)
            found = read(str(path), chance)
        done, fault = True, "" if is_sound(found) else "is not sound"
    except AirlightError as error:
        done, fault = False, "" if "; " in str(error) and "\n" not in str(error) and len(str(error)) < 500 else f"says {error!r}"
    except Exception as error:  # what is looked for
        done, fault = False, f"raises {error!r}"
    took = time.monotonic() - began
    return done, fault or (f"takes {took:.1f} s" if took > HANG else "")


def campaign(folder: Path, files: Sequence[bytes], number: int, seed: int, read: Read, is_sound: Judge) -> None:
    """Fail where one of so many mutants does harm, or nearly all are read, or refused. read: gets a path, and the chance by which it may
    choose among options."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    faults, reads = [], 0
    path = folder / "mutant"
    for i in range(number):
        chance = random.Random(f"{seed}:{i}")
        data = files[i % len(files)]
        path.write_bytes(mutate(chance, data, chance.choice(files), chance.choice((96, 1000))) if chance.random() < 0.95 else data)
        done, fault = attempt(path, chance, read, is_sound)
        reads += done
        if fault:
            path.rename(folder / f"harmful-{i}")
            faults.append(f"{folder}/harmful-{i}: {fault}")
    assert not faults, f"{len(faults)} faults:\n" + "\n".join(faults[:5])
    assert number // 20 < reads < number * 19 // 20, "the mutations are too coarse, or too tame"
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < GROWTH
