"""Make the nodes of a checked glTF file as pygfx's objects, and put them where its animation says."""

import math
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.scenes.gltf import MAX_EXTENT, schema
from airlight.scenes.gltf.animate import THIN, Track, compose, thick, unit
from airlight.scenes.gltf.meshes import Meshes
from airlight.scenes.gltf.validate import PATHS, Gltf


class Model:
    """Holds what a file shows, without cameras and lights.

    root: a group with all of it. nodes: a group for each node that is shown. drawn: the meshes, lines and points.
    moving: the nodes that the animation moves. duration: seconds of the animation, 0 without one.
    """

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._document = gltf.document
        self._tracks = self._chosen_tracks()
        self.duration = max((float(track.times[-1]) for track in self._tracks), default=0.0)
        self._check_extent()
        self.root = gfx.Group()
        self.nodes: dict[int, gfx.Group] = {}
        self.moving: set[int] = set()
        self.drawn: list[gfx.WorldObject] = []
        self._morphed: dict[int, list[gfx.Mesh]] = {}
        self._rest: dict[int, list[np.ndarray]] = {}  # translation, rotation, scale of the nodes with a track
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
            if self._document.nodes[i].mesh is not None:
                self._add_mesh(i, self._document.nodes[i], meshes)
        if not self.drawn:
            gltf.refuse("shows nothing", "export it with its meshes")
        self.pose(0.0)

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
            self.nodes[i].local.matrix = compose(translation, unit(rotation), scale)

    def _chosen_tracks(self) -> list[Track]:
        """Choose the first clip, and each further one that moves nothing which one before it moves."""
        document, gltf = self._document, self._gltf
        chosen: dict[tuple[int, str], Track] = {}
        shown = set(gltf.order)
        for animation in document.animations:
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
        scales, places, least = [1.0] * len(nodes), [0.0] * len(nodes), [1.0] * len(nodes)
        for i in gltf.order:
            node, parent = nodes[i], gltf.parents[i]
            if node.matrix is not None:
                matrix = np.reshape(node.matrix, (4, 4)).T
                scale, place = float(np.linalg.norm(matrix[:3, :3])), float(np.linalg.norm(matrix[:3, 3]))
                low = float(np.linalg.svd(matrix[:3, :3], compute_uv=False)[2])
            else:
                scale, place, low = max(map(abs, node.scale)), math.hypot(*node.translation), min(map(abs, node.scale))
            if (i, "scale") in reach:
                low = 0.0
            scale = max(scale, reach.get((i, "scale"), 0.0))
            place = max(place, 2 * reach.get((i, "translation"), 0.0))
            above, beyond = (1.0, 0.0) if parent == -1 else (scales[parent], places[parent])
            scales[i], places[i] = above * scale, beyond + above * place
            least[i] = (1.0 if parent == -1 else least[parent]) * max(low, THIN)
            if least[i] < THIN**4:
                gltf.refuse(f"node {i} is scaled to nothing, again and again", "apply the scales")
            size = 0.0
            if node.mesh is not None:
                for primitive in self._document.meshes[node.mesh].primitives:
                    size = max(size, float(np.abs(gltf.floats(primitive.attributes["POSITION"])).max()))
            if max(scales[i], places[i] + 2 * size * scales[i]) > MAX_EXTENT:
                gltf.refuse(f"node {i} reaches farther than {MAX_EXTENT:g}", "scale the scene down")

    def _place(self, i: int, node: schema.Node, animated: bool) -> None:
        local = self.nodes[i].local
        local.state_basis = "matrix"  # keeps what no translation, rotation and scale can say
        if node.matrix is not None and not animated:
            local.matrix = thick(np.reshape(node.matrix, (4, 4)).T)
            return
        parts = [np.array(part, float) for part in (node.translation, node.rotation, node.scale)]
        local.matrix = compose(parts[0], unit(parts[1]), parts[2])
        if animated:
            self._rest[i] = parts

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
        for thing in meshes.objects(node.mesh, node.weights, skeleton):
            skinned = isinstance(thing, gfx.SkinnedMesh)
            (self.root if skinned else self.nodes[i]).add(thing)  # the joints alone place a skin
            self.drawn.append(thing)
            thing.name = self._document.meshes[node.mesh].name[:80]
            if isinstance(thing, gfx.Mesh) and getattr(thing.geometry, "morph_positions", None):
                self._morphed.setdefault(i, []).append(thing)
