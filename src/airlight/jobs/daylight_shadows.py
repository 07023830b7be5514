"""Estimates D of a picture, the share of the way to each pixel that sees no sun, by the sum of GPU Gems 3's Eq. 3 over its sky.

Every point of a view ray sees the sun along the same line of the picture, from the pixel to the sun. What is farther than what the pixel
shows cannot stand between: ground that runs on towards the horizon does not hide the sun of the air above it. So, where depths are known,
the sum is taken for some distances, with all that is nearer dark, and each pixel reads between two of them.
"""

from collections.abc import Callable

import numpy as np

from airlight.jobs.daylight_depth import Distances

LAYERS = 6  # distances for which the sum is taken, beside that of the sky
ENDS = (0.01, 0.99)  # quantiles of the distances between which these lie, in equal ratios
Plane = np.ndarray


def dark_share(found: Distances, fraction: Callable[[Plane], Plane], is_map: bool) -> Plane:
    """Estimate D, (H, W) float32. fraction: gives it for a mask of what emits, (H, W) 0..1; is_map: whether distances are known."""
    in_sky = fraction(found.sky)
    land = np.isfinite(found.metres) & (found.sky < 1) & (found.metres > 0)
    if not is_map or not land.any():
        return in_sky
    near, far = (float(np.quantile(found.metres[land], end)) for end in ENDS)
    if far / near < 1.01:
        return np.asarray(in_sky * found.sky, np.float32)
    edges = np.geomspace(near, far, LAYERS)
    ratio = np.log(edges[1] / edges[0])
    metres = np.where(land, found.metres, far)
    place = np.clip(np.log(metres / near) / ratio - 1, 0, LAYERS - 1)  # a layer nearer, so that none of both lies beyond the pixel
    below, share = place.astype(int), (place % 1).astype(np.float32)
    dark = np.zeros(place.shape, np.float32)
    for layer, edge in enumerate(edges):
        weight = np.where(below == layer, 1 - share, np.where(below == layer - 1, share, 0))
        if layer and weight.any():  # before the first nothing is nearer
            dark += weight * fraction(np.maximum(found.sky, found.metres >= edge).astype(np.float32))
    return np.asarray(dark + found.sky * (in_sky - dark), np.float32)
