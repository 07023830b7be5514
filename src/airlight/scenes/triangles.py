"""Converts the meshes of a scene to triangles in the world, for `tracer`."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.pygfx import SceneLight
from airlight.pygfx.prepass import pattern, shown, solid
from airlight.scenes.gltf.meshes import vertices

Array = npt.NDArray[np.float64]


def world_triangles(scene: Any, lights: Sequence[SceneLight] = (), exclude: Iterable[Any] = ()) -> tuple[Array, Array]:
    """List (N, 3, 3) what the eye sees and (M, 3, 3) what casts shadows, float64, as the scene is now.

    All meshes that hide what is behind them, whatever their cast_shadow says; bodies of lights cast none, nor what is in `exclude` or
    below it. pygfx's helpers, points and lines are left out, as is what one sees through. Raises AirlightError for leaves cut out by a
    map: the tracer knows triangles only.
    """
    bodies = {id(light.target) for light in lights}
    casters = {id(thing) for thing in shown(scene, exclude)}
    seen, casting = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))]
    for mesh in shown(scene):
        if not isinstance(mesh, gfx.Mesh):
            continue
        if mesh.material.alpha_test > 0 and pattern(mesh, mesh.material):
            raise AirlightError(f"mesh {mesh.name or '?'}: its map cuts holes, which no triangle has; give its leaves as geometry")
        if not solid(mesh, mesh.material) or not mesh.material.depth_write:
            continue
        found = of_mesh(mesh)
        seen.append(found)
        if id(mesh) in casters and id(mesh) not in bodies and not any(isinstance(child, gfx.Light) for child in mesh.iter()):
            casting.append(found)
    return np.concatenate(seen), np.concatenate(casting)


def of_mesh(mesh: Any) -> Array:
    """List the triangles (N, 3, 3) of a mesh, its instances, skin and morph targets, world coordinates."""
    faces = np.asarray(mesh.geometry.indices.data, np.int64)
    if faces.shape[1] == 4:
        faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    if not isinstance(mesh, gfx.InstancedMesh):
        return np.asarray(vertices(mesh)[faces])
    points, world = np.asarray(mesh.geometry.positions.data, np.float64), mesh.world.matrix
    matrices = world @ np.asarray(mesh.instance_buffer.data["matrix"], np.float64).transpose(0, 2, 1)
    placed = points @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]
    return np.asarray(placed[:, faces].reshape(-1, 3, 3))
