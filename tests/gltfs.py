"""Small glTF files for the tests, built from arrays."""

import base64
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

KINDS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def png(pixels: np.ndarray) -> bytes:
    """(H, W, 4) uint8."""
    height, width = pixels.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    out = b"\x89PNG\r\n\x1a\n"
    for name, body in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
        out += struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    return out


class Writer:
    """json: the document, to be changed at will; add_*: append and give the index."""

    def __init__(self) -> None:
        self.binary = b""
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}

    def add(self, kind: str, **thing: Any) -> int:
        self.json.setdefault(kind, []).append(thing)
        return len(self.json[kind]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        at = len(self.binary)
        self.binary += data + bytes(-len(data) % 4)
        return self.add("bufferViews", buffer=0, byteOffset=at, byteLength=len(data), **more)

    def accessor(self, array: Any, kind: str = "float32", **more: Any) -> int:
        array = np.ascontiguousarray(array, dtype=kind)
        flat = array.reshape(len(array), -1)
        return self.add(
            "accessors",
            bufferView=self.view(array.tobytes()),
            componentType=KINDS[kind],
            count=len(flat),
            type=SHAPES[flat.shape[1]],
            **more,
        )

    def mesh(self, positions: Any, indices: Any = None, material: int | None = None, **more: Any) -> int:
        """more: attributes (arrays, or accessors as they are), mode, targets."""
        primitive: dict[str, Any] = {"attributes": {"POSITION": self.accessor(positions)}}
        for name in ("mode", "targets"):
            if name in more:
                primitive[name] = more.pop(name)
        for name, array in more.items():
            primitive["attributes"][name] = array if isinstance(array, int) else self.accessor(array)
        if indices is not None:
            primitive["indices"] = self.accessor(indices, "uint16")
        if material is not None:
            primitive["material"] = material
        return self.add("meshes", primitives=[primitive])

    def node(self, parent: int | None = None, **more: Any) -> int:
        index = self.add("nodes", **more)
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def light(self, **light: Any) -> dict[str, Any]:
        """The extensions of the node that has it."""
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(light)
        return {"KHR_lights_punctual": {"light": len(lights) - 1}}

    def profile(self, data: bytes, **more: Any) -> dict[str, Any]:
        """The extensions of a node that has a light of EXT_lights_ies. more: multiplier, color."""
        lights = self.json.setdefault("extensions", {}).setdefault("EXT_lights_ies", {"lights": []})["lights"]
        lights.append({"bufferView": self.view(data), "mimeType": "application/x-ies-lm-63"})
        return {"EXT_lights_ies": {"light": len(lights) - 1, **more}}

    def texture(self, pixels: np.ndarray, sampler: dict[str, int] | None = None) -> int:
        image = self.add("images", bufferView=self.view(png(pixels)), mimeType="image/png")
        more = {} if sampler is None else {"sampler": self.add("samplers", **sampler)}
        return self.add("textures", source=image, **more)

    def animate(self, node: int, path: str, times: Any, values: Any, interpolation: str = "LINEAR", clip: int | None = None) -> None:
        if clip is None:
            clip = self.add("animations", channels=[], samplers=[])
        animation = self.json["animations"][clip]
        times, values = self.accessor(times), self.accessor(values)
        animation["samplers"].append({"input": times, "output": values, "interpolation": interpolation})
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}})

    def text(self) -> bytes:
        if self.binary:
            self.json["buffers"] = [{"byteLength": len(self.binary)}]
        return json.dumps(self.json).encode()

    def glb(self) -> bytes:
        return glb(self.text(), self.binary)

    def gltf(self, uri: str | None = None) -> bytes:
        """JSON with its buffer at a URI, or within."""
        document = json.loads(self.text())
        document["buffers"][0]["uri"] = uri or "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        return json.dumps(document).encode()

    def save(self, folder: Path, name: str = "scene.glb") -> str:
        path = folder / name
        path.write_bytes(self.glb())
        return str(path)


def glb(text: bytes, binary: bytes = b"") -> bytes:
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB."""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


TRIANGLE = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
SQUARE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
SQUARE_UV = [[0, 1], [1, 1], [1, 0], [0, 0]]
SQUARE_FACES = [0, 1, 2, 0, 2, 3]


def lamp() -> Writer:
    """A light with the shape of a photometric file: a seed of the fuzzer too."""
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    data = b"IESNA91\nTILT=NONE\n1 -1 1 3 2 1 2 0 0 0 1 1 9\n0 45 90\n0 90\n50 20 10\n50 30 5\n"
    w.node(extensions=w.profile(data, color=[1, 0.5, 0.2], multiplier=2), rotation=[0, 0.6, 0, 0.8])
    return w


def everything() -> Writer:
    """Something of all that is read: the seed of the fuzzer."""
    w = Writer()
    half = np.full((4, 4, 4), 200, np.uint8)
    half[:, 2:, 3] = 0
    texture = {"index": w.texture(half, {"magFilter": 9728, "wrapS": 33071})}
    w.add(
        "materials",
        pbrMetallicRoughness={"baseColorTexture": texture, "metallicRoughnessTexture": texture, "baseColorFactor": [1, 0.5, 0.2, 1]},
        normalTexture={**texture, "scale": 0.5},
        occlusionTexture={**texture, "strength": 0.5},
        emissiveTexture=texture,
        emissiveFactor=[0.1, 0.1, 0.1],
        alphaMode="MASK",
        doubleSided=True,
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
    )
    transform = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 3]}}
    w.add("materials", pbrMetallicRoughness={"baseColorTexture": {**texture, "extensions": transform}}, alphaMode="BLEND")
    w.add("materials", extensions={"KHR_materials_unlit": {}})
    w.json["extensionsUsed"] = w.json["extensionsRequired"] = ["KHR_texture_transform", "KHR_lights_punctual"]
    normals, colors = [[0, 0, 1]] * 4, w.accessor([[255, 255, 0, 128]] * 4, "uint8", normalized=True)
    target = {"POSITION": w.accessor([[0, 0, 1]] * 4), "NORMAL": w.accessor([[0, 1, 0]] * 4)}
    morph = w.mesh(SQUARE, SQUARE_FACES, 0, NORMAL=normals, TEXCOORD_0=SQUARE_UV, COLOR_0=colors, targets=[target, target])
    w.json["meshes"][morph]["weights"] = [0.2, 0]
    joints = w.accessor([[0, 1, 0, 0]] * 4, "uint8")
    skinned = w.mesh(SQUARE, SQUARE_FACES, 1, NORMAL=normals, JOINTS_0=joints, WEIGHTS_0=[[0.5, 0.5, 0, 0]] * 4)
    plain = w.mesh(SQUARE, None, 2, mode=5)
    w.json["meshes"][plain]["primitives"].append({"attributes": {"POSITION": w.accessor(TRIANGLE)}, "mode": 2})
    sparse = {"count": 1, "indices": {"bufferView": w.view(b"\1"), "componentType": 5121}, "values": {"bufferView": w.view(bytes(12))}}
    w.json["accessors"][w.json["meshes"][plain]["primitives"][0]["attributes"]["POSITION"]]["sparse"] = sparse
    root = w.node(scale=[-1, 2, 1], name="root")
    body = w.node(root, mesh=morph, translation=[1, 0, 0])
    bone = w.node(root, rotation=[0, 0, 0.7071, 0.7071])
    tip = w.node(bone, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 2, 0, 1])
    inverse = w.accessor(np.stack([np.eye(4)] * 2).reshape(2, 16))
    w.node(mesh=skinned, skin=w.add("skins", joints=[bone, tip], inverseBindMatrices=inverse))
    w.node(tip, mesh=plain)
    w.node(bone, extensions=w.light(type="spot", intensity=100, range=20, spot={"innerConeAngle": 0, "outerConeAngle": 0.5}))
    w.node(extensions=w.light(type="point", color=[1, 0.5, 0.2], intensity=50))
    many = {"TRANSLATION": w.accessor([[0, 0, 0], [1, 0, 0]]), "ROTATION": w.accessor([[0, 0, 0, 1]] * 2)}
    many["SCALE"] = w.accessor([[1, 1, 1]] * 2)
    w.node(mesh=plain, extensions={"EXT_mesh_gpu_instancing": {"attributes": many}, "KHR_node_visibility": {"visible": True}})
    w.node(extensions=w.light(type="directional"), rotation=[-0.3, 0, 0, 0.95])
    lens = {"yfov": 0.7, "znear": 0.1}
    w.node(bone, camera=w.add("cameras", type="perspective", perspective=lens), translation=[0, 0, 5], name="eye")
    w.node(camera=w.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 1, "znear": 0, "zfar": 9}))
    w.animate(bone, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, 1, 0]])
    w.animate(body, "weights", [0, 1, 2], [[0], [0], [1], [0], [0], [1]], clip=0)
    w.animate(body, "translation", [0, 1], [[0, 0, 0]] * 6, "CUBICSPLINE", 0)
    w.animate(bone, "scale", [0, 0.5], [[1, 1, 1], [2, 2, 2]], "STEP")
    glass = {"KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": texture}}
    glass["KHR_materials_volume"] = {"thicknessFactor": 0.1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.2]}
    w.add("materials", extensions=glass, pbrMetallicRoughness={"metallicFactor": 0, "baseColorTexture": texture})
    old = {"diffuseFactor": [1, 0.5, 0.2, 1], "diffuseTexture": texture, "specularFactor": [0.5, 0.5, 0.5], "glossinessFactor": 0.4}
    w.add("materials", extensions={"KHR_materials_pbrSpecularGlossiness": {**old, "specularGlossinessTexture": texture}}, alphaMode="BLEND")
    for i in (3, 4):
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, i, NORMAL=normals, TEXCOORD_0=SQUARE_UV, COLOR_0=colors))
    return w
