"""Geometry and weights of a light's rays, float64: twins of the functions of look/rays.wgsl, bands.wgsl, codes.wgsl, matte_codes.wgsl.

Distances are in picture diagonals; light, box, start, span, nearest, step: as `RayGrid` has them.
"""

from typing import Any

import numpy as np

from airlight.look.grid import LINES, RADII, Array
from airlight.reference.angles import unit_at


def direction_of(line: Array, start: float, span: float) -> Array:
    """Find the unit direction (..., 2) of lines of a light."""
    return unit_at(start + (line + 0.5) * span / LINES)


def is_within(p: Array, box: Any) -> Array:
    """Tell which points (..., 2) lie in the picture."""
    return np.asarray(((p >= 0) & (p <= np.asarray(box))).all(axis=-1))


def entry_distance(direction: Array, light: Any, box: Any, inside: bool) -> Array:
    """Find the distance at which rays of unit directions (..., 2) enter the picture; 0 where the light lies in it."""
    if inside:
        return np.zeros(direction.shape[:-1])
    light, box = np.asarray(light), np.asarray(box)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_borders = np.stack([-light / direction, (box - light) / direction])
    enters = np.where(direction != 0, to_borders.min(axis=0), -np.inf).max(axis=-1)
    return np.maximum(enters, 0)


def polar(p: Array, light: Any, start: float, span: float, inside: bool) -> Array:
    """Find (distance from the light, number of the line) of points (..., 2)."""
    d = p - np.asarray(light)
    turn = np.mod(np.arctan2(d[..., 1], d[..., 0]) - start, 2 * np.pi)
    if not inside:
        turn = np.where(turn > span / 2 + np.pi, turn - 2 * np.pi, turn)
    return np.stack([np.linalg.norm(d, axis=-1), turn / span * LINES - 0.5], axis=-1)


def band_uv(at: Array, nearest: float, step: float) -> Array:
    """Find texture coordinates (..., 2) of (distance, line) in bands with a line more on either side."""
    row = np.clip((at[..., 0] - nearest) / step - 1, 0, RADII - 1)
    return np.stack([(at[..., 1] + 1.5) / (LINES + 2), (row + 0.5) / RADII], axis=-1)


def falloff(sigma: Array) -> Array:
    """Begin the weights of a Gaussian, e^(-k^2 / (2 sigma^2)): (..., 3) of the weight at 0, the factor to 1, the factor of factors."""
    first = np.exp(-0.5 / np.maximum(np.square(sigma), 1e-6))
    return np.stack([np.ones_like(first), first, first**2], axis=-1)


def neighbour_weight(at: Array, count: Array, inside: bool) -> Array:
    """Weigh a neighbour: all the way round 1, else nothing beyond the first and the last."""
    return np.where(inside | ((at >= 0) & (at < count)), 1.0, 0.0)


def linear_root(t: Array) -> Array:
    """Approximate the square root of the linear light of an sRGB code, t = (code + 0.055) / 1.055, to 1.5 %."""
    return np.asarray(np.polyval([0.2997, -0.80355, 0.9226, 0.58482, -0.00357], t))


def linear_root_slope(t: Array) -> Array:
    """Differentiate `linear_root`."""
    return np.asarray(np.polyval(np.polyder([0.2997, -0.80355, 0.9226, 0.58482, -0.00357]), t))


def approximate_srgb_decode(code: Array) -> Array:
    """Approximate linear light of sRGB codes, t^2.4 by the roots t^2.5 and t^2.25."""
    t = (np.asarray(code) + 0.055) / 1.055
    return 0.54676 * t**2.5 + 0.52013 * t**2.25 - 0.06689 * t**2
