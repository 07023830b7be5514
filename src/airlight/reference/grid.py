"""Evaluates the functions of medium/grid.wgsl, and of light tables in scatter/march/shade.wgsl, in float64, each under its shader's name.

Arrays broadcast; vectors lie along the last axis. rows: (..., 3, 4) of a matrix from places to indices; count: voxels along x, y, z.
light: a record as the shaders have it, scatter.march.records.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]
PLANE_SLACK = 2e-3  # voxels
BLENDS = (np.add, np.multiply, lambda before, found: found + 0 * before, np.minimum, np.maximum)  # in the order of medium.field.BLENDS


def grid_index(rows: Any, place: Any) -> Array:
    """Finds (..., 3) the indices of places (..., 3)."""
    return np.einsum("...ij,...j->...i", np.asarray(rows, float)[..., :3], np.asarray(place, float)) + np.asarray(rows, float)[..., 3]


def grid_step(rows: Any, step: Any) -> Array:
    """Finds (..., 3) the steps between indices, of steps (..., 3) between places."""
    return np.asarray(np.einsum("...ij,...j->...i", np.asarray(rows, float)[..., :3], np.asarray(step, float)))


def in_grid_box(at: Any, count: Any, edge: Any) -> npt.NDArray[np.bool_]:
    """Tests whether indices (..., 3) lie in a grid's box."""
    edge = np.asarray(edge, float)[..., None]
    return np.asarray(np.all((at >= -edge) & (at <= np.asarray(count) - 1 + edge), axis=-1))


def clip_to_grid(b: Any, a: Any, range: Any, count: Any, edge: Any) -> Array:
    """Clips ranges (..., 2) of t of the indices b + t a to a grid's box; empty where the end is not behind the start."""
    edge = np.asarray(edge, float)[..., None]
    return clip_to_slabs(b, a, range, -edge, np.asarray(count) - 1 + edge)


def clip_to_slabs(b: Any, a: Any, range: Any, bottom: Any, top: Any) -> Array:
    """Clips ranges (..., 2) of t to where b + t a lies from `bottom` to `top` (..., 3); empty where the end is not behind the start."""
    b, a = np.asarray(b, float), np.asarray(a, float)
    flat = np.abs(a) < 1e-12
    slope = np.where(flat, 1, a)
    low, high = (bottom - b) / slope, (top - b) / slope
    inside = (b >= bottom) & (b <= top)
    first = np.where(flat, np.where(inside, -3e38, 3e38), np.minimum(low, high)).max(axis=-1)
    last = np.where(flat, np.where(inside, 3e38, -3e38), np.maximum(low, high)).min(axis=-1)
    return np.stack([np.maximum(range[..., 0], first), np.minimum(range[..., 1], last)], axis=-1)


def to_next_plane(b: Any, a: Any) -> Array:
    """Finds (...) how far along a (..., 3), from indices b (..., 3), the next planes through voxels' centres are."""
    b, a = np.asarray(b, float), np.asarray(a, float)
    ahead = np.where(a > 0, np.floor(b + PLANE_SLACK) + 1 - b, b - np.ceil(b - PLANE_SLACK) + 1)
    return np.asarray((ahead / np.maximum(np.abs(a), 1e-12)).min(axis=-1))


def blended(before: Any, found: Any, blend: Any) -> Array:
    """Joins (...) a grid's densities with what lies there. blend: index in medium.field.BLENDS."""
    return np.select([np.asarray(blend) == i for i in range(5)], [join(before, found) for join in BLENDS])


def table_face(q: Any) -> Array:
    """Chooses the faces of a cube that directions (..., 3) meet: (..., 3) coordinates there, and the faces' numbers."""
    q = np.asarray(q, float)
    x, y, z = np.abs(q[..., 0]), np.abs(q[..., 1]), np.abs(q[..., 2])
    axis = np.where(z >= np.maximum(x, y), 2, np.where(x >= y, 0, 1))
    ahead = np.take_along_axis(q, axis[..., None], -1)[..., 0]
    across = np.stack([np.take_along_axis(q, ((axis + k) % 3)[..., None], -1)[..., 0] for k in (1, 2)], axis=-1)
    face = np.choose(axis, [2, 4, 0]) + (ahead <= 0)
    return np.concatenate([across / np.abs(ahead)[..., None], face[..., None]], axis=-1)


def from_table_face(at: Any, face: Any) -> Array:
    """Gives (..., 3) the directions from coordinates (..., 2) on faces of a cube."""
    at, face = np.asarray(at, float), np.asarray(face, int)
    away, axis = np.where(face % 2 == 1, -1.0, 1.0), np.choose(face // 2, [2, 0, 1])
    out = np.zeros((*np.broadcast_shapes(at.shape[:-1], face.shape), 3))
    for k, value in enumerate((away, at[..., 0], at[..., 1])):
        where, what = (np.broadcast_to(v, out.shape[:-1])[..., None] for v in ((axis + k) % 3, value))
        np.put_along_axis(out, where, what, -1)
    return out


def shade_cell(q: Any, light: Any, directional: bool) -> Array:
    """Finds places, which a light's shade_rows have led to q (..., 3), in its table: (..., 4) their indices, and the faces, -1 where it
    holds nothing."""
    q, count = np.asarray(q, float), np.asarray(light["shade_count"], float)
    at, face = q, np.zeros(q.shape[:-1])
    if not directional:
        seen = np.concatenate([q[..., :2] / np.maximum(q[..., 2:], 1e-9), np.zeros((*q.shape[:-1], 1))], axis=-1)
        if light["shade_faces"] > 1:
            seen = table_face(q)
        else:
            seen[..., 0] = np.where(q[..., 2] <= 0, 3e38, seen[..., 0])
        deep = (np.linalg.norm(q, axis=-1) - light["shade_near"]) / light["shade_step"]
        at = np.concatenate([(count[:2] - 1) / 2 * (seen[..., :2] / light["shade_tangent"] + 1), deep[..., None]], axis=-1)
        face = seen[..., 2]
    slack = 1e-3 if light["shade_faces"] > 1 else 0.0
    within = np.all((at[..., :2] >= -slack) & (at[..., :2] <= count[:2] - 1 + slack), axis=-1) & (at[..., 2] > 0)
    return np.concatenate([at, np.where(within, face, -1)[..., None]], axis=-1)


def column_place(column: Any, k: Any, light: Any, directional: bool) -> Array:
    """Places (..., 3) the k-th values of columns (..., 3) of a light's table: coordinates across, and the face."""
    column, k = np.asarray(column), np.asarray(k, float)
    if directional:
        return grid_index(light["shade_into"], np.concatenate([column[..., :2], k[..., None]], axis=-1))
    on_face = (2 * column[..., :2] / (np.asarray(light["shade_count"], float)[:2] - 1) - 1) * light["shade_tangent"]
    away = from_table_face(on_face, column[..., 2])
    away = away / np.linalg.norm(away, axis=-1, keepdims=True)
    return grid_index(light["shade_into"], away * (light["shade_near"] + k * light["shade_step"])[..., None])
