"""Mutants of glTF files through `open_scene`, in the style of fuzzing.py. Used by test_gltf_fuzz.py."""

import copy
import json
import random
import resource
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gltfs
from fuzzing import mutate

from airlight.errors import AirlightError, AirlightWarning, MachineError
from airlight.scenes import Stage, open_scene

HANG = 10  # seconds
DATA = Path(__file__).parent / "data"
ODD: tuple[Any, ...] = (0, 1, 2, -1, 3, 7, 255, 256, 65535, 65536, 2**31 - 1, 2**31, 2**32, 2**53, 10**30, 0.5, -0.0, 1e-45, 1e-30, 1e8)
ODD += (1e9, 1e30, 1e300, True, None, "", "x", "2.0", [], {}, [0], [[]], "../x", "/dev/zero", "data:;base64,AAAA", "MAT4", "SCALAR", "VEC3")
ODD += (5120, 5121, 5123, 5125, 5126, "weights", "rotation", "CUBICSPLINE", "STEP", "BLEND", 9984, [0, 0, 0], [1e9] * 4, [0] * 16)


def _places(thing: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """(container, key) of everything inside."""
    for key in thing if isinstance(thing, dict) else range(len(thing)) if isinstance(thing, list) else ():
        found.append((thing, key))
        _places(thing[key], found)
    return found


def mutated(chance: random.Random, seeds: list[bytes]) -> bytes:
    """One mutant of a GLB: of its JSON's structure, its numbers, or its bytes."""
    data = chance.choice(seeds)
    kind = chance.random()
    if kind < 0.15:
        return mutate(chance, data, chance.choice(seeds))
    document, binary = gltfs.parts(data)
    if kind < 0.3:
        return gltfs.glb(json.dumps(document).encode(), mutate(chance, binary, binary, len(binary)))
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        places = _places(document, [])
        container, key = chance.choice(places)
        numbers = [place for place in places if type(place[0][place[1]]) in (int, float)]
        if chance.random() < 0.6:
            container, key = chance.choice(numbers)
        match chance.randrange(7):
            case 0 | 1:
                container[key] = chance.choice(ODD)
            case 2:
                del container[key]
            case 3:
                other, name = chance.choice(places)
                if name in other if isinstance(other, dict) else name < len(other):
                    container[key] = copy.deepcopy(other[name])
            case 4:
                if isinstance(container, list):
                    container.extend(copy.deepcopy(container) * chance.choice((1, 1, 3)))
            case 5:
                if type(container[key]) in (int, float):
                    container[key] += chance.choice((-1, 1, 2, -2, 100, 0.1))
            case 6:
                if type(container[key]) in (int, float):
                    container[key] *= chance.choice((-1, 2, 0.5, 1000, 1e6))
    text = json.dumps(document).encode()
    return gltfs.glb(mutate(chance, text, text) if chance.random() < 0.05 else text, binary)


def campaign(folder: Path, number: int, seed: int, render: Callable[[Stage], None]) -> tuple[int, list[str], float, int]:
    """(how many were stages, faults, the longest in seconds, KiB that the process grew) of `number` mutants. Some stages are rendered."""
    files = ((DATA / name).read_bytes() for name in ("hawk.glb", "cases/meshopt.glb"))
    seeds = [gltfs.everything().glb(), gltfs.everything().glb(), gltfs.lamp().glb(), *files]
    path = folder / "mutant.glb"
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    stages, faults, longest = 0, [], 0.0
    for i in range(number):
        chance = random.Random(f"{seed}:{i}")
        path.write_bytes(mutated(chance, seeds))
        start = time.monotonic()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.simplefilter("ignore", AirlightWarning)
                stage = open_scene(str(path), "none" if i % 20 else None)
                for t in (0.3 * stage.duration, 7.1):
                    stage.pose(t, next(iter(stage.cameras.values())))
                if i % 10 == 0:
                    render(stage)
            stages += 1
        except AirlightError as error:
            if isinstance(error, MachineError) or "\n" in str(error) or "; " not in str(error) or len(str(error)) > 600:
                faults.append(f"{seed}:{i}: {type(error).__name__}: {error}")
        except Exception:
            faults.append(f"{seed}:{i}: {traceback.format_exc()}")
        longest = max(longest, time.monotonic() - start)
        if time.monotonic() - start > HANG:
            faults.append(f"{seed}:{i}: took {time.monotonic() - start:.1f} s")
    return stages, faults, longest, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
