"""Write a layer of broken cloud over the scene `valley` as a volume, FILE.npz, for --volume: docs/daylight.md.

Its cover is noise of the octaves of SIZES, m, above what leaves HOLES of the sky open; flat below, rounded above.
"""

import sys

import numpy as np
import numpy.typing as npt

BOUNDS = np.array([[-1400.0, 260.0, -2600.0], [1400.0, 330.0, 300.0]])  # m: least and greatest x, y, z
CELL = 20.0  # m, along x and z
LAYERS = 8
SIZES = ((300.0, 1.0), (130.0, 0.25))  # of the clouds, m, and how much each counts
HOLES, EDGE = 0.1, 0.15  # share of the sky that is open; how soft its edges are, in deviations of the noise
SEED = 7


def noise(rows: int, columns: int, size: float, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """Draw (rows, columns) smooth noise of deviation 1, whose features are as large as size, m."""
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(rows, CELL), np.fft.fftfreq(columns, CELL), indexing="ij"))
    drawn = np.fft.ifft2(np.fft.fft2(rng.standard_normal((rows, columns))) * np.exp(-((waves * size / 1.5) ** 2))).real
    return np.asarray(drawn / drawn.std())


def cloud_layer() -> npt.NDArray[np.float64]:
    """Draw (y, z, x) the density of the layer, 0..1."""
    rng = np.random.default_rng(SEED)
    columns, _, rows = (round(side / CELL) if side > 100 else LAYERS for side in BOUNDS[1] - BOUNDS[0])
    cover = sum(share * noise(rows, columns, size, rng) for size, share in SIZES)
    above = (cover - np.quantile(cover, HOLES)) / (EDGE * cover.std())
    thick = np.sqrt(np.clip(above, 0, 1))
    height = (np.arange(LAYERS)[:, None, None] + 0.5) / LAYERS
    return np.asarray(np.clip((thick - height) * LAYERS / 2, 0, 1) * np.clip(above, 0, 1))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("give the file to write, as in cloud_layer.py clouds.npz")
    density = cloud_layer().transpose(1, 0, 2)
    np.savez_compressed(sys.argv[1], density=density.astype(np.float16), bounds=BOUNDS)
