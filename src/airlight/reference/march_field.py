"""Evaluates what the march's shaders compute of a density that varies along rays, in float64, each function under its shader's name.

Arrays broadcast; vectors lie along the last axis. frame: a record as the shaders have it, scatter.march.records; fog: one of resolve.FOGS.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.height import FAR, height_density, mean_height_density
from airlight.reference.march import height, layer_of_fog, scattered_share
from airlight.reference.medium import mean_transmittance

Array = npt.NDArray[np.floating[Any]]
DENSE_DEPTHS = 14  # of exponential fog, above which there is next to nothing
IN_GRIDS = 4  # steps of a group where there are grids
MANY_STEPS = 64  # from which on groups of steps are of 8, else of 4


def place_at(ray: Any, t: Any) -> Array:
    """Finds (..., 3) rays' places at t."""
    return np.asarray(ray["origin"] + np.asarray(t, float)[..., None] * ray["direction"].astype(float))


def footprint(t: Any, panel: Any, pixel: Any, flat_pixel: Any, is_exact: bool) -> Array:
    """Finds the metres that a pixel is wide at t of a ray, or, in steps, that a panel is long."""
    return np.maximum(flat_pixel + pixel * np.asarray(t, float), 0.0 if is_exact else panel)


def even_density(place: Any, frame: Any, fog: str) -> Array:
    """Evaluates the air's density at places by their heights alone."""
    rho = 1.0 if fog == "none" else height_density(height(place, frame), layer_of_fog(frame), fog)
    return np.asarray(rho * np.full(np.shape(place)[:-1], float(frame["air"])))


def mean_even_density(a: Any, b: Any, frame: Any, fog: str) -> Array:
    """Averages the air's density, by height alone, between two places each."""
    mean = 1.0 if fog == "none" else mean_height_density(height(a, frame), height(b, frame), layer_of_fog(frame), fog)
    return np.asarray(mean * np.full(np.shape(a)[:-1], float(frame["air"])))


def fog_ahead(ray: Any, t: Any, frame: Any, fog: str) -> Array:
    """Finds how far from t rays' heights leave the part of fog over which a panel may reach: half its depth."""
    climb = (ray["direction"].astype(float) * frame["up"]).sum(axis=-1)
    y, depth = height(place_at(ray, t), frame), float(frame["fog_depth"])
    top, rate = depth * (DENSE_DEPTHS if fog == "exponential" else 1), np.maximum(np.abs(climb), 1e-12)
    outside = np.where(y < 0, np.maximum(-y, 0), np.maximum(y - top, 0))
    ahead = np.maximum(outside, np.where(outside > 0, 1e-3, 0.5) * depth) / rate
    return np.where(((y <= 0) & (climb <= 0)) | ((y >= top) & (climb >= 0)), FAR, ahead)


def mean_between(first: Any, second: Any, apart: Any) -> Array:
    """Averages e^-x over x between two values that are `apart`, from it at both."""
    return np.asarray(np.maximum(first, second) * mean_transmittance(np.asarray(apart, float)))


def mean_between_heights(a: Any, b: Any, densest: Any, frame: Any, fog: str) -> Array:
    """Averages density by height between two heights at which it is known; densest: the greater of both."""
    return mean_height_density(a, b, layer_of_fog(frame), fog)


def group_size(k: Any, n: Any, grids: Any, varies: bool, is_exponential: bool = False) -> Array:
    """Chooses the number of steps of a group that begins at the k-th of n. grids: (..., 2) steps that begin and end where there are some;
    is_exponential: in fog that is, and nothing else."""
    n = np.asarray(n)
    most = np.where(n >= MANY_STEPS, 16.0 if is_exponential else 8.0, 4.0)
    if varies:
        most = np.where((k + most > grids[..., 0]) & (k < grids[..., 1]), np.where(n >= MANY_STEPS, IN_GRIDS, 1.0), most)
    return np.where(k + most <= n, most, 1.0)


def sum_of_powers(x: Any, n: Any) -> Array:
    """Sums (..., 3) the powers 0 to n - 1 of numbers (..., 3), n (...) 1, 2, 4, 8 or 16."""
    x = np.asarray(x, float)
    return np.asarray(sum(np.where(i < np.asarray(n)[..., None], x**i, 0.0) for i in range(16)))


def step_place(k: Any, n: Any, reach: Any, stretch: Any) -> Array:
    """Places the k-th of n steps, or a part of one, along rays. stretch: (..., 4) a range of t, and the steps that begin and end there."""
    marks, steps = _stretched(n, reach, stretch)
    return _piecewise(np.asarray(k, float), steps, marks)


def step_at(t: Any, n: Any, reach: Any, stretch: Any) -> Array:
    """Finds the step, and the part of it, at t of rays: the inverse of step_place."""
    marks, steps = _stretched(n, reach, stretch)
    return _piecewise(np.asarray(t, float), marks, steps)


def _stretched(n: Any, reach: Any, stretch: Any) -> tuple[Array, Array]:
    """Lists (4, ...) places along rays, and the steps there."""
    zero, stretch = np.zeros(np.shape(stretch)[:-1]), np.asarray(stretch, float)
    marks = np.broadcast_arrays(zero, stretch[..., 0], stretch[..., 1], reach)
    return np.stack(marks), np.stack(np.broadcast_arrays(zero, stretch[..., 2], stretch[..., 3], n))


def _piecewise(x: Array, xs: Array, ys: Array) -> Array:
    """Evaluates the broken line through points."""
    part = np.where(x < xs[1], 0, np.where(x < xs[2], 1, 2))
    low_x, high_x, low_y, high_y = (np.take_along_axis(v, part[None] + k, 0)[0] for v in (xs, ys) for k in (0, 1))
    return np.asarray(low_y + (x - low_x) * (high_y - low_y) / np.maximum(high_x - low_x, 1e-20))


def in_lamp_step(ray: Any, nearest: Any, step: Any, angle: Any, frame: Any, light: Any, kind: int, fog: str) -> Array:
    """Evaluates (..., 3) the integrand over t, times dt / d(angle), at angles in steps. Kulla and Fajardo 2012.

    step: records of steps.wgsl's LampStep, between whose ends optical lengths are interpolated. kind: of the phase function.
    """
    d, t = nearest[..., 1] / np.cos(angle), nearest[..., 0] + nearest[..., 1] * np.tan(angle)
    place, ends = place_at(ray, t), step["range"].astype(float)
    axis_cosine = ((place - light["position"]) * light["axis"].astype(float)).sum(axis=-1) / d
    strength = scattered_share(d, -np.sin(angle), axis_cosine, light, kind)
    at = np.clip((t - ends[..., 0]) / np.maximum(ends[..., 1] - ends[..., 0], 1e-20), 0, 1)
    here = np.maximum(even_density(place, frame, fog) + step["excess"], 0)
    way = step["lengths"][..., 0] + at * (step["lengths"][..., 1] - step["lengths"][..., 0].astype(float))
    power = frame["sigma_s"].astype(float) * light["intensity"] * np.exp(-way[..., None] * frame["sigma_t"].astype(float))
    return np.asarray(power * (strength * here / nearest[..., 1])[..., None])
