"""Chooses how bright daylight is on a photograph: as its own sky, where it shows one, else so that white in the sun is 1."""

from typing import TYPE_CHECKING

import numpy as np

from airlight.luminance import REC709_F32

if TYPE_CHECKING:
    from airlight.daylight import Atmosphere
    from airlight.jobs.daylight_depth import Distances
    from airlight.jobs.daylight_view import View

STRONGEST = 1e9  # sun's strength that the option takes
CLIPPED = 0.97  # linear: as bright pixels do not say how bright they were
BY_DAY = 0.01  # linear: the median of a darker sky is none of a day, but night, or what a render has behind it
LOOKED_AT = 200  # pixels of the sky
LOWEST = 0.25  # of the sky that is seen: the part above the horizon that a kept one goes by
LEAST_SKY = 0.02  # of the picture


def some_of(height: int, width: int) -> tuple[slice, slice]:
    """Choose some 50,000 pixels of a picture, at even steps."""
    step = max(1, int((height * width / 50_000) ** 0.5))
    return slice(step // 2, None, step), slice(step // 2, None, step)


def strength_of_sky(air: "Atmosphere", view: "View", found: "Distances", light: np.ndarray, is_kept: bool) -> float | None:
    """Estimate the sun's irradiance above the air that a photograph's own sky stands for; None where it shows too little of one.

    light: (H, W, 3) linear Rec. 709. is_kept: what counts is where it meets the land, else all of it.
    """
    from airlight.daylight.picture import sky_strength

    some = some_of(*light.shape[:2])
    own = light[some] @ REC709_F32
    is_sky = found.sky[some] >= 1
    rows, columns = np.nonzero(is_sky & (own < CLIPPED) & (own > 0))
    if len(rows) < LEAST_SKY * own.size or np.median(own[is_sky]) < BY_DAY:
        return None
    chosen = slice(None, None, max(1, len(rows) // LOOKED_AT))
    rows, columns = rows[chosen], columns[chosen]
    camera, (left, top) = view.camera, view.corner
    y, x = (np.arange(size)[which] for size, which in zip(found.sky.shape, some))
    rays = camera.at((left + x[columns] + 0.5) / camera.width, (top + y[rows] + 0.5) / camera.height)
    up, turn = np.degrees(np.arcsin(np.clip(rays[:, 1], -1, 1))), np.degrees(np.arctan2(rays[:, 0], rays[:, 2]))
    keep = up > 0
    if not keep.any():
        return None
    if is_kept:  # far things are to go over into it
        keep &= up <= np.quantile(up[keep], LOWEST)
    fits = sky_strength(air, own[rows, columns][keep], up[keep], turn[keep] - view.azimuth, view.sun.elevation, view.altitude)
    return fits if fits > 0 else None
