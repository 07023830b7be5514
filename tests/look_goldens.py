"""The look's changes of the shipped photographs, kept as tests/data/look/changes.npz: means of 32 x 24 blocks, in 64ths of a code.

`python tests/look_goldens.py` writes them anew, on software Vulkan, and says how far each is from the one before: look at the pictures.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from look_scenes import Change, shone

import airlight
from airlight.arrays import to_linear
from airlight.colour import encode_codes
from airlight.files import read_image
from airlight.lights import Light
from airlight.options import Look, build, chosen_look, presets
from airlight.planes import shrink

PHOTOS = Path(__file__).parent.parent / "examples" / "photos"
GOLDENS = Path(__file__).parent / "data" / "look" / "changes.npz"
LOOKS = tuple(name for name in presets.names() if "daylight" not in presets.load(name) and chosen_look(presets.load(name)) == "smart")
STEPS = 64  # of a code
COLUMNS, ROWS = 32, 24
LIGHTS = {
    "casa-mila": Light((0.535, 0.43), kind="opening"),
    "beacon-street-sunset": Light((0.897, 0.467), kind="disc"),
    "hill-sunset": Light((0.497, 0.414), kind="disc"),
    "dandelions": Light((0.577, 0.06), kind="glow"),
    "sea-sunset": Light((0.63, 0.305), kind="disc"),
    "tea-gardens-mist": Light((0.712, -0.10), kind="beyond"),
    "night-light-frames": Light((0.50, 0.84), kind="lamps"),
    "dark-room-opening": Light((0.50, 0.42), kind="opening"),
}


@cache
def linear_copy(name: str) -> np.ndarray:
    """A photograph, linear, its longer side 640 px."""
    return shrink(read_image(PHOTOS / f"{name}.jpg").linear(), 640)


def photograph(name: str, side: int) -> np.ndarray:
    """A photograph's codes, (H, W, 3) uint8, its longer side `side` px."""
    return encode_codes(shrink(linear_copy(name), side), np.uint8, dither=False)


def changed(renderer: Any, name: str, side: int, strength: float = 1.0) -> Change:
    """The look on it as 16-bit pictures get it, undithered."""
    return shone(renderer, to_linear(photograph(name, side))[0], LIGHTS[name], Look(strength=strength))


def in_look(renderer: Any, name: str, look: str) -> Change:
    """The same by a preset, at 320 px."""
    return shone(renderer, to_linear(photograph(name, 320))[0], LIGHTS[name], build(presets.load(look))[Look])


def blocks(change: Change) -> np.ndarray:
    """(ROWS, COLUMNS, 3): the means of the change in codes."""
    height, width = change.before.shape[:2]
    rows, columns = (np.arange(n) * size // n for n, size in ((ROWS, height), (COLUMNS, width)))
    sums = np.add.reduceat(np.add.reduceat(change.codes, rows, axis=0), columns, axis=1)
    counts = np.diff(np.append(rows, height))[:, None] * np.diff(np.append(columns, width))
    return np.asarray(sums / counts[..., None])


def goldens() -> dict[str, np.ndarray]:
    """The kept block means of `photograph look`, at 320 px, in codes."""
    with np.load(GOLDENS) as kept:
        return {name: kept[name] / STEPS for name in kept.files}


def write() -> None:
    """Replace the goldens."""
    renderer = airlight.Renderer()
    before = goldens() if GOLDENS.exists() else {}
    found = {f"{name} {look}": blocks(in_look(renderer, name, look)) for name in LIGHTS for look in LOOKS}
    for name, now in found.items():
        moved = np.abs(now - before[name]) if name in before else np.abs(now)
        print(f"{name}: mean change {np.abs(now).mean():.2f} codes, moved by {moved.mean():.3f}, at most {moved.max():.2f}")
    GOLDENS.parent.mkdir(exist_ok=True)
    np.savez_compressed(GOLDENS, **{name: np.rint(STEPS * now).astype(np.int16) for name, now in found.items()})


if __name__ == "__main__":
    write()
