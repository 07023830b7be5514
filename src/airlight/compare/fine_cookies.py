"""Finds cookies that are finer than the pixels of a picture that is compared."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.lights.punctual import PunctualLight
from airlight.projection import eye_rays

Array = np.ndarray
SHARES = (0.2, 0.5, 0.8)  # of a ray, at which texels are counted
SHOWN = 0.9  # of what is seen of a cookie: it has no more texels a pixel
FINE = 1.0  # texels a pixel, from which on their mean is another thing than one of them


def doubt_of_cookies(lights: Sequence[PunctualLight], view: Any, projection: Any, lengths: Array, farthest: float) -> str | None:
    """Words one line where texels of a cookie are finer than pixels: the march averages them, a ray of the truth meets one of them.

    view, projection: (4, 4) of the camera; lengths: (H, W) m of rays, of which `farthest` m count.
    """
    most = max((texels_a_pixel(light, view, projection, lengths, farthest) for light in lights if light.cookie is not None), default=0.0)
    if most < FINE:
        return None
    wide = round(lengths.shape[1] * most / 10) * 10
    return (
        f"a pixel holds {most:.1f} texels of a cookie side by side: march takes their mean, the ray of the truth through its middle "
        f"one, and a part of the error is that; compare with --width {wide}, or with a coarser cookie"
    )


def texels_a_pixel(light: PunctualLight, view: Any, projection: Any, lengths: Array, farthest: float) -> float:
    """Counts the texels of a light's cookie side by side in a pixel, where the light is seen: more in a tenth of it; 0 where it is not."""
    assert light.cookie is not None
    rays, flat = eye_rays(projection)
    rows, columns = np.indices(lengths.shape)[:, ::8, ::8]
    height, width = lengths.shape
    x, y = rays[0] * (columns + 0.5) / width + rays[2], rays[1] * (rows + 0.5) / height + rays[3]
    along = np.stack([(1 - flat) * x, (1 - flat) * y, -np.ones_like(x)], axis=-1)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    start = np.stack([flat * x, flat * y, np.zeros_like(x)], axis=-1)
    into = np.linalg.inv(np.asarray(view, float))
    counts = []
    for share in SHARES:
        t = share * np.minimum(lengths[::8, ::8], farthest)
        points = (start + t[..., None] * along) @ into[:3, :3].T + into[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            lit = light.incident(points)[2] > 0
        q = (points - light.origin()) @ light.axes().T
        size, wide = np.array(light.cookie.pixels.shape[1::-1]), 2 * np.array(light.tangents())
        texels = size[0] / light.cookie.size if light.directional else (size / wide).max() / np.maximum(q[..., 2], 1e-6)
        pixel = abs(rays[0]) / width * (t if flat == 0 else 1.0)
        counts.append((texels * pixel * np.ones(t.shape))[lit])
    found = np.concatenate(counts)
    return float(np.quantile(found, SHOWN)) if len(found) else 0.0
