"""Show the mesh of a node many times: EXT_mesh_gpu_instancing."""

import numpy as np
import pygfx as gfx

from airlight.scenes.gltf import schema
from airlight.scenes.gltf.animate import LEAST, compose, thick, unit
from airlight.scenes.gltf.validate import Gltf
from airlight.scenes.origin import gathered, recentred, shifted

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
DEFAULTS = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}


def matrices(gltf: Gltf, instancing: schema.Instancing) -> np.ndarray:
    """Compose (N, 4, 4) the instances' matrices, but those that are scaled to a line or a point."""
    parts = {name: gltf.floats(index).astype(np.float64) for name, index in instancing.attributes.items() if name in DEFAULTS}
    count = max((len(part) for part in parts.values()), default=1)
    moves, turns, scales = (parts.get(name, np.broadcast_to(default, (count, len(default)))) for name, default in DEFAULTS.items())
    found = compose(moves, unit(turns), scales)
    return thick(found[np.linalg.svd(found[:, :3, :3], compute_uv=False)[:, 1] > LEAST])


def reach(gltf: Gltf, instancing: schema.Instancing, size: float) -> float:
    """Bound the coordinates of all instances of what reaches as far as `size`."""
    far = {name: float(np.abs(gltf.floats(index)).max()) for name, index in instancing.attributes.items() if name in DEFAULTS}
    return 2 * (size * far.get("SCALE", 1.0) + far.get("TRANSLATION", 0.0))


def instanced(gltf: Gltf, instancing: schema.Instancing, things: list[gfx.WorldObject]) -> list[gfx.WorldObject]:
    """Make of each object one that shows all instances; a mirrored one is turned inside out by an object of its own."""
    every = matrices(gltf, instancing)
    turned = np.linalg.det(every[:, :3, :3]) < 0
    found: list[gfx.WorldObject] = []
    for thing in things:
        placed = shifted(every, thing.local.position)
        if isinstance(thing, gfx.SkinnedMesh):
            gltf.tell("skinned", "a mesh with a skin is shown once, not as instances of it")
            found.append(thing)
        elif isinstance(thing, gfx.Mesh):
            for base, own in ((np.eye(4), placed[~turned]), (MIRROR, MIRROR @ placed[turned])):
                if len(own):
                    found.append(_many(thing, base, own))
        elif len(placed):
            found.append(_repeated(thing, placed))
    return found


def _many(mesh: gfx.Mesh, base: np.ndarray, own: np.ndarray) -> gfx.InstancedMesh:
    many = gfx.InstancedMesh(mesh.geometry, mesh.material, len(own))
    own, shift = gathered(own)
    matrix = base.copy()
    matrix[:3, 3] = base[:3, :3] @ shift
    many.local.state_basis = "matrix"
    many.local.matrix = matrix
    many.instance_buffer.data["matrix"][:] = own.transpose(0, 2, 1)
    many.instance_buffer.update_full()
    if getattr(mesh.geometry, "morph_positions", None):
        many.morph_target_influences = mesh.morph_target_influences
    many.cast_shadow, many.receive_shadow = mesh.cast_shadow, mesh.receive_shadow
    return many


def _repeated(thing: gfx.WorldObject, placed: np.ndarray) -> gfx.WorldObject:
    """Repeat points or lines; between lines that go on stands a vertex that is no number, which parts them."""
    points = np.asarray(thing.geometry.positions.data, np.float64)
    colors = getattr(thing.geometry, "colors", None)
    all_points = points @ placed[:, :3, :3].transpose(0, 2, 1) + placed[:, None, :3, 3]
    all_colors = None if colors is None else np.broadcast_to(colors.data, (len(placed), *colors.data.shape))
    if isinstance(thing, gfx.Line) and not isinstance(thing.material, gfx.LineSegmentMaterial):
        all_points = np.concatenate([all_points, np.full((len(placed), 1, 3), np.nan)], axis=1)
        if all_colors is not None:
            all_colors = np.concatenate([all_colors, all_colors[:, -1:]], axis=1)
    more = {} if all_colors is None else {"colors": np.ascontiguousarray(all_colors.reshape(-1, all_colors.shape[-1]), np.float32)}
    near, shift = recentred(all_points.reshape(-1, 3))
    found = type(thing)(gfx.Geometry(positions=np.ascontiguousarray(near, np.float32), **more), thing.material)
    found.local.position = shift
    return found
