"""Finding the light: the sun, or the brightest compact source of a picture."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.files.colour import to_linear

SIDE = 320  # longest side of the picture that is searched, px
WINDOWS = (0.06, 0.03, 0.015)  # radii of the mean shift, coarse to fine, of the longest side
LARGEST = 0.45  # a source that covers more of the picture is not compact
OPENING = 0.1  # share of the picture from which a source is an opening rather than a sun
CONTRAST = 2.5  # of the source over the median luminance


@dataclass(frozen=True)
class Found:
    """position: (x, y) normalised. contrast: luminance of the source over the picture's median."""

    position: tuple[float, float]
    contrast: float


def _blur(plane: npt.NDArray[Any], sigma: float) -> npt.NDArray[Any]:
    """Gaussian blur, its border repeated."""
    reach = max(1, int(3 * sigma + 0.5))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-3)) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        pad = [(reach, reach) if a == axis else (0, 0) for a in (0, 1)]
        wide = np.pad(plane, pad, mode="edge")
        size = plane.shape[axis]
        plane = sum(k * np.take(wide, range(i, i + size), axis=axis) for i, k in enumerate(kernel))
    return plane


def find_light(image: Any) -> Found | None:
    """The light of an image as in airlight.light_shafts (floats are linear); None where no compact source stands out.

    Block means to 320 px, then a mean shift over ever smaller windows towards the brightest region. What is clipped is
    all equally bright: there the middle of the region is found, which is where a sun or an opening is. Scaling the
    image changes nothing.
    """
    image = np.asarray(image)
    if image.dtype.kind != "f" or image.ndim != 3 or image.shape[2] != 3:
        image = to_linear(image)[0]
    height, width = image.shape[:2]
    block = max(1, -(-max(height, width) // SIDE))
    rows, columns = height // block, width // block
    if min(rows, columns) < 2:
        return None
    small = image[: rows * block, : columns * block].reshape(rows, block, columns, block, 3)
    y = np.nan_to_num(small.mean(axis=(1, 3)), nan=0.0, posinf=0.0, neginf=0.0) @ np.array([0.2126, 0.7152, 0.0722])
    y = np.maximum(y, 0)
    longest = max(rows, columns)
    fine = _blur(y, 0.004 * longest)
    peak = float(fine.max())
    if peak <= 0:
        return None
    # high powers single out what is as bright as the peak; at several scales, a wide patch beats a glint
    bright = np.minimum(y / peak, 1.0) ** 6
    score = np.sum([_blur(bright, s * longest) for s in (0.01, 0.02, 0.04)], axis=0)
    at = np.array(np.unravel_index(int(np.argmax(score)), score.shape), float)
    grid = np.indices(y.shape).astype(float)
    for radius in WINDOWS:
        for _ in range(20):
            distance = ((grid - at[:, None, None]) ** 2).sum(axis=0)
            weight = bright * np.exp(-0.5 * distance / (radius * longest) ** 2)
            moved = (grid * weight).sum(axis=(1, 2)) / max(weight.sum(), 1e-12)
            step, at = np.abs(moved - at).max(), moved
            if step < 0.05:
                break
    share = float((y > 0.7 * peak).mean())
    if share > OPENING:  # an evenly bright opening has no brightest place worth the name: its middle
        at = (grid * (y > 0.7 * peak)).sum(axis=(1, 2)) / (y > 0.7 * peak).sum()
    level = float(_blur(y, 0.01 * longest)[round(at[0]), round(at[1])])
    contrast = level / max(float(np.median(y)), 1e-6 * peak)
    if contrast < CONTRAST or share > LARGEST:
        return None
    x, z = (at[1] + 0.5) * block / width, (at[0] + 0.5) * block / height
    return Found((float(x), float(z)), float(contrast))
