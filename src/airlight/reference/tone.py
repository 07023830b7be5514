"""Evaluates the view transforms of scenes in float64: twins of the functions of composite/tone.wgsl, of the same names."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.colour import srgb_decode
from airlight.composite import view

Array = npt.NDArray[np.floating[Any]]
INTO = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
BACK = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
INSET = np.array([
    [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
    [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
    [0.0423756549057051, 0.0784336, 0.879142973793104],
])  # fmt: skip
STOPS = 10.0, 6.5  # of AgX, below and above middle grey
CURVE = (2.0, 0.5, 3.0, 3.25)  # of AgX at middle grey: slope, value; powers below and above


def filmic(color: Array) -> Array:
    """Map (..., 3) linear to display-linear 0..1: Stephen Hill's fit of the ACES curve (BakingLab, ACES.hlsl), at exposure 1 / 0.6."""
    v = np.clip(color, 0, 65504) / 0.6 @ INTO.T
    fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    return np.asarray(np.clip(fitted @ BACK.T, 0, 1))


def agx_curve(x: Array) -> Array:
    """Evaluate AgX's sigmoid (Troy Sobotka, AgX; the form of the curve: Jed Smith) of shares of its range of stops, 0..1 to 0..1."""
    slope, value, *powers = CURVE
    middle = STOPS[0] / sum(STOPS)
    x = np.asarray(x, float)
    above = x >= middle
    run, rise, power = np.where(above, 1 - middle, middle), np.where(above, 1 - value, value), np.where(above, powers[1], powers[0])
    scale = ((slope * run) ** -power * ((slope * run / rise) ** power - 1)) ** (-1 / power)
    t = slope * np.abs(x - middle) / scale
    return np.asarray(value + np.sign(x - middle) * scale * t / (1 + t**power) ** (1 / power))


def agx(color: Array) -> Array:
    """Map (..., 3) linear to display-linear 0..1 by AgX's base look, as a display of gamma 2.2 shows it (Troy Sobotka, AgX)."""
    v = np.maximum(np.clip(color, 0, 65504) @ INSET.T, 1e-10)
    x = np.clip((np.log2(v / 0.18) + STOPS[0]) / sum(STOPS), 0, 1)
    return np.asarray(np.clip(agx_curve(x) @ np.linalg.inv(INSET).T, 0, 1) ** 2.2)


def view_coordinate(color: Array) -> Array:
    """Find where in a view's table, 0..1 along each axis, linear colours (..., 3) lie."""
    low, high = np.log2(view.NEAR), np.log2(view.FAR + view.NEAR)
    return np.asarray((np.log2(np.clip(color, 0, view.FAR) + view.NEAR) - low) / (high - low))


def displayed(color: Array, name: str) -> Array:
    """Map (H, W, 3) linear by a view transform, by its name, to what a display shows, linear. Raises AirlightError."""
    known = {"none": lambda v: v, "filmic": filmic, "agx": agx}.get(name.lower())
    if known is not None:
        return np.asarray(known(color))
    codes = np.ascontiguousarray(color, np.float32)[None].reshape(1, -1, 3).copy()
    view.view(name).applyRGB(codes)
    return np.asarray(srgb_decode(np.clip(codes.reshape(color.shape), 0, 1).astype(np.float64)))
