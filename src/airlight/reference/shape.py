"""Shapes of lights in float64: twins of scatter/march/shape.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.march import clip_range

Array = npt.NDArray[Any]


def shape_place(q: Any, scale: Any, size: Any, shape: str) -> Array:
    """Finds places q (..., 3) along a shape's axes in its texture: (..., 2), 0..1 from the left and the top, and beyond. shape: a name of
    cookies.py's SHAPES."""
    q, scale, size = (np.asarray(v, float) for v in (q, scale, size))
    if shape == "sphere":
        turn, tilt = np.arctan2(q[..., 1], q[..., 0]) / (2 * np.pi), np.arctan2(np.hypot(q[..., 0], q[..., 1]), q[..., 2]) / np.pi
        return np.stack([np.mod(turn, 1) + 0.5 / size[..., 0], (tilt * (size[..., 1] - 1) + 0.5) / size[..., 1]], axis=-1)
    across = q[..., :2] * (1, -1) * scale
    return np.asarray(0.5 + (across if shape == "parallel" else across / np.maximum(q[..., 2:], 1e-9)))


def texels_a_metre(q: Any, scale: Any, size: Any, shape: str) -> Array:
    """Counts the texels of a shape that lie on a metre at places q (..., 3)."""
    texels = (np.asarray(scale, float) * size).max(axis=-1)
    if shape == "sphere":
        return np.zeros(np.shape(q)[:-1])
    return np.asarray(texels + 0 * q[..., 0] if shape == "parallel" else texels / np.maximum(np.asarray(q, float)[..., 2], 1e-9))


def pixel_width(t: Any, frame: Any) -> Array:
    """Measures how wide a pixel is at t of its ray, m. frame: a record of scene.wgsl's Frame."""
    return np.asarray(abs(float(frame["rays"][0])) / float(frame["size"][0]) * np.where(frame["flat"] > 0, 1.0, np.asarray(t, float)))


def shape_index(v: Any, w: Any, light: Any) -> Array:
    """Transforms places (..., 3) (w 1) or steps (w 0) to the axes of a shape. light: a record of scene.wgsl's Light."""
    rows = np.asarray(light["shape_rows"], float)
    return np.asarray(np.asarray(v, float) @ rows[:, :3].T + np.asarray(w, float)[..., None] * rows[:, 3])


def clip_to_planes(ray: Any, range: Any, light: Any) -> Array:
    """Clips ranges (..., 2) of t of rays to where all planes of a light let it be; empty where an end is before its start."""
    within = np.asarray(range, float)
    for plane in np.asarray(light["planes"], float)[: int(light["plane_count"])]:
        at, grows = np.asarray(ray["origin"], float) @ plane[:3] + plane[3], np.asarray(ray["direction"], float) @ plane[:3]
        within = clip_range(within, at, grows)
    return within


def next_whole(b: Any, a: Any, w: Any, t: Any) -> Array:
    """Finds where lines b + t a next meet a whole number, from t on; of quotients, w (..., 2) is the divisor's line. 3e38: nowhere."""
    b, a, w, t = (np.asarray(v, float) for v in (b, a, w, t))
    divisor = w[..., 0] + t * w[..., 1]
    value = (b + t * a) / divisor
    rises = a * divisor > (b + t * a) * w[..., 1]
    whole = np.where(rises, np.floor(value + 1e-3) + 1, np.ceil(value - 1e-3) - 1)
    rate = a - whole * w[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (whole * w[..., 0] - b) / rate
    return np.where((rate != 0) & (found > t), found, 3e38)
