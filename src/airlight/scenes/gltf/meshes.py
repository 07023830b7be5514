"""Make meshes of a checked glTF file as pygfx's objects, and find where their vertices are."""

from typing import Any

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_encode
from airlight.scenes.gltf.materials import Materials, channels
from airlight.scenes.gltf.schema import Primitive
from airlight.scenes.gltf.validate import OF_POINTS, Gltf
from airlight.scenes.origin import recentred, shifted

POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = range(7)


_CHUNK = 65536  # vertices that are skinned at a time
_MANY = 2**22  # vertices of instances, beyond which their boxes stand for them


def triangles(indices: np.ndarray, mode: int) -> np.ndarray:
    """Index (T, 3) vertices of triangles, strips and fans (glTF 2.0, section 3.7.2.1); what is left over is dropped."""
    if mode == TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    count = max(0, len(indices) - 2)
    first, second, third = indices[:count], indices[1 : count + 1], indices[2 : count + 2]
    if mode == TRIANGLE_FAN:
        return np.stack([second, third, np.repeat(indices[:1], count)], axis=1)
    odd = np.arange(count) % 2 == 1
    return np.stack([first, np.where(odd, third, second), np.where(odd, second, third)], axis=1)


def turned_out(positions: np.ndarray, normals: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Turn (T, 3) faces to have their front where the normals point to, if nearly all of them (by area) had it at the back.

    Such meshes come of careless converters; taken literally, one would look into them from outside.
    """
    a, b, c = (positions[faces[:, i]].astype(np.float64) for i in range(3))
    agree = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals[faces].sum(axis=1, dtype=np.float64))
    inside_out = -agree[agree < 0].sum() > 0.95 * np.abs(agree).sum()
    return faces[:, ::-1] if inside_out else faces


class Meshes:
    """Makes each geometry once."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._materials = Materials(gltf)
        self._geometries: dict[tuple[int, int], gfx.Geometry | None] = {}
        self._shifts: dict[tuple[int, int], np.ndarray] = {}  # of their vertices, towards the origin

    def objects(self, mesh: int, weights: list[float], skeleton: gfx.Skeleton | None) -> list[gfx.WorldObject]:
        """Make the objects that show a mesh of the file; weights: of its morph targets, or empty for the mesh's own."""
        described = self._gltf.document.meshes[mesh]
        found: list[gfx.WorldObject] = []
        for i, primitive in enumerate(described.primitives):
            if (mesh, i) not in self._geometries:
                self._geometries[mesh, i], self._shifts[mesh, i] = self._geometry(primitive)
            geometry, shift = self._geometries[mesh, i], self._shifts[mesh, i]
            if geometry is None:
                continue
            if primitive.mode < TRIANGLES:
                found.append(self._thin(geometry, primitive))
                found[-1].local.position = shift
                continue
            lacking, painted = "NORMAL" not in primitive.attributes, "COLOR_0" in primitive.attributes
            materials = self._materials.parts(primitive.material, lacking, self._alphas(primitive), painted)
            if not materials:
                continue
            material = materials[0]
            complete(geometry, material)
            if skeleton is not None and hasattr(geometry, "skin_indices") and hasattr(geometry, "skin_weights"):
                thing = gfx.SkinnedMesh(geometry, material)
                bones, inverses = skeleton.bones, skeleton.bone_inverses
                own = gfx.Skeleton(bones, [shifted(inverse, shift) for inverse in inverses]) if shift.any() else skeleton
                thing.bind(own, np.eye(4))
            else:
                thing = gfx.Mesh(geometry, material)
                thing.local.position = shift
            if primitive.targets:
                thing.morph_target_influences = weights or described.weights or [0.0] * len(primitive.targets)
            thing.cast_shadow = material.alpha_method == "opaque"
            thing.receive_shadow = True
            found += [thing, *(again(thing, other) for other in materials[1:])]
        return found

    def _alphas(self, primitive: Primitive) -> tuple[float, float]:
        """Find the range of the alphas of a mesh's vertex colours, 0..1."""
        index = primitive.attributes.get("COLOR_0")
        if index is None or self._gltf.document.accessors[index].type != "VEC4":
            return 1.0, 1.0
        alphas = np.clip(self._gltf.floats(index)[:, 3], 0, 1)
        return float(alphas.min()), float(alphas.max())

    def _thin(self, geometry: gfx.Geometry, primitive: Primitive) -> gfx.WorldObject:
        """Make points and lines, a pixel or so wide, in the material's plain colour, or their own."""
        more = {"color": self._materials.material(primitive.material).color}
        if getattr(geometry, "colors", None) is not None:
            more["color_mode"] = "vertex"
        if primitive.mode == POINTS:
            return gfx.Points(geometry, gfx.PointsMaterial(size=2, **more))
        kind = gfx.LineSegmentMaterial if primitive.mode == LINES else gfx.LineMaterial
        return gfx.Line(geometry, kind(thickness=1.5, **more))

    def _plain_colors(self, primitive: Primitive) -> np.ndarray:
        """Multiply COLOR_0 by the material's colour: (N, 3 or 4) float32, as sRGB codes, which pygfx takes for points and lines alone."""
        colors = np.clip(self._gltf.floats(primitive.attributes["COLOR_0"]), 0, 1)
        if primitive.material is not None:
            factor = self._gltf.document.materials[primitive.material].pbr_metallic_roughness.base_color_factor
            if factor[3] < 1 and colors.shape[1] == 3:
                colors = np.concatenate([colors, np.ones((len(colors), 1), np.float32)], axis=1)
            colors = colors * np.clip(np.array(factor[: colors.shape[1]], np.float32), 0, 1)
        colors[:, :3] = srgb_encode(colors[:, :3])
        return np.ascontiguousarray(colors, np.float32)

    def _geometry(self, primitive: Primitive) -> tuple[gfx.Geometry | None, np.ndarray]:
        """Make a geometry, and find the shift of its vertices, as `recentred` gives it."""
        gltf = self._gltf
        positions, shift = recentred(gltf.floats(primitive.attributes["POSITION"]))
        if self._materials.blends(primitive.material) and "JOINTS_0" not in primitive.attributes:
            middle = (positions.min(axis=0) + positions.max(axis=0)) / np.float32(2)  # pygfx sorts by where objects are, not their vertices
            positions, shift = positions - middle, shift + middle
        indices = np.arange(len(positions), dtype=np.uint32)
        if primitive.indices is not None:
            indices = gltf.integers(primitive.indices)[:, 0]
        if primitive.mode < TRIANGLES:
            if primitive.mode == LINE_LOOP:
                indices = np.append(indices, indices[:1])
            indices = indices[: len(indices) // 2 * 2] if primitive.mode == LINES else indices
            if len(indices) < min(2, primitive.mode + 1):
                return None, shift
            more = {}
            if "COLOR_0" in primitive.attributes:
                more["colors"] = self._plain_colors(primitive)[indices]
            for name, array in OF_POINTS.items():  # for `pygfx.particles`
                if primitive.mode == POINTS and name in primitive.attributes:
                    more[array] = gltf.floats(primitive.attributes[name])[indices, 0]
            return gfx.Geometry(positions=positions[indices], **more), shift
        faces = triangles(indices, primitive.mode)
        if not len(faces):
            return None, shift
        if "NORMAL" in primitive.attributes:
            faces = turned_out(positions, gltf.floats(primitive.attributes["NORMAL"]), faces)
        arrays: dict[str, Any] = {"positions": positions, "indices": np.ascontiguousarray(faces)}
        for name, index in primitive.attributes.items():
            if name == "NORMAL":
                arrays["normals"] = gltf.floats(index)
            elif name == "TANGENT" and "NORMAL" in primitive.attributes:
                arrays["tangents"] = gltf.floats(index)
            elif name == "COLOR_0":
                arrays["colors"] = np.clip(gltf.floats(index), 0, 1)
            elif name == "JOINTS_0":
                arrays["skin_indices"] = gltf.integers(index)
            elif name == "WEIGHTS_0":
                arrays["skin_weights"] = _normalised(gltf.floats(index))
            elif name.startswith("TEXCOORD_") and name[9:] in ("0", "1", "2", "3"):
                arrays[f"texcoords{name[9:].lstrip('0')}"] = gltf.floats(index)
        if "JOINTS_1" in primitive.attributes:
            gltf.tell("influences", "vertices follow four joints at most; further ones are left out")
        geometry = gfx.Geometry(**arrays)
        for source, goal in (("POSITION", "morph_positions"), ("NORMAL", "morph_normals")):
            present = [target.get(source) for target in primitive.targets]
            if any(index is not None for index in present):
                moved = [np.zeros_like(positions) if index is None else gltf.floats(index) for index in present]
                setattr(geometry, goal, moved)
        if primitive.targets:
            if getattr(geometry, "morph_positions", None) is None:
                geometry.morph_positions = [np.zeros_like(positions) for _ in primitive.targets]
            geometry.morph_targets_relative = True
        return geometry, shift


def again(thing: gfx.Mesh, material: gfx.Material) -> gfx.Mesh:
    """Make a mesh once more in another material; what is drawn over another casts no shadow."""
    complete(thing.geometry, material)
    if isinstance(thing, gfx.SkinnedMesh):
        other = gfx.SkinnedMesh(thing.geometry, material)
        other.bind(thing.skeleton, thing.bind_matrix)
    else:
        other = gfx.Mesh(thing.geometry, material)
    if getattr(thing.geometry, "morph_positions", None):
        other.morph_target_influences = thing.morph_target_influences
    other.local.matrix = thing.local.matrix
    other.receive_shadow = True
    return other


def complete(geometry: gfx.Geometry, material: gfx.Material) -> None:
    """Add texture coordinates, all 0, that a material asks for and the mesh lacks."""
    for channel in channels(material):
        name = f"texcoords{channel or ''}"
        if getattr(geometry, name, None) is None:
            setattr(geometry, name, gfx.Buffer(np.zeros((geometry.positions.nitems, 2), np.float32)))


def _normalised(weights: np.ndarray) -> np.ndarray:
    """Normalise (N, 4) weights >= 0 to a sum of 1; those of a vertex without any stay 0 but for the first joint's."""
    weights = np.maximum(weights, 0)
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 0, weights / np.where(total > 0, total, 1), np.array([1, 0, 0, 0]))
    return np.ascontiguousarray(weights, np.float32)


def vertices(thing: gfx.WorldObject) -> np.ndarray:
    """Find where the vertices of a mesh (skinned, morphed), of points or lines are in the world, now: (N, 3) float64."""
    geometry = thing.geometry
    points = np.asarray(geometry.positions.data, np.float64)
    morphs = getattr(geometry, "morph_positions", None)
    if morphs:
        for share, moved in zip(thing.morph_target_influences, morphs):
            points = points + float(share) * moved
    if isinstance(thing, gfx.SkinnedMesh):
        skeleton = thing.skeleton
        joints = np.stack([bone.world.matrix @ inverse for bone, inverse in zip(skeleton.bones, skeleton.bone_inverses)])
        weights = np.asarray(geometry.skin_weights.data, np.float64)
        placed = np.zeros_like(points)
        for start in range(0, len(points), _CHUNK):
            part = slice(start, start + _CHUNK)
            for i in range(4):
                matrices = joints[geometry.skin_indices.data[part, i]]
                moved = np.einsum("nij,nj->ni", matrices[:, :3, :3], points[part]) + matrices[:, :3, 3]
                placed[part] += weights[part, i, None] * moved
        return placed
    matrix = thing.world.matrix
    if isinstance(thing, gfx.InstancedMesh):
        return _instanced(points, matrix @ np.asarray(thing.instance_buffer.data["matrix"], np.float64).transpose(0, 2, 1))
    points = points[np.isfinite(points).all(axis=1)]  # between lines that are one object
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])


def _instanced(points: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    """Place points once for each matrix, or, where these are many, the corners of their box."""
    if len(points) * len(matrices) > _MANY:
        low, high = points.min(axis=0), points.max(axis=0)
        points = np.stack(np.meshgrid(*zip(low, high)), axis=-1).reshape(-1, 3)
    return np.asarray(points @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]).reshape(-1, 3)
