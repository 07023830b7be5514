"""Synthetic pictures with known content, for tests and benchmarks."""

from typing import Any

import numpy as np
import numpy.typing as npt


def foliage(
    width: int, height: int, *, seed: int = 1, sun: tuple[float, float] = (0.6, 0.35), detail: float = 1.0
) -> npt.NDArray[np.float32]:
    """Draw (height, width, 3) float32 linear: an HDR sun (radiance 200) in a sky behind aliased thin stems and leaves.

    detail: factor of the size of stems and leaves; as many more of them as cover as much.
    """
    rng: Any = np.random.default_rng(seed)
    scale = width / 1920
    y, x = np.mgrid[0:height, 0:width].astype(np.float32) + np.float32(0.5)
    r = np.hypot(x - sun[0] * width, y - sun[1] * height)
    image = (1.0 - 0.4 * y / height)[..., None] * np.array([0.5, 0.7, 1.0])
    image += (3 * np.exp(-r / (60 * scale)))[..., None] * np.array([1.0, 0.8, 0.5])
    image[r < 14 * scale] = (200.0, 180.0, 140.0)
    covered = np.zeros((height, width), bool)
    size = scale * detail
    for _ in range(round(260 / detail**2)):
        x0, y0, angle = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0, np.pi)
        length, half = rng.uniform(40, 500) * size, rng.uniform(0.4, 2.5) * max(size, 0.5)
        reach = length / 2 + half + 1
        i, j = slice(int(max(0, y0 - reach)), int(y0 + reach) + 1), slice(int(max(0, x0 - reach)), int(x0 + reach) + 1)
        dx, dy = x[i, j] - x0, y[i, j] - y0
        along, across = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
        covered[i, j] |= (np.abs(across) < half) & (np.abs(along) < length / 2)
    for _ in range(round(900 / detail**2)):
        x0, y0, radius = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(2, 18) * size
        i, j = slice(int(max(0, y0 - radius - 1)), int(y0 + radius) + 2), slice(int(max(0, x0 - radius - 1)), int(x0 + radius) + 2)
        covered[i, j] |= np.hypot(x[i, j] - x0, y[i, j] - y0) < radius
    image[covered] = 0
    return image.astype(np.float32)
