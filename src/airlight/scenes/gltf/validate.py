"""Check whether a glTF file hangs together: every index, length and value, before anything is built from it.

What is checked is decoded too, once, so that nothing is read in two ways. What can be mended is, and a line says so.
"""

import re

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.photometry import IntensityDistribution, parse_photometry
from airlight.messages import counted, nearest
from airlight.scenes.gltf import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_DRAWS,
    MAX_INSTANCED,
    MAX_INSTANCES,
    MAX_JOINTS,
    MAX_NODES,
    MAX_PIXELS,
    MAX_TARGETS,
    MAX_VERTICES,
    images,
    schema,
)
from airlight.scenes.gltf.accessors import Accessors
from airlight.scenes.gltf.container import shown
from airlight.scenes.gltf.extensions import ignored

EXTENSIONS = frozenset(
    (
        "EXT_lights_ies",
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_avif",
        "EXT_texture_webp",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_volume",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_node_visibility",
        "KHR_texture_transform",
    )
)
FLOAT = 5126
UNSIGNED = (5121, 5123, 5125)
ATTRIBUTES = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4", "JOINTS_0": "VEC4", "WEIGHTS_0": "VEC4"}
OF_POINTS = {"_RADIUS": "radii", "_DENSITY": "densities"}  # what exporters of points call the particles' own
PATHS = {"translation": 3, "rotation": 4, "scale": 3, "weights": 1}
INSTANCED = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}


class Gltf(Accessors):
    """A file that was checked. `document` is its JSON; the methods give what it holds, decoded.

    parents: of each node, -1 for a root. order: the nodes of the scene that is shown, each behind its parent; hidden: those of them
    that KHR_node_visibility hides, by themselves or from above. scene: what was asked for, or None for the file's own choice.
    """

    def __init__(self, path: str, scene: str | None = None) -> None:
        super().__init__(path)
        self._scene = scene
        self._images: dict[int, tuple[bytes | memoryview, str]] = {}
        self._profiles: dict[int, IntensityDistribution] = {}
        self._pixels = 0
        self._told: set[str] = set()
        self._check()

    def tell(self, kind: str, what: str) -> None:
        """Warn of what is mended or left out, of the first of each kind."""
        if kind not in self._told:
            self._told.add(kind)
            warn(f"{self.container.path}: {what}", 5)

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
            inner, outer = light.spot.inner_cone_angle, light.spot.outer_cone_angle
            if light.type == "spot" and (inner > outer or not 0 < outer <= np.pi / 2 + 1e-6):  # equal ones have a sharp border
                self.tell("cone", f"light {i} has a cone from {inner:g} to {outer:g} radians, of which 0 <= inner <= outer <= 1.57 is kept")
        left = ignored(self.document.extensions_used, EXTENSIONS)
        if left:
            self.tell("ignored", f"ignored: {left}")

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
        scenes = self.document.scenes
        if scenes or self._scene is not None:
            number = self.document.scene or 0
            if self._scene is not None:
                number = self.chosen(self._scene, [scene.name for scene in scenes], "scene")
            roots = set(self.within(number, scenes, "the scene that is shown").nodes)
            inside = [False] * len(nodes)
            for root in roots:
                self.within(root, nodes, "a scene")
            for i in order:
                above = self.parents[i] != -1 and inside[self.parents[i]]
                inside[i] = above or i in roots
                if i in roots and self.parents[i] != -1:
                    at = "once" if above else "without the node above it"
                    self.parents[i] = self.parents[i] if above else -1
                    self.tell("child", f"scene {number} lists node {i}, which is the child of another; shown {at}")
            order = [i for i in order if inside[i]]
        self.order = order
        self.hidden: set[int] = set()
        for i in order:
            if not nodes[i].extensions.visibility.visible or self.parents[i] in self.hidden:
                self.hidden.add(i)

    def chosen(self, wanted: str, names: list[str], what: str) -> int:
        """Find one of the file's things by its name, or by its number, from 0."""
        for i, name in enumerate(names):
            if name == wanted:
                return i
        if re.fullmatch("[0-9]{1,9}", wanted) and int(wanted) < len(names):
            return int(wanted)
        alike = [i for i, name in enumerate(names) if name.casefold() == wanted.casefold()]
        if len(alike) == 1:
            return alike[0]
        has = ", ".join(f"{i} ({shown(name)})" if name else f"{i} (no name)" for i, name in enumerate(names[:12])) or "none"
        more = f" and {len(names) - 12} more" if len(names) > 12 else ""
        self.refuse(f"has no {what} {shown(wanted)}", f"it has {has}{more}{nearest(wanted, filter(None, names))}")

    def image(self, index: int) -> tuple[bytes | memoryview, str]:
        """Read an image that something uses: its bytes, and "png", "jpeg", "webp" or "avif"; more than MAX_PIXELS together are refused."""
        if index not in self._images:
            image = self.document.images[index]
            if (image.uri is None) == (image.buffer_view is None):
                self.refuse(f"image {index} needs either a URI or a buffer view")
            data: bytes | memoryview
            if image.uri is not None:
                data = self.container.resource(image.uri, f"image {index}")
            else:
                data = self.view(image.buffer_view, f"image {index}")[0]
            found = images.size(data)
            if found is None or min(found[1:]) < 1:
                self.refuse(f"image {index} is neither PNG, JPEG, WebP nor AVIF, or cut off", "convert it")
            self._pixels += found[1] * found[2]
            if self._pixels > MAX_PIXELS:
                self.refuse(f"its images have more than {MAX_PIXELS // 10**6} megapixels", "make them smaller first")
            self._images[index] = data, found[0]
        return self._images[index]

    def profile(self, index: int) -> IntensityDistribution:
        """Read the photometric file of a light profile."""
        if index not in self._profiles:
            profile, what = self.document.extensions.profiles.lights[index], f"light profile {index}"
            if (profile.uri is None) == (profile.buffer_view is None):
                self.refuse(f"{what} needs either a URI or a buffer view")
            uri = profile.uri
            data = bytes(self.view(profile.buffer_view, what)[0] if uri is None else self.container.resource(uri, what))
            self._profiles[index] = parse_photometry(data, f"{self.container.path}: {what}")
        return self._profiles[index]

    def source(self, texture: int) -> int | None:
        """Choose the image of a texture: of WebP or AVIF if it is there, else what stands in for that."""
        found: schema.Texture = self.document.textures[texture]
        if found.source is None and found.extensions.basisu is not None:
            self.tell("basisu", "textures of KHR_texture_basisu are left out: save them as PNG, JPEG or WebP")
        better = [one.source for one in (found.extensions.avif, found.extensions.webp) if one is not None and one.source is not None]
        if better and found.source is not None and not images.readable(self._beginning(better[0])):
            return found.source
        return better[0] if better else found.source

    def _beginning(self, index: int) -> bytes | memoryview:
        """Read an image whose format may be another than its extension says, or which may be missing; nothing then."""
        image = self.document.images[index]
        if image.buffer_view is not None:
            return self.view(image.buffer_view, f"image {index}")[0]
        try:
            return self.image(index)[0]
        except AirlightError:
            return b""

    def _check_materials(self) -> None:
        d = self.document
        for i, texture in enumerate(d.textures):
            if texture.source is not None:
                self.within(texture.source, d.images, f"texture {i}")
            for other in (texture.extensions.avif, texture.extensions.webp):
                if other is not None and other.source is not None:
                    self.within(other.source, d.images, f"texture {i}")
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
        self._unpack(primitive, what)
        count = self.within(primitive.attributes["POSITION"], self.document.accessors, f"the positions of {what}").count
        for name, index in primitive.attributes.items():
            of_points = name in OF_POINTS and primitive.mode == 0
            self._check_attribute(OF_POINTS[name] if of_points else name, index, count, f"{name[:20]} of {what}")
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
        elif name in OF_POINTS.values():
            wanted = ("SCALAR",)
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
        draws, vertices, indices, instances, instanced = 0, 0, 0, 0, 0
        for i, node in enumerate(d.nodes):
            if node.camera is not None:
                self.within(node.camera, d.cameras, f"the camera of node {i}")
            if node.extensions.light is not None:
                self.within(node.extensions.light.light, d.extensions.lights.lights, f"the light of node {i}")
            if node.extensions.profile is not None:
                self.within(node.extensions.profile.light, d.extensions.profiles.lights, f"the light profile of node {i}")
                self.profile(node.extensions.profile.light)
            if node.skin is not None:
                self.within(node.skin, d.skins, f"the skin of node {i}")
            if node.mesh is None:
                continue
            mesh = self.within(node.mesh, d.meshes, f"the mesh of node {i}")
            draws += len(mesh.primitives)
            many = 1
            if node.extensions.instancing is not None:
                many = self._check_instances(i, node.extensions.instancing)
                instances += many * len(mesh.primitives)
            for primitive in mesh.primitives:
                instanced += d.accessors[primitive.attributes["POSITION"]].count * (many if primitive.mode > 3 else 16 * many)
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
        if instances > MAX_INSTANCES or instanced > MAX_INSTANCED:
            self.refuse(f"shows {instances} instances, {instanced} vertices, beyond {MAX_INSTANCES} and {MAX_INSTANCED}", "thin it out")

    def _check_instances(self, i: int, instancing: schema.Instancing) -> int:
        """Count the instances of a node."""
        counts = set()
        for name, index in instancing.attributes.items():
            if name in INSTANCED:
                what = f"{name} of the instances of node {i}"
                counts.add(self._typed(index, what, (INSTANCED[name],)).count)
                self._finite(index, what)
        if len(counts) > 1:
            self.refuse(f"the instances of node {i} are {' or '.join(map(str, sorted(counts)))}")
        return counts.pop() if counts else 1

    def _check_animation(self, i: int, animation: schema.Animation) -> None:
        for channel in animation.channels:
            if channel.target.node is None or channel.target.path not in PATHS:
                continue  # of an extension
            what = f"animation {i}"
            node = self.within(channel.target.node, self.document.nodes, what)
            sampler = self.within(channel.sampler, animation.samplers, what)
            self._typed(sampler.input, f"the times of {what}", "SCALAR", (FLOAT,))
            times = self._finite(sampler.input, f"the times of {what}")[:, 0]
            if self._once("grows", sampler.input):
                if (np.diff(times) < 0).any():
                    self.refuse(f"the times of {what} do not grow")
                if times[0] < 0:
                    self.tell("early", f"{what} begins at {times[0]:g} s; shown from 0 s on")
                if (np.diff(times) == 0).any():
                    self.tell("twice", f"{what} has two keys at one time; the later one counts from then on")
            width = PATHS[channel.target.path]
            accessor = self._typed(sampler.output, f"the values of {what}", {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width])
            self._finite(sampler.output, f"the values of {what}")
            each = 1
            if channel.target.path == "weights":
                mesh = self.within(node.mesh, self.document.meshes, f"{what} moves weights, but")
                each = len(mesh.primitives[0].targets)
            if each == 0 or accessor.count != len(times) * each * (3 if sampler.interpolation == "CUBICSPLINE" else 1):
                self.refuse(f"{what} has {counted(accessor.count, 'value')} for {counted(len(times), 'time')}")

    def _check_camera(self, i: int, camera: schema.Camera) -> None:
        shape = camera.perspective if camera.type == "perspective" else camera.orthographic
        if shape is None:
            self.refuse(f"camera {i} is {camera.type}, but does not say how")
        if shape.zfar is not None and shape.zfar <= shape.znear:
            self.refuse(f"camera {i} sees from {shape.znear:g} to {shape.zfar:g}")
        if isinstance(shape, schema.Orthographic) and not (shape.xmag and shape.ymag):
            self.refuse(f"camera {i} sees nothing: its width or height is 0")
