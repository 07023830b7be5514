"""Load a stage from a file of meshes: .obj, .ply or .stl."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pygfx as gfx
import trimesh
from trimesh.geometry import triangulate_quads

from airlight.colour import srgb_decode
from airlight.errors import AirlightError, warn
from airlight.messages import counted
from airlight.scenes.gltf import MAX_EXTENT, MAX_VERTICES, schema
from airlight.scenes.gltf.load import stage_of
from airlight.scenes.gltf.meshes import complete, turned_out
from airlight.scenes.gltf.opacity import layers
from airlight.scenes.meshfiles.materials import Library
from airlight.scenes.meshfiles.read import finite_faces, read
from airlight.scenes.origin import recentred
from airlight.scenes.stage import Stage

UP = {"obj": "y", "ply": "y", "stl": "z"}  # which axis points up, unless it is said
POINT_SIZE = 2  # logical px


def load(path: str, environment: str | None = None, lamps: bool = False, up: str | None = None) -> Stage:
    """Load a stage as `scenes.open_scene` says. Raises AirlightError."""
    model = MeshModel(path, up or UP[path.lower()[-3:]])
    document = schema.Document(asset=schema.Asset(version="2.0"))
    empty = SimpleNamespace(document=document, order=[], hidden=set(), container=SimpleNamespace(path=path))
    return stage_of(empty, model, environment, lamps)


class MeshModel:
    """Holds what a file shows, as `gltf.model.Model` does."""

    def __init__(self, path: str, up: str) -> None:
        self.path = path
        self.root, self.nodes, self.moving, self.duration = gfx.Group(), {}, set(), 0.0
        self.drawn: list[gfx.WorldObject] = []
        self._z_up = up == "z"
        scene, self._library = read(path)
        self._vertices = 0
        used, others = [], 0
        for name, thing in scene.geometry.items():
            if isinstance(thing, trimesh.Trimesh) and len(thing.faces):
                used.append(self._add_mesh(str(name), thing))
            elif isinstance(thing, trimesh.PointCloud) and len(thing.vertices):
                self._add_points(str(name), thing)
            else:
                others += 1
        if not self.drawn:
            raise AirlightError(f"{path}: shows nothing: it has neither faces nor points; export it with its meshes")
        if others:
            warn(f"{path}: {others} parts that have no faces, as lines, are not shown", 4)
        self._library.say_ignored(used)

    nodes: dict[int, gfx.Group]
    moving: set[int]

    def pose(self, t: float) -> None:
        """Do nothing: nothing moves."""

    def _turned(self, vectors: np.ndarray) -> np.ndarray:
        """Turn (N, 3) vectors of the file to have +Y up."""
        return np.column_stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]]) if self._z_up else vectors

    def _placed(self, points: Any) -> np.ndarray:
        """Check (N, 3) points, and turn what is up to +Y, float64."""
        found = np.asarray(points, np.float64)
        if found.ndim != 2 or found.shape[1] != 3:
            raise AirlightError(f"{self.path}: is damaged: its vertices have {found.shape[-1]} coordinates; export it again")
        found = self._turned(found)
        self._vertices += len(found)
        if self._vertices > MAX_VERTICES:
            raise AirlightError(f"{self.path}: has more than {MAX_VERTICES} vertices; make it smaller first")
        if np.abs(found[np.isfinite(found)]).max(initial=0.0) > MAX_EXTENT:
            raise AirlightError(f"{self.path}: reaches farther than {MAX_EXTENT:g}; scale it down")
        return found

    def _add_mesh(self, name: str, mesh: Any) -> Any:
        """Add a mesh; returns the description of its material."""
        points = self._placed(mesh.vertices)
        faces = finite_faces(self.path, points, np.asarray(mesh.faces, np.int64))
        if not len(faces):
            return None
        if len(faces) > 6 * MAX_VERTICES // 3:
            raise AirlightError(f"{self.path}: has too many faces; make it smaller first")
        visual = mesh.visual
        described = getattr(visual, "material", None)
        uv = getattr(visual, "uv", None)
        normals = self._normals(mesh, points)
        arrays: dict[str, Any] = {}
        if visual.kind == "face":
            colors = np.repeat(_of_triangles(mesh), 3, axis=0)
            if len(colors) == 3 * len(mesh.faces) == 3 * len(faces):
                points, faces, normals, uv = points[faces.ravel()], np.arange(3 * len(faces)).reshape(-1, 3), None, None
                arrays["colors"] = _linear(colors)
            else:
                warn(f"{self.path}: shown without the colours of its faces, which are not as many as they are", 5)
        elif visual.kind == "vertex" and len(visual.vertex_colors) == len(points):
            arrays["colors"] = _linear(np.asarray(visual.vertex_colors))
        good = np.isfinite(points).all(axis=1)
        near, shift = recentred(np.where(good[:, None], points, points[good].mean(axis=0)))
        if uv is not None and len(uv) == len(points) and np.shape(uv)[1:] >= (2,):
            uv = np.nan_to_num(np.asarray(uv, np.float64)[:, :2], posinf=0.0, neginf=0.0)
            arrays["texcoords"] = np.ascontiguousarray(np.column_stack([uv[:, 0], 1 - uv[:, 1]]), np.float32)  # v is down in pygfx
        if normals is not None:
            faces = turned_out(points, normals, faces)
            arrays["normals"] = np.ascontiguousarray(normals, np.float32)
        materials = [self._library.material(described, "texcoords" in arrays, flat=normals is None)]
        if "colors" in arrays:
            alphas = arrays["colors"][:, 3]
            modes = layers((float(alphas.min()), float(alphas.max())), False)
            materials += [self._library.material(described, "texcoords" in arrays, flat=normals is None) for _ in modes[1:]]
            for material, settings in zip(materials, modes, strict=True):
                for setting, value in {"color_mode": "vertex", **settings}.items():
                    setattr(material, setting, value)
        geometry = gfx.Geometry(positions=np.ascontiguousarray(near, np.float32), indices=np.ascontiguousarray(faces, np.uint32), **arrays)
        for material in materials:
            complete(geometry, material)
            thing = gfx.Mesh(geometry, material)
            thing.cast_shadow, thing.receive_shadow = material.alpha_mode != "blend", True
            self._add(thing, _short(name, described, self._library), shift)
        return described

    def _normals(self, mesh: Any, points: np.ndarray) -> np.ndarray | None:
        """Take the normals that the file has; None where it has none, or some that are no directions: then faces are flat."""
        if "vertex_normals" not in mesh._cache.cache:
            return None
        normals = self._turned(np.asarray(mesh.vertex_normals, np.float64))
        if normals.shape != points.shape or not np.isfinite(normals).all() or (np.linalg.norm(normals, axis=1) < 1e-6).any():
            return None
        return normals

    def _add_points(self, name: str, cloud: Any) -> None:
        points = self._placed(cloud.vertices)
        good = np.isfinite(points).all(axis=1)
        if not good.all():
            left = counted(int((~good).sum()), "point that is no number is", "points that are no numbers are")
            warn(f"{self.path}: {left} left out", 5)
        if not good.any():
            return
        near, shift = recentred(points[good])
        colors = np.asarray(cloud.colors) if cloud.colors is not None else np.zeros((0, 4))
        more: dict[str, Any] = {}
        if len(colors) == len(points):
            more["colors"] = np.ascontiguousarray(colors[good] / 255, np.float32)  # of points pygfx decodes sRGB, not of meshes
        geometry = gfx.Geometry(positions=np.ascontiguousarray(near, np.float32), **more)
        material = gfx.PointsMaterial(color="#c8c8c8", size=POINT_SIZE, color_mode="vertex" if more else "uniform")
        self._add(gfx.Points(geometry, material), name, shift)

    def _add(self, thing: gfx.WorldObject, name: str, shift: np.ndarray) -> None:
        thing.name = name[:80]
        thing.local.position = shift
        self.root.add(thing)
        self.drawn.append(thing)


def _of_triangles(mesh: Any) -> np.ndarray:
    """Give (T, 4) colours of a mesh's triangles, also where those that it has are of faces with more corners."""
    colors, raw = np.asarray(mesh.visual.face_colors), mesh.metadata.get("_ply_raw", {}).get("face")
    if len(colors) == len(mesh.faces) or raw is None:
        return colors
    data = raw["data"]
    name = next(name for name in ("vertex_index", "vertex_indices") if name in (data if isinstance(data, dict) else data.dtype.names))
    corners = data[name] if isinstance(data, dict) else data[name]["f1"]
    owners = [np.full(len(face), i) for i, face in enumerate(corners)]
    return colors[triangulate_quads(owners)[:, 0]]  # cut as trimesh cuts the faces themselves, which are not in order then


def _linear(codes: np.ndarray) -> np.ndarray:
    """Decode (N, 4) uint8 sRGB codes to linear colours with their alpha, float32."""
    colors = codes.astype(np.float64) / 255
    colors[:, :3] = srgb_decode(colors[:, :3])
    return np.ascontiguousarray(colors, np.float32)


def _short(name: str, described: Any, library: Library) -> str:
    """Take the material off the name that trimesh gives a part of an object."""
    end = f"_{getattr(described, 'name', None)}"
    return name[: -len(end)] if library.split and name.endswith(end) and len(name) > len(end) else name
