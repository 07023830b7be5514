"""Converts the meshes of a scene to triangles in the world, for `tracer` and `panes`."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.pygfx import SceneLight
from airlight.pygfx.panes import ADDED, OVER, PREMULTIPLIED, is_opaque, is_seen_through, mode_of
from airlight.pygfx.prepass import pattern, shown, solid
from airlight.reference.panes import Pane
from airlight.scenes.gltf.meshes import vertices

Array = npt.NDArray[np.float64]


def world_triangles(scene: Any, lights: Sequence[SceneLight] = (), exclude: Iterable[Any] = ()) -> tuple[Array, Array]:
    """List (N, 3, 3) what the eye sees and (M, 3, 3) what casts shadows, float64, as the scene is now.

    All meshes that hide what is behind them, blended or not, whatever their cast_shadow says; bodies of lights cast none, nor what is in
    `exclude` or below it. pygfx's helpers, points and lines are left out, as is what one sees through: see `world_panes`. Raises
    AirlightError for leaves cut out by a map: the tracer knows triangles only.
    """
    bodies = {id(light.target) for light in lights}
    casters = {id(thing) for thing in shown(scene, exclude)}
    seen, casting = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))]
    for mesh in shown(scene):
        if not isinstance(mesh, gfx.Mesh):
            continue
        if mesh.material.alpha_test > 0 and pattern(mesh, mesh.material):
            which = f"mesh {mesh.name}" if mesh.name else "a mesh without a name"
            raise AirlightError(f"{which}: its map cuts holes, which no triangle has; give its leaves as geometry")
        if not is_opaque(mesh) and not (solid(mesh, mesh.material) and mesh.material.depth_write):
            continue
        found = of_mesh(mesh)
        seen.append(found)
        if id(mesh) in casters and id(mesh) not in bodies and not any(isinstance(child, gfx.Light) for child in mesh.iter()):
            casting.append(found)
    return np.concatenate(seen), np.concatenate(casting)


def world_panes(scene: Any, lights: Sequence[SceneLight] = (), exclude: Iterable[Any] = ()) -> tuple[list[Pane], list[str]]:
    """List what is seen through, as the scene is now, and name what of it no Pane can be: points and lines, what tints what is behind,
    and meshes whose opacity is not the same all over. What only adds light is neither, since the medium's stays as it is."""
    bodies = {id(light.target) for light in lights if light.emitter}
    dimming = {id(thing) for thing in shown(scene, exclude)} - bodies
    found, unknown = [], []
    for thing in shown(scene):
        material = getattr(thing, "material", None)
        if material is None or not is_seen_through(thing) or is_opaque(thing) or mode_of(material.alpha_config) == ADDED:
            continue
        if not isinstance(thing, gfx.Mesh) or mode_of(material.alpha_config) not in (OVER, PREMULTIPLIED) or pattern(thing, material):
            unknown.append(thing.name or type(thing).__name__.lower())
            continue
        alpha = material.opacity * getattr(getattr(material, "color", None), "a", 1.0)
        found.append(Pane(of_mesh(thing), 1 - min(alpha, 1.0), id(thing) in dimming, material.side))
    return found, unknown


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
