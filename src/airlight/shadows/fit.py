"""Fits the views of shadow maps to what casts shadows. NumPy only, float64.

Hulls: (N, 8, 3) corners of boxes, however they lie in the world, that hold what casts shadows.
"""

import math
from typing import Any

import numpy as np

from airlight.projection import Matrix, eye_rays
from airlight.shadows import ShadowView

MARGIN_TEXELS = 1  # from a map's border to what it has to hold
RUNG_RATIO = 2 ** (1 / 8)  # sizes go by such steps, so that what moves at the border does not stir the texels of all else
NEAR_SHARE = 1e-3  # of the distance to the farthest caster: a light's near plane; so the nearest of what the first cascade is made for


def clip(matrix: Matrix, size: int) -> Matrix:
    """Makes (4, 4) to clip space from a view's matrix, for a map of size x size."""
    into = np.array([[2 / size, 0, 0, -1], [0, -2 / size, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    return into @ matrix


def reached(matrix: Matrix, size: int, hulls: Matrix) -> np.ndarray:
    """Selects, (N,) bool, the hulls that may be drawn in a map of size x size; none that is left out is seen in it."""
    at = hulls @ matrix[:, :3].T + matrix[:, 3]
    x, y, z, w = np.moveaxis(at, 2, 0)
    outside = [x < 0, x > size * w, y < 0, y > size * w, z > w]
    return ~np.any([side.all(axis=1) for side in outside], axis=0)


def basis(z: Any) -> Matrix:
    """Makes (3, 3) rows right, up, z: right-handed, turned from +Y to the unit vector z by the shortest turn, so that the roll follows
    steadily; it jumps only where z passes straight down."""
    x, y, z = np.asarray(z, np.float64)
    if 1 + y < 1e-12:
        return np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    a = 1 / (1 + y)
    return np.array([[1 - x * x * a, -x, -x * z * a], [x * z * a, z, z * z * a - 1], [x, y, z]])


def rung(length: float, up: bool = True) -> float:
    """Rounds a length up, or down, to one that is a power of RUNG_RATIO."""
    return float(RUNG_RATIO ** (math.ceil if up else math.floor)(math.log(max(length, 1e-30)) / math.log(RUNG_RATIO)))


def splits(near: float, far: float, count: int, share: float) -> list[float]:
    """Computes the ends of all cascades but the last: `share` of what equal ratios from near to far give, and the rest of even distances.

    Zhang et al. 2006, Parallel-split shadow maps for large-scale virtual environments: the practical split scheme.
    """
    parts = np.arange(1, count) / count
    return (share * near * (far / near) ** parts + (1 - share) * (near + (far - near) * parts)).tolist()  # type: ignore[no-any-return]


def slice_ball(projection: Any, start: float, end: float) -> tuple[Matrix, float]:
    """Computes (centre in view space, radius) of a ball around what a camera sees from one distance along its axis to another; it turns."""
    (a, b, c, d), flat = eye_rays(projection)
    sides = np.array([(a * u + c, b * v + d) for u in (0, 1) for v in (0, 1)])
    if flat:
        centre = np.append(sides.mean(axis=0), -(start + end) / 2)
        return centre, math.hypot(float(np.linalg.norm(sides - centre[:2], axis=1).max()), (end - start) / 2)
    rays = np.column_stack([sides, np.full(4, -1.0)])
    middle = rays.mean(axis=0)
    centre = middle * min(end, float(((start + end) / 2 * (rays**2).sum(axis=1) / (rays @ middle)).max()))
    return centre, float(np.linalg.norm(np.concatenate([start * rays, end * rays]) - centre, axis=1).max())


def orthographic_view(axes: Matrix, centre: Matrix, half: float, size: int, local: Matrix, span: tuple[float, float]) -> ShadowView:
    """Fits a view along the light's third axis. centre, local: in the light's axes; half: metres around the centre that the map holds."""
    texel = 2 * half / (size - 2 * MARGIN_TEXELS - 1)
    left, top = math.floor(centre[0] / texel - size / 2 + 0.5), math.floor(centre[1] / texel + size / 2 + 0.5)
    x, y, height = np.moveaxis(local, 2, 0)
    beside = (x.max(axis=1) < left * texel) | (x.min(axis=1) > (left + size) * texel)
    beside |= (y.max(axis=1) < (top - size) * texel) | (y.min(axis=1) > top * texel)
    casting = height if beside.all() else height[~beside]
    bottom, above = float(casting.min()), float(casting.max())
    pad = 1e-3 * (above - bottom) + 1e-3 * texel  # no caster has depth 0
    bottom, deep = bottom - pad, above - bottom + 2 * pad
    matrix = np.zeros((4, 4))
    matrix[0, :3], matrix[0, 3] = axes[0] / texel, -left
    matrix[1, :3], matrix[1, 3] = -axes[1] / texel, top
    matrix[2, :3], matrix[2, 3] = axes[2] / deep, -bottom / deep
    matrix[3, 3] = 1
    return ShadowView(matrix, span, texel, deep)


def ball(hulls: Matrix) -> tuple[Matrix, float]:
    """Computes (centre, radius) of a ball around all hulls, about the middle of their extent; radius 0 where there are none."""
    if not len(hulls):
        return np.zeros(3), 0.0
    centre = (hulls.min(axis=(0, 1)) + hulls.max(axis=(0, 1))) / 2
    return centre, float(np.linalg.norm(hulls - centre, axis=2).max())


def near_plane(position: Matrix, near: float, hulls: Matrix, cosine: float) -> float:
    """Chooses the distance along a view's axis at which the map of a light at (3,) begins: near, or, where that is 0, NEAR_SHARE of the
    distance to the farthest caster, but before each hull that the light is not in. cosine: of the angle between the axis and the map's
    corners."""
    if near > 0 or not len(hulls):
        return near or 0.01
    far = float(np.linalg.norm(hulls - position, axis=2).max())
    off = np.linalg.norm(np.maximum(np.maximum(hulls.min(axis=1) - position, position - hulls.max(axis=1)), 0), axis=1)
    off = off[off > 1e-6 * far]
    return max(min(far * NEAR_SHARE, 0.99 * cosine * float(off.min(initial=np.inf))), 1e-9)


def perspective_view(
    position: Matrix, near: float, hulls: Matrix, size: int, ahead: Any, half: float | tuple[float, float], across: Any = None
) -> ShadowView:
    """Fits a view from a light at (3,) along `ahead`. near: see `near_plane`; half: tangents of the half angles, sidewards and upwards, or
    of both, that the map holds within its margin; across: (2, 3) its axes right and up."""
    right, up = basis(np.negative(ahead))[:2] if across is None else across
    wide, high = half if isinstance(half, tuple) else (half, half)
    across_scale, up_scale = ((size / 2 - MARGIN_TEXELS) / one for one in (wide, high))
    border = size / (size - 2 * MARGIN_TEXELS)
    near = near_plane(position, near, hulls, 1 / math.sqrt(1 + (wide * border) ** 2 + (high * border) ** 2))
    middle = size / 2 * np.asarray(ahead)
    matrix = np.zeros((4, 4))
    matrix[0, :3], matrix[1, :3] = across_scale * right + middle, -up_scale * up + middle
    matrix[3, :3] = ahead
    matrix[:, 3] = -matrix[:, :3] @ position
    matrix[2, 3] = near
    return ShadowView(matrix, texel=1 / min(across_scale, up_scale), depth_scale=near)


def held_half(local: Matrix, box: tuple[Matrix, float]) -> tuple[Matrix, float]:
    """Chooses (centre, half side) of a square, in a directional light's axes, that holds hulls in these axes, (N, 8, 3), or, where that is
    smaller, a square that a user has set for them: (centre, half side)."""
    low, high = local.min(axis=(0, 1)), local.max(axis=(0, 1))
    half = rung(float((high - low)[:2].max()) / 2)
    return ((low + high) / 2, half) if half <= box[1] else box


def with_border(matrix: Matrix, size: int, texels: float) -> Matrix:
    """Shrinks what a view of a light with a position draws, (4, 4), about the middle of its map, so that so many texels around it hold
    what lies beside: filters near its border read these."""
    middle = np.array([[1, 0, 0, size / 2], [0, 1, 0, size / 2], [0, 0, 1, 0], [0, 0, 0, 1]])
    share = (size - 2 * texels) / (size - 2 * MARGIN_TEXELS)
    return np.asarray(middle @ np.diag([share, share, 1, 1]) @ np.linalg.inv(middle) @ matrix)
