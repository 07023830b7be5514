"""Make the nodes of a checked glTF file as pygfx's objects, and put them where its animation says."""

import math
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.scenes.gltf import MAX_EXTENT, instances, schema
from airlight.scenes.gltf.animate import LEAST, THIN, Track, compose, thick, unit
from airlight.scenes.gltf.instances import MIRROR
from airlight.scenes.gltf.meshes import Meshes
from airlight.scenes.gltf.validate import PATHS, Gltf


def _is_mirrored(skeleton: gfx.Skeleton) -> bool:
    """Tell whether most joints turn what hangs on them inside out, now."""
    signs = [np.linalg.det(bone.world.matrix @ inverse) for bone, inverse in zip(skeleton.bones, skeleton.bone_inverses)]
    return bool(np.sign(signs).sum() < 0)


class Model:
    """Holds what a file shows, without cameras and lights.

    root: a group with all of it. nodes: a group for each node that is shown. drawn: the meshes, lines and points.
    moving: the nodes that the animation moves. duration: seconds of the animation, 0 without one.
    animation: a clip by name or number, None: the first, and each further one that moves nothing which one before it moves.
    """

    def __init__(self, gltf: Gltf, animation: str | None = None) -> None:
        self._gltf = gltf
        self._document = gltf.document
        self._tracks = self._chosen_tracks(animation)
        self.duration = max((float(track.times[-1]) for track in self._tracks), default=0.0)
        self.duration = max(self.duration, 0.0)
        self._check_extent()
        self.root = gfx.Group()
        self.nodes: dict[int, gfx.Group] = {}
        self.moving: set[int] = set()
        self.drawn: list[gfx.WorldObject] = []
        self._morphed: dict[int, list[gfx.Mesh]] = {}
        self._rest: dict[int, list[np.ndarray]] = {}  # translation, rotation, scale of the nodes with a track
        self._local: dict[int, np.ndarray] = {}  # matrices of the nodes that may vanish, as the file has them
        self._own: dict[int, list[gfx.WorldObject]] = {}  # what such a node shows
        animated = {track.node for track in self._tracks}
        for i in gltf.order:
            node, parent = self._document.nodes[i], gltf.parents[i]
            self.nodes[i] = gfx.Group(name=node.name[:80])
            (self.root if parent == -1 else self.nodes[parent]).add(self.nodes[i])
            if i in animated or parent in self.moving:
                self.moving.add(i)
            self._place(i, node, i in animated)
        meshes = Meshes(gltf)
        for i in gltf.order:
            if self._document.nodes[i].mesh is not None and i not in gltf.hidden:
                self._add_mesh(i, self._document.nodes[i], meshes)
        if not self.drawn:
            gltf.refuse("shows nothing", "export it with its meshes")
        self.pose(0.0)
        for thing in self.drawn:
            if isinstance(thing, gfx.SkinnedMesh) and _is_mirrored(thing.skeleton):
                thing.local.state_basis = "matrix"
                thing.local.matrix = MIRROR  # moves no vertex: pygfx takes from it which side is the front

    def pose(self, t: float) -> None:
        """Pose everything as it is at t seconds of the looped animation, the same for the same t whatever came before."""
        t = t % self.duration if self.duration > 0 else 0.0
        now: dict[int, list[Any]] = {i: list(parts) for i, parts in self._rest.items()}
        for track in self._tracks:
            value = track.at(t)
            if track.path == "weights":
                for mesh in self._morphed.get(track.node, ()):
                    mesh.morph_target_influences = value
            else:
                now[track.node][("translation", "rotation", "scale").index(track.path)] = value
        for i, (translation, rotation, scale) in now.items():
            matrix = compose(translation, unit(rotation), scale)
            if i in self._local:
                self._local[i] = matrix
            else:
                self.nodes[i].local.matrix = matrix
        self._vanish()

    def _vanish(self) -> None:
        """Hide what is scaled to a line or a point, now, and keep an inverse of every matrix."""
        worlds: dict[int, np.ndarray] = {}
        least: dict[int, float] = {}
        for i, matrix in self._local.items():  # parents first
            parent = self._gltf.parents[i]
            above = np.eye(4) if parent == -1 else worlds.get(parent, self.nodes[parent].world.matrix)
            worlds[i] = above @ matrix
            over = least.get(parent, 1.0 if parent == -1 else self._least[parent])
            floor = min(1.0, max(THIN, LEAST / over))
            self.nodes[i].local.matrix = thick(matrix, floor)
            least[i] = over * max(float(np.linalg.svd(matrix[:3, :3], compute_uv=False)[2]), floor)
            if i in self._own:
                area = float(np.linalg.svd(worlds[i][:3, :3], compute_uv=False)[1])
                for thing in self._own[i]:
                    thing.visible = area > LEAST

    def _chosen_tracks(self, wanted: str | None) -> list[Track]:
        """Read the tracks of the clips that are shown, see above."""
        document, gltf = self._document, self._gltf
        clips = document.animations
        if wanted is not None:
            clips = [clips[gltf.chosen(wanted, [clip.name for clip in clips], "animation")]]
        chosen: dict[tuple[int, str], Track] = {}
        shown = set(gltf.order)
        for animation in clips:
            clip: dict[tuple[int, str], Track] = {}
            for channel in animation.channels:
                node, path = channel.target.node, channel.target.path
                if node is None or node not in shown or path not in PATHS:
                    continue
                sampler = animation.samplers[channel.sampler]
                times, values = gltf.floats(sampler.input)[:, 0], gltf.floats(sampler.output)
                shape = (len(times), 3, -1) if sampler.interpolation == "CUBICSPLINE" else (len(times), -1)
                clip[node, path] = Track(node, path, sampler.interpolation, times, values.reshape(shape))  # type: ignore[arg-type]
            if not clip.keys() & chosen.keys():
                chosen |= clip
        return list(chosen.values())

    def _check_extent(self) -> None:
        """Refuse what reaches beyond MAX_EXTENT at any time: bounds of scale and place, from the roots down."""
        gltf, nodes = self._gltf, self._document.nodes
        reach: dict[tuple[int, str], float] = {}
        greatest: dict[int, float] = {}  # of each array of values, which many tracks may share
        for track in self._tracks:
            at = track.values.__array_interface__["data"][0]
            if at not in greatest:
                greatest[at] = float(np.abs(track.values).max())
            reach[track.node, track.path] = greatest[at]
        low = {(track.node, track.path): track.least() for track in self._tracks if track.path == "scale"}
        scales, places, self._least = [1.0] * len(nodes), [0.0] * len(nodes), [1.0] * len(nodes)
        for i in gltf.order:
            node, parent = nodes[i], gltf.parents[i]
            if node.matrix is not None:
                matrix = np.reshape(node.matrix, (4, 4)).T
                scale, place = float(np.linalg.norm(matrix[:3, :3])), float(np.linalg.norm(matrix[:3, 3]))
                thin = float(np.linalg.svd(matrix[:3, :3], compute_uv=False)[2])
            else:
                scale, place, thin = max(map(abs, node.scale)), math.hypot(*node.translation), min(map(abs, node.scale))
            thin = min(thin, low.get((i, "scale"), thin))
            scale = max(scale, reach.get((i, "scale"), 0.0))
            place = max(place, 2 * reach.get((i, "translation"), 0.0))
            above, beyond = (1.0, 0.0) if parent == -1 else (scales[parent], places[parent])
            scales[i], places[i] = above * scale, beyond + above * place
            self._least[i] = (1.0 if parent == -1 else self._least[parent]) * thin
            size = 0.0
            if node.mesh is not None:
                for primitive in self._document.meshes[node.mesh].primitives:
                    size = max(size, float(np.abs(gltf.floats(primitive.attributes["POSITION"])).max()))
                if node.extensions.instancing is not None:
                    size = instances.reach(gltf, node.extensions.instancing, size)
            if max(scales[i], places[i] + 2 * size * scales[i]) > MAX_EXTENT:
                gltf.refuse(f"node {i} reaches farther than {MAX_EXTENT:g}", "scale the scene down")

    def _place(self, i: int, node: schema.Node, animated: bool) -> None:
        local = self.nodes[i].local
        local.state_basis = "matrix"  # keeps what no translation, rotation and scale can say
        if node.matrix is not None and not animated:
            matrix = np.reshape(node.matrix, (4, 4)).T
        else:
            parts = [np.array(part, float) for part in (node.translation, node.rotation, node.scale)]
            matrix = compose(parts[0], unit(parts[1]), parts[2])
            if animated:
                self._rest[i] = parts
        if self._least[i] < THIN:
            self._local[i] = matrix
        else:
            local.matrix = matrix

    def _add_mesh(self, i: int, node: schema.Node, meshes: Meshes) -> None:
        assert node.mesh is not None
        skeleton = None
        if node.skin is not None:
            skin = self._document.skins[node.skin]
            if all(joint in self.nodes for joint in skin.joints):
                inverses = [np.eye(4)] * len(skin.joints)
                if skin.inverse_bind_matrices is not None:
                    matrices = self._gltf.floats(skin.inverse_bind_matrices)[: len(skin.joints)]
                    inverses = list(matrices.reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64))
                skeleton = gfx.Skeleton([self.nodes[joint] for joint in skin.joints], inverses)
            else:
                self._gltf.tell("joints", f"skin {node.skin} has joints that are not in the scene; its mesh is shown as it is")
        shown = meshes.objects(node.mesh, node.weights, skeleton)
        if node.extensions.instancing is not None:
            shown = instances.instanced(self._gltf, node.extensions.instancing, shown)
        for thing in shown:
            skinned = isinstance(thing, gfx.SkinnedMesh)
            if i in self._local and not skinned:
                self._own.setdefault(i, []).append(thing)
            (self.root if skinned else self.nodes[i]).add(thing)  # the joints alone place a skin
            self.drawn.append(thing)
            thing.name = self._document.meshes[node.mesh].name[:80]
            if isinstance(thing, gfx.Mesh) and getattr(thing.geometry, "morph_positions", None):
                self._morphed.setdefault(i, []).append(thing)
