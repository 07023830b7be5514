"""Writes smoke that rises from a wick into still air, examples/volumes/smoke.npz: python scripts/smoke.py

Each voxel is traced back through a flow without divergence, the curl of a noise that grows with the height and rises, to the wick that its
smoke came from. Metres, y up, the wick at the origin; density 1 at the wick.
"""

from pathlib import Path

import numpy as np

FILE = Path(__file__).parent.parent / "examples" / "volumes" / "smoke.npz"
SHAPE, BOUNDS = (80, 144, 80), np.array([[-0.8, 0.0, -0.8], [0.8, 3.2, 0.8]])
CELLS, TILE = 64, 1.9  # of the flow's period, and its length, m
RISE, STEP, STEPS = 0.6, 0.08, 90  # m/s, s
WICK = 0.075  # its radius, m


def flow(seed: int) -> np.ndarray:
    """(CELLS, CELLS, CELLS, 3) m/s, x, y, z: the curl of a periodic potential of random phases, of deviation 1."""
    rng = np.random.default_rng(seed)
    k = np.stack(np.meshgrid(*[np.fft.fftfreq(CELLS, 1 / CELLS)] * 3, indexing="ij"))
    f = np.sqrt((k**2).sum(axis=0))
    share = np.where((f > 0) & (f < 14), np.maximum(f, 1) ** -2.7, 0)
    potential = np.fft.fftn(rng.standard_normal((3, CELLS, CELLS, CELLS)), axes=(1, 2, 3)) * share
    curl = np.fft.ifftn(1j * np.cross(k, potential, axis=0), axes=(1, 2, 3)).real
    return np.moveaxis(curl / curl.std(), 0, -1)


def looked_up(field: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Trilinear, periodic."""
    cell = at / TILE * CELLS
    low = np.floor(cell).astype(int)
    share, out = cell - low, np.zeros_like(at)
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, share, 1 - share), axis=-1, keepdims=True)
        out += weight * field[tuple(((low + corner) % CELLS).T)]
    return out


def smoke() -> np.ndarray:
    """Density (Z, Y, X)."""
    x, y, z = (BOUNDS[0, i] + (np.arange(n) + 0.5) * (BOUNDS[1, i] - BOUNDS[0, i]) / n for i, n in enumerate(SHAPE))
    at = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    density, alive, turning = np.zeros(len(at)), np.arange(len(at)), flow(7)
    for k in range(STEPS):
        here = at[alive]
        wild = 0.19 * np.clip(here[:, 1:2] / 1.0, 0, 1) ** 1.2  # laminar at first
        velocity = wild * looked_up(turning, here + (0, 0.35 * k * STEP, 0))
        velocity[:, 1] += RISE
        velocity[:, [0, 2]] += 0.12 * here[:, [0, 2]] * np.clip(here[:, 1:2], 0.1, 1)  # it widens
        here = here - STEP * velocity
        at[alive] = here
        done = here[:, 1] < 0
        r2 = (here[done, 0] ** 2 + here[done, 2] ** 2) / WICK**2
        density[alive[done]] = np.exp(-0.5 * r2) * np.exp(-0.10 * k * STEP)
        alive = alive[~done & (np.hypot(here[:, 0], here[:, 2]) < 1.6)]
    density = density.reshape(SHAPE[::-1])
    for _ in range(3):  # no finer than the voxels can show: along z, y and x in turn
        padded = np.pad(density, ((1, 1), (0, 0), (0, 0)), "edge")
        density = np.moveaxis((padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4, 0, 2)
    aside, up = np.maximum(np.abs(x), np.abs(z)[:, None]) / x[-1], y / y[-1]
    density *= np.clip(4 - 4 * aside, 0, 1)[:, None, :] * np.clip(3 - 3 * up, 0, 1)[None, :, None]  # so that no face cuts it
    return density


if __name__ == "__main__":
    values = smoke()
    values[values < 4e-3] = 0
    FILE.parent.mkdir(exist_ok=True)
    np.savez_compressed(FILE, density=np.round(values * 250).astype(np.float16) / np.float16(250), bounds=BOUNDS)
    print(f"{FILE.name}: {FILE.stat().st_size / 1000:.0f} kB, {values.max():.2f} at most")
