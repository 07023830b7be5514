"""Check whether a glTF file hangs together: every index, length and value, before anything is built from it.

What is checked is decoded here too, once, so that nothing is read in two ways. Unaligned accessors are read as they are.
"""

import re
from functools import cached_property
from typing import Any, NoReturn

import numpy as np

from airlight.scenes.gltf import (
    MAX_ACCESSOR,
    MAX_BYTES,
    MAX_DEPTH,
    MAX_DRAWS,
    MAX_EXTENT,
    MAX_JOINTS,
    MAX_NODES,
    MAX_PIXELS,
    MAX_TARGETS,
    MAX_VERTICES,
    images,
    schema,
)
from airlight.scenes.gltf.container import Container, open_container, shown

EXTENSIONS = frozenset(
    (
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_volume",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    )
)
KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
FLOAT = 5126
UNSIGNED = (5121, 5123, 5125)
ATTRIBUTES = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4", "JOINTS_0": "VEC4", "WEIGHTS_0": "VEC4"}
PATHS = {"translation": 3, "rotation": 4, "scale": 3, "weights": 1}


class Gltf:
    """A file that was checked. `document` is its JSON; the methods give what it holds, decoded.

    parents: of each node, -1 for a root. order: the nodes of the scene that is shown, each behind its parent.
    """

    def __init__(self, path: str) -> None:
        self.container: Container = open_container(path)
        self.document = self.container.document
        self._decoded = 0
        self._floats: dict[int, np.ndarray] = {}
        self._integers: dict[int, np.ndarray] = {}
        self._seen: set[tuple[str, int]] = set()  # checks that were made: many may name one large accessor
        self._highest: dict[int, int] = {}
        self._check()

    def refuse(self, what: str, cure: str = "export it again") -> NoReturn:
        self.container.refuse(what, cure)

    def within(self, index: int | None, things: list[Any], what: str) -> Any:
        """Take things[index], or refuse and say what asks for it."""
        if index is None or not 0 <= index < len(things):
            self.refuse(f"{what} names number {index} of {len(things)}")
        return things[index]

    # ---------------------------------------------------------------- bytes

    @cached_property
    def buffers(self) -> list[memoryview]:
        found = []
        for i, buffer in enumerate(self.document.buffers):
            if buffer.uri is not None:
                data = memoryview(self.container.resource(buffer.uri, f"buffer {i}"))
            elif i == 0 and self.container.binary is not None:
                data = self.container.binary
            else:
                self.refuse(f"buffer {i} has no contents")
            if buffer.byte_length > len(data):
                self.refuse(f"buffer {i} has {len(data)} bytes instead of {buffer.byte_length}", "copy or export it again")
            found.append(data[: buffer.byte_length])
        return found

    def view(self, index: int | None, what: str) -> tuple[memoryview, int | None]:
        """Read the bytes of a buffer view, and its stride."""
        view = self.within(index, self.document.buffer_views, f"the buffer view of {what}")
        data = self.within(view.buffer, self.buffers, f"buffer view {index}")
        if view.byte_offset + view.byte_length > len(data):
            self.refuse(f"buffer view {index} ends behind the end of its buffer")
        return data[view.byte_offset : view.byte_offset + view.byte_length], view.byte_stride

    def _elements(self, view: int, offset: int, count: int, kind: np.dtype, components: int, what: str) -> np.ndarray:
        data, stride = self.view(view, what)
        size = kind.itemsize * components
        stride = stride or size
        if stride < size:
            self.refuse(f"{what} has elements of {size} bytes every {stride} bytes")
        if offset + (count - 1) * stride + size > len(data):
            self.refuse(f"{what} ends behind the end of its buffer view")
        array = np.ndarray((count, components), kind, buffer=data, offset=offset, strides=(stride, kind.itemsize))
        return np.array(array)  # contiguous, and not the file's own bytes

    def _accessor(self, index: int) -> np.ndarray:
        """Read an accessor in the file's own type: (count, components)."""
        what = f"accessor {index}"
        accessor = self.document.accessors[index]
        kind, components = np.dtype(KINDS[accessor.component_type]), COMPONENTS[accessor.type]
        size = accessor.count * components * 4
        self._decoded += size
        if size > MAX_ACCESSOR or self._decoded > MAX_BYTES:
            limits = f"{MAX_ACCESSOR >> 20} MiB for one and {MAX_BYTES >> 20} MiB for all"
            self.refuse(f"{what} is more than the limits of {limits}", "make it smaller first")
        if accessor.buffer_view is not None:
            array = self._elements(accessor.buffer_view, accessor.byte_offset, accessor.count, kind, components, what)
        else:
            if accessor.count > 65536 + sum(len(buffer) for buffer in self.buffers):
                self.refuse(f"{what} asks for {accessor.count} elements, more than the file has bytes")
            array = np.zeros((accessor.count, components), kind)
        sparse = accessor.sparse
        if sparse is not None:
            what = f"the sparse part of {what}"
            if sparse.count > accessor.count:
                self.refuse(f"{what} has more elements than the whole")
            indices, values = sparse.indices, sparse.values
            at = self._elements(indices.buffer_view, indices.byte_offset, sparse.count, np.dtype(KINDS[indices.component_type]), 1, what)[
                :, 0
            ]
            if int(at.max()) >= accessor.count:
                self.refuse(f"{what} names element {int(at.max())} of {accessor.count}")
            array[at] = self._elements(values.buffer_view, values.byte_offset, sparse.count, kind, components, what)
        return array

    def floats(self, index: int) -> np.ndarray:
        """Read a checked accessor as (count, components) float32; normalised integers are in 0..1 or -1..1."""
        if index not in self._floats:
            array = self._accessor(index)
            accessor = self.document.accessors[index]
            if array.dtype.kind == "f" or not accessor.normalized:
                array = array.astype(np.float32)
            else:
                array = np.maximum(array.astype(np.float32) / np.float32(np.iinfo(array.dtype).max), -1)
            self._floats[index] = array
        return self._floats[index]

    def integers(self, index: int) -> np.ndarray:
        """Read a checked accessor as (count, components) uint32."""
        if index not in self._integers:
            self._integers[index] = self._accessor(index).astype(np.uint32)
        return self._integers[index]

    def _typed(self, index: int, what: str, type: str | tuple[str, ...], kinds: tuple[int, ...] | None = None) -> schema.Accessor:
        accessor: schema.Accessor = self.within(index, self.document.accessors, what)
        if accessor.type not in type or (kinds is not None and accessor.component_type not in kinds):
            self.refuse(f"{what} is of a wrong type ({accessor.type}, {accessor.component_type})")
        return accessor

    def _once(self, check: str, index: int) -> bool:
        """Tell whether this check of an accessor is still to be made; it then counts as made."""
        fresh = (check, index) not in self._seen
        self._seen.add((check, index))
        return fresh

    def highest(self, index: int) -> int:
        """Find the greatest of an accessor's integers."""
        if index not in self._highest:
            self._highest[index] = int(self.integers(index).max())
        return self._highest[index]

    def _finite(self, index: int, what: str) -> np.ndarray:
        """Read `floats`, and refuse any that is no number within MAX_EXTENT."""
        array = self.floats(index)
        if self._once("finite", index) and not (np.abs(array) <= MAX_EXTENT).all():  # false for NaN
            self.refuse(f"{what} holds values that are not numbers, or beyond {MAX_EXTENT:g}")
        return array

    def _mended(self, index: int) -> None:
        """Replace what is not a number by 0."""
        array = self.floats(index)
        if not self._once("mended", index):
            return
        bad = ~(np.abs(array) <= MAX_EXTENT)
        if bad.any():
            array[bad] = 0

    # ---------------------------------------------------------------- the checks, in the order in which they need one another

    def _check(self) -> None:
        d = self.document
        if not re.fullmatch(r"2\.\d{1,3}", d.asset.version) or d.asset.min_version not in (None, "2.0"):
            self.refuse(f"is glTF of version {shown(d.asset.min_version or d.asset.version)}", "export it as glTF 2.0")
        unknown = sorted(set(d.extensions_required) - EXTENSIONS)
        if unknown:
            self.refuse(f"needs {shown(unknown[0])}, which Airlight cannot read", "export it without that extension")
        if len(d.nodes) > MAX_NODES:
            self.refuse(f"has {len(d.nodes)} nodes, more than the limit of {MAX_NODES}", "join or remove some")
        _ = self.buffers
        self._check_tree()
        self._check_images()
        self._check_materials()
        for i, skin in enumerate(d.skins):
            self._check_skin(i, skin)
        for i, mesh in enumerate(d.meshes):
            self._check_mesh(i, mesh)
        self._check_nodes()
        for i, animation in enumerate(d.animations):
            self._check_animation(i, animation)
        for i, camera in enumerate(d.cameras):
            self._check_camera(i, camera)
        for i, light in enumerate(d.extensions.lights.lights):
            if light.type == "spot" and not light.spot.inner_cone_angle < light.spot.outer_cone_angle <= np.pi / 2 + 1e-6:
                self.refuse(f"light {i} has a cone from {light.spot.inner_cone_angle:g} to {light.spot.outer_cone_angle:g} radians")

    def _check_tree(self) -> None:
        """Refuse nodes with two parents, circles, and more than MAX_DEPTH levels; sets `parents` and `order`. Without recursion."""
        nodes = self.document.nodes
        self.parents = [-1] * len(nodes)
        for i, node in enumerate(nodes):
            for child in node.children:
                self.within(child, nodes, f"a child of node {i}")
                if self.parents[child] != -1:
                    self.refuse(f"node {child} has two parents or is named twice")
                self.parents[child] = i
        depth = [0] * len(nodes)
        order = [i for i in range(len(nodes)) if self.parents[i] == -1]
        for i in order:  # which grows
            if depth[i] > MAX_DEPTH:
                self.refuse(f"its nodes are nested deeper than {MAX_DEPTH}", "flatten the hierarchy")
            for child in nodes[i].children:
                depth[child] = depth[i] + 1
                order.append(child)
        if len(order) < len(nodes):
            self.refuse("its nodes are nested in a circle")
        if self.document.scenes:
            roots_named = self.within(self.document.scene or 0, self.document.scenes, "the scene that is shown").nodes
            for root in roots_named:
                self.within(root, nodes, "a scene")
                if self.parents[root] != -1:
                    self.refuse(f"node {root} of a scene has a parent")
            roots, inside = set(roots_named), [False] * len(nodes)
            for i in order:
                inside[i] = i in roots if self.parents[i] == -1 else inside[self.parents[i]]
            order = [i for i in order if inside[i]]
        self.order = order

    def _check_images(self) -> None:
        """Refuse images but PNG and JPEG with whole headers, and more than MAX_PIXELS together."""
        self.images: list[tuple[bytes | memoryview, str]] = []
        total = 0
        for i, image in enumerate(self.document.images):
            if (image.uri is None) == (image.buffer_view is None):
                self.refuse(f"image {i} needs either a URI or a buffer view")
            data: bytes | memoryview
            if image.uri is not None:
                data = self.container.resource(image.uri, f"image {i}")
            else:
                data = self.view(image.buffer_view, f"image {i}")[0]
            found = images.size(data)
            if found is None or min(found[1:]) < 1:
                self.refuse(f"image {i} is neither PNG nor JPEG, or cut off", "convert it")
            total += found[1] * found[2]
            if total > MAX_PIXELS:
                self.refuse(f"its images have more than {MAX_PIXELS // 10**6} megapixels", "make them smaller first")
            self.images.append((data, found[0]))

    def _check_materials(self) -> None:
        d = self.document
        for i, texture in enumerate(d.textures):
            if texture.source is not None:
                self.within(texture.source, d.images, f"texture {i}")
            if texture.sampler is not None:
                self.within(texture.sampler, d.samplers, f"the sampler of texture {i}")
        for i, material in enumerate(d.materials):
            pbr = material.pbr_metallic_roughness
            infos = (pbr.base_color_texture, pbr.metallic_roughness_texture, material.normal_texture, material.occlusion_texture)
            for info in (*infos, material.emissive_texture, *schema.textures_of(material.extensions)):
                if info is not None:
                    self.within(info.index, d.textures, f"material {i}")

    def _check_skin(self, i: int, skin: schema.Skin) -> None:
        if not 1 <= len(skin.joints) <= MAX_JOINTS:
            self.refuse(f"skin {i} has {len(skin.joints)} joints; 1 to {MAX_JOINTS} can be used", "split it")
        for joint in skin.joints:
            self.within(joint, self.document.nodes, f"skin {i}")
        if skin.inverse_bind_matrices is not None:
            what = f"the matrices of skin {i}"
            if self._typed(skin.inverse_bind_matrices, what, "MAT4", (FLOAT,)).count < len(skin.joints):
                self.refuse(f"{what} are fewer than its joints")
            self._finite(skin.inverse_bind_matrices, what)

    def _check_mesh(self, i: int, mesh: schema.Mesh) -> None:
        if not mesh.primitives:
            self.refuse(f"mesh {i} is empty")
        targets = {len(primitive.targets) for primitive in mesh.primitives}
        if len(targets) > 1 or max(targets) > MAX_TARGETS:
            self.refuse(f"mesh {i} has morph targets that do not match, or more than {MAX_TARGETS}")
        if len(mesh.weights) not in (0, max(targets)):
            self.refuse(f"mesh {i} has {len(mesh.weights)} weights for {max(targets)} morph targets")
        for primitive in mesh.primitives:
            self._check_primitive(f"mesh {i}", primitive)

    def _check_primitive(self, what: str, primitive: schema.Primitive) -> None:
        if "POSITION" not in primitive.attributes:
            self.refuse(f"{what} has no positions")
        count = self.within(primitive.attributes["POSITION"], self.document.accessors, f"the positions of {what}").count
        for name, index in primitive.attributes.items():
            self._check_attribute(name, index, count, f"{name[:20]} of {what}")
        if primitive.indices is not None:
            self._typed(primitive.indices, f"the indices of {what}", "SCALAR", UNSIGNED)
            if self.highest(primitive.indices) >= count:
                self.refuse(f"{what} names vertex {self.highest(primitive.indices)} of {count}")
        if primitive.material is not None:
            self.within(primitive.material, self.document.materials, f"the material of {what}")
        for target in primitive.targets:
            for name in ("POSITION", "NORMAL"):
                if name in target:
                    self._check_attribute(name, target[name], count, f"{name} of a morph target of {what}")
        if primitive.targets:
            self._decoded += len(primitive.targets) * count * 32  # the texture that holds them
            if self._decoded > MAX_BYTES:
                self.refuse(f"the morph targets of {what} are more than {MAX_BYTES >> 20} MiB", "make it smaller first")

    def _check_attribute(self, name: str, index: int, count: int, what: str) -> None:
        if name.startswith("TEXCOORD_"):
            wanted: tuple[str, ...] = ("VEC2",)
        elif name.startswith("COLOR_"):
            wanted = ("VEC3", "VEC4")
        elif name in ATTRIBUTES:
            wanted = (ATTRIBUTES[name],)
        else:
            self.within(index, self.document.accessors, what)
            return  # of an application, or of a set that is not used
        if self._typed(index, what, wanted, UNSIGNED[:2] if name == "JOINTS_0" else None).count != count:
            self.refuse(f"{what} has another number of vertices than the positions")
        if name == "JOINTS_0":
            self.integers(index)
        elif name == "POSITION":
            self._finite(index, what)
        else:
            self._mended(index)

    def _check_nodes(self) -> None:
        d = self.document
        draws, vertices, indices = 0, 0, 0
        for i, node in enumerate(d.nodes):
            if node.camera is not None:
                self.within(node.camera, d.cameras, f"the camera of node {i}")
            if node.extensions.light is not None:
                self.within(node.extensions.light.light, d.extensions.lights.lights, f"the light of node {i}")
            if node.skin is not None:
                self.within(node.skin, d.skins, f"the skin of node {i}")
            if node.mesh is None:
                continue
            mesh = self.within(node.mesh, d.meshes, f"the mesh of node {i}")
            draws += len(mesh.primitives)
            for primitive in mesh.primitives:
                vertices += d.accessors[primitive.attributes["POSITION"]].count
                indices += 0 if primitive.indices is None else d.accessors[primitive.indices].count
            if len(node.weights) not in (0, len(mesh.primitives[0].targets)):
                self.refuse(f"node {i} has {len(node.weights)} weights for {len(mesh.primitives[0].targets)} morph targets")
            if node.skin is not None:
                joints = len(d.skins[node.skin].joints)
                for primitive in mesh.primitives:
                    index = primitive.attributes.get("JOINTS_0")
                    if index is not None and self.highest(index) >= joints:
                        self.refuse(f"mesh {node.mesh} names joint {self.highest(index)} of {joints}")
        if draws > MAX_DRAWS:
            self.refuse(f"shows {draws} meshes, more than the limit of {MAX_DRAWS}", "join or remove some")
        if max(vertices, indices // 6) > MAX_VERTICES:
            self.refuse(f"shows {vertices} vertices, more than the limit of {MAX_VERTICES}", "make it simpler")

    def _check_animation(self, i: int, animation: schema.Animation) -> None:
        for channel in animation.channels:
            if channel.target.node is None or channel.target.path not in PATHS:
                continue  # of an extension
            what = f"animation {i}"
            node = self.within(channel.target.node, self.document.nodes, what)
            sampler = self.within(channel.sampler, animation.samplers, what)
            self._typed(sampler.input, f"the times of {what}", "SCALAR", (FLOAT,))
            times = self._finite(sampler.input, f"the times of {what}")[:, 0]
            if self._once("grows", sampler.input) and (times[0] < 0 or (np.diff(times) <= 0).any()):
                self.refuse(f"the times of {what} do not grow")
            width = PATHS[channel.target.path]
            accessor = self._typed(sampler.output, f"the values of {what}", {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width])
            self._finite(sampler.output, f"the values of {what}")
            each = 1
            if channel.target.path == "weights":
                mesh = self.within(node.mesh, self.document.meshes, f"{what} moves weights, but")
                each = len(mesh.primitives[0].targets)
            if each == 0 or accessor.count != len(times) * each * (3 if sampler.interpolation == "CUBICSPLINE" else 1):
                self.refuse(f"{what} has {accessor.count} values for {len(times)} times")

    def _check_camera(self, i: int, camera: schema.Camera) -> None:
        shape = camera.perspective if camera.type == "perspective" else camera.orthographic
        if shape is None:
            self.refuse(f"camera {i} is {camera.type}, but does not say how")
        if shape.zfar is not None and shape.zfar <= shape.znear:
            self.refuse(f"camera {i} sees from {shape.znear:g} to {shape.zfar:g}")
        if isinstance(shape, schema.Orthographic) and not (shape.xmag and shape.ymag):
            self.refuse(f"camera {i} sees nothing: its width or height is 0")
