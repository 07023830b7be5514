"""Shapes of lights in float64: twins of scatter/march/shape.wgsl."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.march import clip_range

Array = npt.NDArray[Any]


def sphere_place(q: Any, size: Any) -> Array:
    """Finds directions q (..., 3) along a shape's axes in a table of all: (..., 2), 0..1 from the left and the top, and beyond."""
    q, size = np.asarray(q, float), np.asarray(size, float)
    turn, tilt = np.arctan2(q[..., 1], q[..., 0]) / (2 * np.pi), np.arctan2(np.hypot(q[..., 0], q[..., 1]), q[..., 2]) / np.pi
    return np.stack([np.mod(turn, 1) + 0.5 / size[..., 0], (tilt * (size[..., 1] - 1) + 0.5) / size[..., 1]], axis=-1)


def cookie_place(q: Any, light: Any, parallel: bool) -> Array:
    """Finds places q (..., 3) of shape_index in a cookie: (..., 3) texels from the left and the top, and how many lie on a metre."""
    q, size, most = np.asarray(q, float), np.asarray(light["shape_size"], float), float(light["shape_most"])
    if parallel:
        return np.concatenate([np.mod(q[..., :2], size), np.full((*q.shape[:-1], 1), most)], axis=-1)
    return np.concatenate([q[..., :2], np.full((*q.shape[:-1], 1), most)], axis=-1) / np.maximum(q[..., 2:], 1e-9)


def level_of(texels: Any, last: Any) -> Array:
    """Chooses levels of a cookie whose texels are so many of level 0 wide, or less: (..., 2) 2^-level and the level, up to the last."""
    level = np.clip(np.frexp(np.asarray(texels, float))[1] - 1, 0, np.asarray(last))
    return np.stack([0.5**level, level], axis=-1)


def level_corner(level: Any, size: Any) -> Array:
    """Finds (..., 2) where levels (..., 2), as level_of has them, of a cookie of so many texels (..., 2) begin in its texture."""
    level, size = np.asarray(level, float), np.asarray(size, float)
    down = np.floor(size[..., 1] * (1 - 2 * level[..., 0])) + 4 * level[..., 1] - 3
    return np.stack([np.where(level[..., 1] == 0, 1, size[..., 0] + 3), np.maximum(down, 1)], axis=-1)


def pixel_width(frame: Any) -> Array:
    """Measures (2,) how wide a pixel is at a ray's origin, m, and how much wider a metre further. frame: a record of scene.wgsl's Frame."""
    flat = float(frame["flat"])
    return abs(float(frame["rays"][0])) / float(frame["size"][0]) * np.array([flat, 1 - flat])


def shape_index(v: Any, w: Any, light: Any) -> Array:
    """Transforms places (..., 3) (w 1) or steps (w 0) to a shape: m along its axes, of a cookie texels in x and y. light: a record of
    scene.wgsl's Light."""
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
