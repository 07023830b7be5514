"""The main job where there is no graphics adapter: the float64 reference, on a source made small enough to wait for."""

import math
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from airlight.errors import AirlightError
from airlight.lights import ImageLight
from airlight.lights.around import around_table
from airlight.options import Parameters
from airlight.planes import block_means
from airlight.reference import radial
from airlight.reference.around import around_light
from airlight.scatter.methods import METHODS

PIXELS = 400_000  # of the sum; larger images are summed at a whole fraction of their resolution
TAPS = 400


def _shrink(image: Any, factor: int) -> Any:
    """Average factor x factor pixels, the border repeated where the size does not divide."""
    height, width = image.shape[:2]
    padded = np.pad(image, ((0, -height % factor), (0, -width % factor), (0, 0)), mode="edge")
    return block_means(padded, factor)


def layer(
    rgb: Any,
    lights: Sequence[ImageLight],
    p: Parameters,
    *,
    alpha: Any = None,
    depth: Any = None,
    mask: Any = None,
    fraction: bool = False,
    luminance: Any = radial.REC709,
) -> Any:
    """Sum as the GPU's layer, (H, W, 3) float32: Eq. 4, the listing, or the converged sum by at most 400 midpoint taps."""
    if METHODS[p.method].per_sample and p.offset in ("gradient", "blue"):
        raise AirlightError(f"jitter {p.offset} needs a graphics adapter: use fixed or midpoint")
    height, width = rgb.shape[:2]
    if fraction:
        m = radial.mask(rgb, alpha, depth, p, luminance) * (1.0 if mask is None else mask)
        emitted = np.repeat(m[..., None], 3, axis=2)
    else:
        emitted = radial.source(rgb, p, alpha=alpha, depth=depth, user_mask=mask, luminance=luminance)
    factor = max(1, math.ceil(math.sqrt(height * width / PIXELS)))
    small = _shrink(emitted, factor)
    # whole small pixels may reach beyond the image: positions are scaled so that the two grids agree
    reach = np.array([small.shape[1] * factor / width, small.shape[0] * factor / height])
    plain = msgspec.structs.replace(p, occlusion="none", normalization="mean", scale=1.0)
    listing = p.normalization == "listing"
    total = np.zeros((height, width, 3))
    x, y = np.meshgrid((np.arange(width) + 0.5) / width / reach[0], (np.arange(height) + 0.5) / height / reach[1])
    for light in lights:
        at, density = light.placed(width, height, p.density)
        moved, plain = np.array(at) / reach, msgspec.structs.replace(plain, density=density)
        if listing and METHODS[p.method].per_sample:
            sums = radial.summed(small, moved, msgspec.structs.replace(plain, normalization="listing", exposure=1.0))
            sums -= small  # the unweighted sample comes from the full resolution below
        else:
            sums = radial.summed(small, moved, plain, taps=TAPS)
            if listing:
                sums *= (p.samples if p.decay == 1 else p.lam / (1 - p.decay)) / p.exposure if p.exposure else 0.0
        one = radial.bilinear(sums, x, y)
        if listing:
            one = p.exposure * (emitted + one)
        table = around_table(light.cookie)
        if table is not None:
            one = one * around_light(table, (width, height), (at[0] * width, at[1] * height))
        total += one * np.asarray(light.rgb)
    return np.maximum(total, 0).astype(np.float32)
