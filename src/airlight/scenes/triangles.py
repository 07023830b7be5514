"""Converts the meshes of a scene to triangles in the world, for `tracer` and `panes`."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pygfx as gfx

from airlight.colour import srgb_decode
from airlight.errors import AirlightError
from airlight.pygfx import SceneLight
from airlight.pygfx.glass_maps import DIMMING
from airlight.pygfx.panes import ADDED, DARKEN, TINT, is_opaque, is_seen_through, mode_of
from airlight.pygfx.prepass import pattern, shown, solid
from airlight.reference.panes import Pane
from airlight.scenes.gltf.meshes import vertices

Array = npt.NDArray[np.float64]
MOST_FACES = 20_000  # of a mesh whose map is looked at triangle by triangle


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
        if mesh.material.alpha_test > 0 and pattern(mesh, mesh.material) and not is_seen_through(mesh):
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
    """List what is seen through, as the scene is now, and name what of it no Pane can be: points and lines, and meshes of which a map or
    vertex colours make a triangle pass one light here and another there. What only adds light is neither, since the medium's stays.
    """
    bodies = {id(light.target) for light in lights if light.emitter}
    dimming = {id(thing) for thing in shown(scene, exclude)} - bodies
    found, unknown = [], []
    for thing in shown(scene):
        material = getattr(thing, "material", None)
        if material is None or not is_seen_through(thing) or is_opaque(thing) or mode_of(material.alpha_config) == ADDED:
            continue
        known = isinstance(thing, gfx.Mesh) and mode_of(material.alpha_config) in DIMMING
        passed = _passed(thing) if known else None
        if passed is None:
            unknown.append(thing.name or type(thing).__name__.lower())
            continue
        triangles = of_mesh(thing).reshape(-1, len(passed), 3, 3)  # of each instance
        for value in np.unique(passed, axis=0):
            if (value < 1).any():
                some = triangles[:, (passed == value).all(axis=1)].reshape(-1, 3, 3)
                share = float(value[0]) if (value == value[0]).all() else value
                found.append(Pane(some, share, id(thing) in dimming, material.side))
    return found, unknown


def _passed(mesh: Any) -> Array | None:
    """Finds (F, 3) what each triangle of a mesh lets through; None where it is not the same all over one of them."""
    material, mode = mesh.material, mode_of(mesh.material.alpha_config)
    color = getattr(material, "color", gfx.Color("#fff"))
    values = np.array([[*color.to_physical()[:3], color.a * material.opacity]]) if material.color_mode in ("auto", "uniform") else None
    count = len(_faces(mesh))
    if pattern(mesh, material):
        texels = _texels(mesh)
        colors = getattr(mesh.geometry, "colors", None)
        if values is None or texels is None or colors is not None:
            return None
        values = values * texels
    if values is None:
        return None
    values = np.broadcast_to(values, (count, 4))
    passed = values[:, :3] if mode == TINT else 1 - values[:, :3] if mode == DARKEN else np.repeat(1 - values[:, 3:], 3, axis=1)
    if material.alpha_test > 0:
        cut = values[:, 3] >= material.alpha_test if material.alpha_compare == ">=" else values[:, 3] < material.alpha_test
        passed = np.where(cut[:, None], 1.0, passed)
    return np.asarray(np.clip(passed, 0, 1).round(6))


def _texels(mesh: Any) -> Array | None:
    """Reads (F, 4), linear, what a mesh's map holds on each triangle, (1, 4) without one; None where it is not the same all over one."""
    map = mesh.material.map if mesh.material.color_mode == "auto" else None
    if map is None:
        return np.ones((1, 4))
    data, faces = map.texture.data, _faces(mesh)
    uv = getattr(mesh.geometry, f"texcoords{map.uv_channel or ''}", None)
    if data is None or data.dtype != np.uint8 or data.ndim != 3 or data.shape[2] not in (3, 4) or uv is None or len(faces) > MOST_FACES:
        return None
    height, width = data.shape[:2]
    turned = np.column_stack([uv.data[:, :2], np.ones(len(uv.data))]) @ map.uniform_buffer.data["transform"][:, :3].astype(float)
    corners = turned[faces][..., :2] * (width, height)
    reach = 0.0 if (map.mag_filter, map.min_filter) == ("nearest", "nearest") else 0.5
    low, high = np.floor(corners.min(axis=1) - reach + 1e-3).astype(int), np.ceil(corners.max(axis=1) + reach - 1e-3).astype(int)
    found = np.zeros((len(faces), data.shape[2]), np.uint8)
    for i, ((x0, y0), (x1, y1)) in enumerate(zip(low, np.maximum(high, low + 1), strict=True)):
        x, y = _wrapped(np.arange(x0, x1), width, map.wrap_s), _wrapped(np.arange(y0, y1), height, map.wrap_t)
        held = data[y[:, None], x].reshape(-1, data.shape[2])
        if (held != held[0]).any():
            return None
        found[i] = held[0]
    linear = found / 255.0
    if map.texture.colorspace == "srgb":
        linear[:, :3] = srgb_decode(linear[:, :3])
    return linear if linear.shape[1] == 4 else np.column_stack([linear, np.ones(len(linear))])


def _wrapped(i: Array, count: int, way: str) -> Array:
    if way.startswith("clamp"):
        return np.clip(i, 0, count - 1)
    if way.startswith("mirror"):
        return np.asarray(np.minimum(i % (2 * count), 2 * count - 1 - i % (2 * count)))
    return i % count


def _faces(mesh: Any) -> npt.NDArray[np.int64]:
    faces = np.asarray(mesh.geometry.indices.data, np.int64)
    return np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]]) if faces.shape[1] == 4 else faces


def of_mesh(mesh: Any) -> Array:
    """List the triangles (N, 3, 3) of a mesh, its instances, skin and morph targets, world coordinates."""
    faces = _faces(mesh)
    if not isinstance(mesh, gfx.InstancedMesh):
        return np.asarray(vertices(mesh)[faces])
    points, world = np.asarray(mesh.geometry.positions.data, np.float64), mesh.world.matrix
    matrices = world @ np.asarray(mesh.instance_buffer.data["matrix"], np.float64).transpose(0, 2, 1)
    placed = points @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]
    return np.asarray(placed[:, faces].reshape(-1, 3, 3))
