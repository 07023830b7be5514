"""Boxes around the meshes of a scene, where instances, bones and morph targets put them."""

import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.projection import Matrix
from airlight.pygfx import private

CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def corners(boxes: Matrix, matrices: Matrix) -> Matrix:
    """(N, 8, 3) of boxes (N, 2, 3), least and greatest, that matrices (N, 4, 4) place."""
    low, high = boxes[:, None, 0], boxes[:, None, 1]
    return np.asarray((low + CORNERS * (high - low)) @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3])


def extent(points: Matrix) -> Matrix:
    """(2, 3) the box of points (..., 3), but for NaNs, which leave holes in a mesh."""
    points = points.reshape(-1, 3)
    return np.stack([np.fmin.reduce(points), np.fmax.reduce(points)]).astype(np.float64)


@dataclass
class _Shape:
    """Keeps what is known of a geometry while its buffers stay as they are."""

    key: tuple[Any, ...]
    box: Matrix
    morphs: Matrix  # (K, 2, 3) of the targets
    bones: np.ndarray  # those that move a vertex,
    moved: Matrix  # and (J, 2, 3) the boxes of the vertices that each one moves


class Bounds:
    """Boxes of meshes, made anew where a buffer has changed."""

    def __init__(self) -> None:
        self._shapes: Any = weakref.WeakKeyDictionary()
        self._instances: Any = weakref.WeakKeyDictionary()

    def hulls(self, meshes: list[Any]) -> Matrix:
        """(N, 8, 3): corners, in the world, of boxes that hold the meshes as they are now."""
        if not meshes:
            return np.zeros((0, 8, 3))
        boxes, matrices = zip(*(self._placed(mesh) for mesh in meshes))
        return corners(np.stack(boxes), np.stack(matrices))

    def _placed(self, mesh: Any) -> tuple[Matrix, Matrix]:
        shape = self._shape(mesh.geometry)
        matrix = np.asarray(mesh.world.matrix, np.float64)
        shares = private.influences(mesh)
        box, moved = shape.box, shape.moved
        if shares is not None and len(shape.morphs):
            own, added = float(shares[-1]), np.asarray(shares[:-1], np.float64)[:, None, None] * shape.morphs
            by = np.stack([added.min(axis=1).sum(axis=0), added.max(axis=1).sum(axis=0)])
            box, moved = np.sort(own * box, axis=0) + by, np.sort(own * moved, axis=1) + by
        if isinstance(mesh, gfx.SkinnedMesh) and len(shape.bones):
            skeleton = mesh.skeleton
            joints = np.stack([skeleton.bones[i].world.matrix @ skeleton.bone_inverses[i] for i in shape.bones])
            box = extent(corners(moved, matrix @ mesh.effective_bind_matrix_inv @ joints @ mesh.bind_matrix))
            return box, np.eye(4)
        if isinstance(mesh, gfx.InstancedMesh):
            box = self._all(mesh, box)
        return box, matrix

    def _all(self, mesh: Any, box: Matrix) -> Matrix:
        """(2, 3) of all instances, in the mesh's space."""
        key = mesh.instance_buffer.rev, box.tobytes()
        known = self._instances.get(mesh)
        if known is None or known[0] != key:
            matrices = np.asarray(mesh.instance_buffer.data["matrix"], np.float64).transpose(0, 2, 1)
            known = key, extent(corners(np.broadcast_to(box, (len(matrices), 2, 3)), matrices)) if len(matrices) else box
            self._instances[mesh] = known
        return known[1]

    def _shape(self, geometry: Any) -> _Shape:
        buffers: list[Any] = [getattr(geometry, name, None) for name in ("positions", "skin_indices", "skin_weights")]
        targets = getattr(geometry, "morph_positions", None) or ()
        key = (*(None if buffer is None else buffer.rev for buffer in buffers), *map(id, targets))
        shape: _Shape | None = self._shapes.get(geometry)
        if shape is None or shape.key != key:
            assert buffers[0] is not None
            points = _with_gaps(buffers[0].data)
            morphs = np.stack([extent(_with_gaps(target)) for target in targets]) if targets else np.zeros((0, 2, 3))
            bones, moved = np.zeros(0, int), np.zeros((0, 2, 3))
            if buffers[1] is not None and buffers[2] is not None:
                bones, moved = _by_bones(points, np.asarray(buffers[1].data), np.asarray(buffers[2].data))
            shape = self._shapes[geometry] = _Shape(key, extent(points), morphs, bones, moved)
        return shape


def _with_gaps(points: Any) -> np.ndarray:
    """Drop what is nowhere: (N, 3) of points (N, 3) or more, NaN in its place."""
    points = np.asarray(points)[:, :3]
    return np.where(np.isfinite(points).all(axis=1, keepdims=True), points, np.nan)


def _by_bones(points: np.ndarray, indices: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, Matrix]:
    """Find the bones that have a share in a vertex, and the box of each one's vertices: a vertex lies in the hull of places that each of
    its bones alone would give it."""
    low, high = np.full((int(indices.max()) + 1, 3), np.inf), np.full((int(indices.max()) + 1, 3), -np.inf)
    for i in range(indices.shape[1]):
        held = weights[:, i] > 0
        np.fmin.at(low, indices[held, i], points[held])
        np.fmax.at(high, indices[held, i], points[held])
    bones = np.flatnonzero(np.isfinite(low[:, 0]))
    return bones, np.stack([low[bones], high[bones]], axis=1)
