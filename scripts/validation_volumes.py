"""Writes the densities that scattering is validated on, into the package's data/scenes/validation/: python scripts/validation_volumes.py

Metres, y up; float16, from noise of Airlight's own.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from airlight.medium.noise import noise_record
from airlight.reference.noise import noise_density

FOLDER = Path(__file__).parent.parent / "src" / "airlight" / "data" / "scenes" / "validation"
Points = Any


def wisps(at: Points, size: float, amount: float, seed: int) -> Any:
    """Noise of mean 1."""
    return noise_density(at, 0.0, noise_record((0, 0, 0), (0, 0, 0), 0.0, size, seed, amount, 3))


def plume(at: Points) -> Any:
    """Smoke that rises from the floor and winds."""
    x, y, z = np.moveaxis(at, -1, 0)
    rise = y / 3.3
    x0, z0 = 0.28 * np.sin(3.1 * y + 0.6) * rise, 0.24 * np.sin(2.3 * y + 2.2) * rise
    r2 = ((x - x0) ** 2 + (z - z0) ** 2) / (0.16 + 0.42 * rise) ** 2
    ends = np.clip(y / 0.25, 0, 1) * np.clip((3.2 - y) / 0.6, 0, 1)
    return 1.6 * np.exp(-1.3 * r2) * ends * wisps(at * [1, 0.6, 1], 0.9, 3.0, 4) / (0.35 + rise)


def bank(at: Points) -> Any:
    """A bank of fog that fills a room to a man's height, torn at the top."""
    y = at[..., 1]
    torn = wisps(at, 1.8, 2.4, 9)
    return np.exp(-np.maximum(y - 0.9 * torn, 0) * 2.2) * torn


VOLUMES: dict[str, tuple[Callable[[Points], Any], tuple[int, int, int], Any]] = {
    "plume": (plume, (26, 40, 26), [[-1.05, 0.0, -1.05], [1.05, 3.3, 1.05]]),
    "bank": (bank, (34, 22, 40), [[-2.95, -0.35, -2.55], [2.95, 3.4, 4.9]]),
}


def centres(shape: tuple[int, int, int], bounds: Any) -> Points:
    """(Z, Y, X, 3) of voxels, of a shape x, y, z."""
    low, high = np.array(bounds)
    x, y, z = (low[i] + (np.arange(n) + 0.5) * (high[i] - low[i]) / n for i, n in enumerate(shape))
    return np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1)


if __name__ == "__main__":
    for name, (density, shape, bounds) in VOLUMES.items():
        path = FOLDER / f"{name}.npz"
        values = density(centres(shape, bounds)).clip(0)
        values[values < 2e-3] = 0
        np.savez_compressed(path, density=values.astype(np.float16), bounds=np.array(bounds))
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, {values.max():.2f} at most")
