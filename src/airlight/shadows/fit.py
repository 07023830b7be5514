"""Where shadow maps lie and what they hold: the views of suns, spots and points. NumPy only, float64.

Hulls: (N, 8, 3) corners of boxes, however they lie in the world, that hold what casts shadows.
"""

import math
from typing import Any

import numpy as np

from airlight.lamps import Lamp
from airlight.medium import Settled
from airlight.projection import Matrix, eye_rays
from airlight.shadows import View

MARGIN = 1  # texels from a map's border to what it has to hold
RUNG = 2 ** (1 / 8)  # sizes go by such steps, so that what moves at the border does not stir the texels of all else
NEAR = 1e-3  # a lamp's near plane, as a part of the way to the farthest caster; so the nearest of what the first cascade is made for
WIDEST = math.radians(89.0)  # half angle of a spot's map


def views(lamp: Lamp, view: Any, projection: Any, hulls: Matrix, air: Settled) -> list[View]:
    """The views of a lamp's shadow map, for a camera with matrices view (world to view space) and projection (to clip space)."""
    if lamp.is_sun:
        return sun(lamp, view, projection, hulls, air)
    return [spot(lamp, hulls, air.shadow_size)] if lamp.kind == "spot" else point(lamp, hulls, air.shadow_size)


def layers(lamp: Lamp, air: Settled) -> int:
    """As many as a lamp's views can be."""
    return air.march.cascades if lamp.is_sun else 1 if lamp.kind == "spot" else 6


def clip(matrix: Matrix, size: int) -> Matrix:
    """(4, 4) to clip space from a view's matrix, for a map of size x size."""
    into = np.array([[2 / size, 0, 0, -1], [0, -2 / size, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    return into @ matrix


def reached(matrix: Matrix, size: int, hulls: Matrix) -> np.ndarray:
    """(N,) bool: which hulls may be drawn in a map of size x size; none that is left out is seen in it."""
    at = hulls @ matrix[:, :3].T + matrix[:, 3]
    x, y, z, w = np.moveaxis(at, 2, 0)
    outside = [x < 0, x > size * w, y < 0, y > size * w, z > w]
    return ~np.any([side.all(axis=1) for side in outside], axis=0)


def basis(z: Any) -> Matrix:
    """(3, 3) rows right, up, z: right-handed, turned from +Y to the unit vector z by the shortest way, so that the roll follows steadily;
    it jumps only where z passes straight down."""
    x, y, z = np.asarray(z, np.float64)
    if 1 + y < 1e-12:
        return np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    a = 1 / (1 + y)
    return np.array([[1 - x * x * a, -x, -x * z * a], [x * z * a, z, z * z * a - 1], [x, y, z]])


def _rung(length: float, up: bool = True) -> float:
    """The next length up or down that is a power of RUNG."""
    return float(RUNG ** (math.ceil if up else math.floor)(math.log(max(length, 1e-30)) / math.log(RUNG)))


def splits(near: float, far: float, count: int, share: float) -> list[float]:
    """Ends of all cascades but the last: `share` of what equal ratios from near to far give, and the rest of even distances.

    Zhang et al. 2006, Parallel-split shadow maps for large-scale virtual environments: the practical split scheme.
    """
    parts = np.arange(1, count) / count
    return (share * near * (far / near) ** parts + (1 - share) * (near + (far - near) * parts)).tolist()  # type: ignore[no-any-return]


def slice_ball(projection: Any, start: float, end: float) -> tuple[Matrix, float]:
    """(centre in view space, radius) of a ball around what a camera sees between two distances along its axis; it turns with it."""
    (a, b, c, d), flat = eye_rays(projection)
    sides = np.array([(a * u + c, b * v + d) for u in (0, 1) for v in (0, 1)])
    if flat:
        centre = np.append(sides.mean(axis=0), -(start + end) / 2)
        return centre, math.hypot(float(np.linalg.norm(sides - centre[:2], axis=1).max()), (end - start) / 2)
    rays = np.column_stack([sides, np.full(4, -1.0)])
    middle = rays.mean(axis=0)
    centre = middle * min(end, float(((start + end) / 2 * (rays**2).sum(axis=1) / (rays @ middle)).max()))
    return centre, float(np.linalg.norm(np.concatenate([start * rays, end * rays]) - centre, axis=1).max())


def sun(lamp: Lamp, view: Any, projection: Any, hulls: Matrix, air: Settled) -> list[View]:
    """Cascades, near to far: each holds a ball around its slice of what is seen, or, where that is larger, all casters.

    Balls and casters are held by whole texels of a lattice that is fixed in the world, so that edges do not swim as a camera moves.
    Where one map holds all casters it is the last one. Beyond a map everything is lit, since nothing casts there.
    """
    axes, size, march = basis(lamp.direction), air.shadow_size, air.march
    into = np.linalg.inv(np.asarray(view, np.float64))
    if not len(hulls):
        hulls = into[:3, 3] + np.zeros((1, 8, 3))
    local = hulls @ axes.T
    low, high = local.min(axis=(0, 1)), local.max(axis=(0, 1))
    half = _rung(float((high - low)[:2].max()) / 2)
    centre, radius = ball(hulls)
    away = float(np.linalg.norm(centre - into[:3, 3]))
    far = min(air.max_distance, _rung(away + radius))
    near = max(_rung(away - radius, up=False), far * NEAR)
    ends = splits(near if near < far else far * NEAR, far, march.cascades, march.cascade_split)
    out: list[View] = []
    start = before = 0.0
    for end in [*ends, np.inf]:
        at, reach = slice_ball(projection, before, min(end, air.max_distance))
        if half <= reach:
            return [*out, _sun_view(axes, (low + high) / 2, half, size, local, (start, np.inf))]
        out.append(_sun_view(axes, axes @ (into @ np.append(at, 1.0))[:3], reach, size, local, (start, float(end))))
        before = end - march.cascade_blend * (end - start)
        start = end
    return out


def _sun_view(axes: Matrix, centre: Matrix, half: float, size: int, local: Matrix, span: tuple[float, float]) -> View:
    """centre, local: in the light's axes; half: metres around the centre that the map holds."""
    texel = 2 * half / (size - 2 * MARGIN - 1)
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
    return View(matrix, span, texel, deep)


def ball(hulls: Matrix) -> tuple[Matrix, float]:
    """(centre, radius) of a ball around all hulls, about the middle of their extent; radius 0 where there are none."""
    if not len(hulls):
        return np.zeros(3), 0.0
    centre = (hulls.min(axis=(0, 1)) + hulls.max(axis=(0, 1))) / 2
    return centre, float(np.linalg.norm(hulls - centre, axis=2).max())


def near_plane(lamp: Lamp, hulls: Matrix, cosine: float) -> float:
    """The distance along a view's axis at which a lamp's map begins: the lamp's own, or NEAR of the way to the farthest caster, but
    before each hull that the lamp is not in. cosine: of the angle between the axis and the map's corners."""
    if lamp.near > 0 or not len(hulls):
        return lamp.near or 0.01
    place = np.array(lamp.position)
    far = float(np.linalg.norm(hulls - place, axis=2).max())
    off = np.linalg.norm(np.maximum(np.maximum(hulls.min(axis=1) - place, place - hulls.max(axis=1)), 0), axis=1)
    off = off[off > 1e-6 * far]
    return max(min(far * NEAR, 0.99 * cosine * float(off.min(initial=np.inf))), 1e-9)


def _lamp_view(lamp: Lamp, hulls: Matrix, size: int, ahead: Any, half: float) -> View:
    """ahead: the view's axis; half: tangent of the half angle, upwards and sidewards, that the map holds within its margin."""
    right, up, _ = basis(np.negative(ahead))
    scale = (size / 2 - MARGIN) / half
    border = half * size / (size - 2 * MARGIN)
    near = near_plane(lamp, hulls, 1 / math.sqrt(1 + 2 * border**2))
    matrix = np.zeros((4, 4))
    matrix[0, :3], matrix[1, :3] = scale * right + size / 2 * np.asarray(ahead), -scale * up + size / 2 * np.asarray(ahead)
    matrix[3, :3] = ahead
    matrix[:, 3] = -matrix[:, :3] @ np.array(lamp.position)
    matrix[2, 3] = near
    return View(matrix, texel=1 / scale, depth_scale=near)


def spot(lamp: Lamp, hulls: Matrix, size: int) -> View:
    """The view that just holds a spot's cone; of wider ones than WIDEST as much as that."""
    return _lamp_view(lamp, hulls, size, lamp.direction, math.tan(min(lamp.outer, WIDEST)))


def point(lamp: Lamp, hulls: Matrix, size: int) -> list[View]:
    """Six views, along +X, -X, +Y, -Y, +Z, -Z of the world, each of 90 degrees and a margin of MARGIN texels around it.

    A place belongs to the view with the greatest w, which is its distance along the view's axis: the dominant of its coordinates.
    """
    return [_lamp_view(lamp, hulls, size, sign * axis, 1.0) for axis in np.eye(3) for sign in (1, -1)]
