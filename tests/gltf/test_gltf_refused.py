"""glTF files that are refused: what is wrong in them, and where their parts lie."""

import json
import os
import struct
from collections.abc import Callable
from pathlib import Path

import gltfs
import numpy as np
import pytest
from gltf_stage import Eye, agrees, corners, drawn, flat, refused
from gltfs import SQUARE, SQUARE_FACES, SQUARE_UV, TRIANGLE, Writer, glb

from airlight.errors import AirlightError
from airlight.scenes import open_scene


def document(change: Callable[[dict], object]) -> bytes:
    text, binary = gltfs.parts(gltfs.everything().glb())
    change(text)
    return glb(json.dumps(text).encode(), binary)


def put(*path: object) -> Callable[[dict], object]:
    """put("nodes", 0, "mesh", 7) sets json["nodes"][0]["mesh"] = 7."""

    def change(json: dict) -> None:
        *way, last, value = path
        for key in way:
            json = json[key]
        json[last] = value

    return change


def circle(json: dict) -> None:
    json["nodes"] += [{"children": [len(json["nodes"]) + 1]}, {"children": [len(json["nodes"])]}]


def chain(json: dict) -> None:
    first = len(json["nodes"])
    json["nodes"] += [{"children": [first + i + 1]} for i in range(300)] + [{}]


def tall(json: dict) -> None:
    json["accessors"] += [{"componentType": 5126, "type": "VEC3", "count": 2**30}]
    json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = len(json["accessors"]) - 1


REFUSED = [
    (put("asset", "version", "1.0"), "glTF of version '1.0'"),
    (put("asset", "minVersion", "2.1"), "glTF of version '2.1'"),
    (put("extensionsRequired", ["KHR_texture_basisu"]), "needs 'KHR_texture_basisu'"),
    (put("nodes", 0, "children", [99]), "a child of node 0 names number 99"),
    (put("nodes", 0, "children", [1, 1]), "two parents"),
    (put("nodes", 1, "children", [0]), "circle|has a parent"),
    (circle, "in a circle"),
    (chain, "deeper than 256"),
    (put("scene", 3), "names number 3 of 1"),
    (put("nodes", 1, "mesh", 44), "names number 44"),
    (put("nodes", 4, "skin", 44), "names number 44"),
    (put("nodes", 1, "weights", [1]), "1 weights for 2 morph targets"),
    (put("meshes", 0, "primitives", []), "mesh 0 is empty"),
    (put("meshes", 0, "primitives", 0, "attributes", {}), "has no positions"),
    (put("meshes", 0, "primitives", 0, "material", 9), "names number 9 of 5"),
    (put("accessors", 0, "count", 10**6), "ends behind the end|another number of vertices"),
    (put("accessors", 0, "count", 0), "not that of glTF 2.0"),
    (put("accessors", 0, "componentType", 5124), "not that of glTF 2.0"),
    (put("accessors", 0, "type", "MAT2"), "wrong type|ends behind"),
    (put("accessors", 0, "byteOffset", 2**40), "ends behind"),
    (put("bufferViews", 2, "byteLength", 2**39), "ends behind"),
    (put("bufferViews", 2, "byteStride", 2), "every 2 bytes"),
    (put("bufferViews", 2, "buffer", 5), "names number 5 of 1"),
    (put("buffers", 0, "byteLength", 2**33), "instead of 8589934592"),
    (put("buffers", 0, "uri", "http://localhost/x.bin"), "not a place in its folder"),
    (tall, "more than the limits|another number"),
    (put("materials", 0, "normalTexture", "index", 8), "names number 8"),
    (put("textures", 0, "source", 8), "names number 8"),
    (put("textures", 0, "sampler", 8), "names number 8"),
    (put("images", 0, "bufferView", 1), "neither PNG, JPEG, WebP nor AVIF"),
    (put("images", 0, {"bufferView": 0, "uri": "x.png"}), "either a URI or a buffer view"),
    (put("skins", 0, "joints", []), "has 0 joints"),
    (put("skins", 0, "joints", [0, 0, 0]), "fewer than its joints"),
    (put("skins", 0, "joints", [0]), "names joint 1 of 1"),
    (put("animations", 0, "channels", 0, "sampler", 8), "names number 8"),
    (put("animations", 0, "samplers", 0, "input", 0), "wrong type"),
    (put("animations", 0, "samplers", 0, "interpolation", "CUBICSPLINE"), "values for 2 times"),
    (put("cameras", 0, "perspective", "yfov", 4), "not that of glTF 2.0"),
    (put("cameras", 0, "perspective", "zfar", 0.05), "camera 0 sees from 0.1 to 0.05"),
    (put("cameras", 0, "type", "orthographic"), "camera 0 is orthographic, but does not say how"),
    (put("extensions", "KHR_lights_punctual", "lights", 0, "intensity", -1), "not that of glTF 2.0"),
    (put("nodes", 0, "scale", [1e9, 1e9, 1e9]), "reaches farther"),
    (put("nodes", 0, "translation", [1e300, 0, 0]), "not that of glTF 2.0"),
    (put("nodes", [{} for _ in range(20001)]), "20001 nodes"),
    (put("scenes", 0, "nodes", []), "shows nothing"),
]


@pytest.mark.parametrize("change, words", REFUSED, ids=[words[:30] for _, words in REFUSED])
def test_refused(change: Callable[[dict], object], words: str, tmp_path: Path) -> None:
    refused(tmp_path, document(change), words)


def test_values_that_are_no_numbers(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]))
    refused(tmp_path, w.glb(), "POSITION of mesh 0 holds values that are not numbers")
    w = Writer()
    node = w.node(mesh=w.mesh(TRIANGLE, NORMAL=[[0, np.inf, 1]] * 3))
    (mesh,) = drawn(open_scene(w.save(tmp_path), "none"))
    assert mesh.geometry.normals.data.tolist() == [[0, 0, 1]] * 3  # mended
    w.animate(node, "translation", [1, 0], [[0, 0, 0]] * 2)
    refused(tmp_path, w.glb(), "times of animation 0 do not grow")
    for bad in (b'{"asset": {"version": "2.0"}, "scene": NaN}', b'{"asset": {"version": "2.0"}, "nodes": [{"scale": [1e999, 1, 1]}]}'):
        refused(tmp_path, bad, "not that of glTF 2.0", "scene.gltf")


def test_vertices_and_sparse_elements_out_of_range(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE, [0, 1, 3]))
    refused(tmp_path, w.glb(), "names vertex 3 of 3")
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    indices, values = {"bufferView": w.view(b"\x03"), "componentType": 5121}, {"bufferView": w.view(bytes(12))}
    w.json["accessors"][0]["sparse"] = {"count": 1, "indices": indices, "values": values}
    refused(tmp_path, w.glb(), "names element 3 of 3")
    w.json["accessors"][0].pop("bufferView")
    w.json["accessors"][0]["count"] = 10**6
    refused(tmp_path, w.glb(), "more than the file has bytes")


def test_json_that_nests_or_swells(tmp_path: Path) -> None:
    refused(tmp_path, b'{"asset": {"version": "2.0"}, "extras": ' + b"[" * 10**6, "nested too deeply", "scene.gltf")
    refused(tmp_path, b"[" * 5 * 10**6, "more than 4194304 JSON values", "scene.gltf")
    refused(tmp_path, b'{"asset": {"version": "2.0"}, "scene": ' + b"9" * 6000 + b"}", "not that of glTF 2.0", "scene.gltf")
    refused(tmp_path, b"", "not that of glTF 2.0", "scene.gltf")
    refused(tmp_path, b'{"asset": {"version": "\xff"}}', "not that of glTF 2.0", "scene.gltf")


def test_chunks(tmp_path: Path) -> None:
    good = gltfs.everything().glb()
    refused(tmp_path, good[:10], "cut off")
    refused(tmp_path, good[:-40], "says that it has")
    refused(tmp_path, b"glTF" + struct.pack("<I", 1) + good[8:], "GLB of version 1")
    refused(tmp_path, good[:12] + struct.pack("<I", 2**31) + good[16:], "chunk that ends behind")
    refused(tmp_path, good[:16] + b"BIN\0" + good[20:], "does not begin with JSON")
    refused(tmp_path, b"{}", "does not begin as GLB does")
    refused(tmp_path, glb(gltfs.everything().text()), "buffer 0 has no contents")


def test_depth_at_the_limit(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    node = None
    for _ in range(256):
        node = w.node(node, translation=[0, 0, 0.001])
    w.node(node, mesh=w.mesh(TRIANGLE, [0, 1, 2], flat(w)))
    w.animate(0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    agrees(eye, stage)


def scene_with(uri: str) -> bytes:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    return w.gltf(uri)


def test_buffers_beside_within_and_below(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    below = tmp_path / "a b"
    below.mkdir()
    (below / "it.bin").write_bytes(w.binary)
    os.symlink(below / "it.bin", tmp_path / "link.bin")
    for uri in ("a%20b/it.bin", "./a b/it.bin", "a b/../link.bin", None):
        (tmp_path / "scene.gltf").write_bytes(w.gltf(uri))
        np.testing.assert_allclose(corners(open_scene(tmp_path / "scene.gltf", "none")), TRIANGLE)


@pytest.mark.parametrize(
    "uri",
    ["../it.bin", "%2e%2e/it.bin", "/etc/passwd", "file:///etc/passwd", "http://127.0.0.1:9/x", "a/../../it.bin", "..\\it", "C:it", "a\0b"],
)
def test_places_outside(uri: str, tmp_path: Path) -> None:
    (tmp_path / "it.bin").write_bytes(bytes(100))
    inner = tmp_path / "inner"
    inner.mkdir()
    refused(inner, scene_with(uri), "not a place in its folder|outside its folder", "scene.gltf")


def test_links_out_and_things_that_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "it.bin").write_bytes(bytes(100))
    inner = tmp_path / "inner"
    inner.mkdir()
    os.symlink(tmp_path / "it.bin", inner / "link.bin")
    refused(inner, scene_with("link.bin"), "outside its folder", "scene.gltf")
    os.symlink("/dev/zero", inner / "zero.bin")
    refused(inner, scene_with("zero.bin"), "outside its folder", "scene.gltf")
    os.mkfifo(inner / "pipe.bin")
    refused(inner, scene_with("pipe.bin"), "not a regular file", "scene.gltf")
    (inner / "folder.bin").mkdir()
    refused(inner, scene_with("folder.bin"), "not a regular file", "scene.gltf")
    refused(inner, scene_with("missing.bin"), "No such file", "scene.gltf")
    refused(inner, scene_with("data:,abc"), "not in base64", "scene.gltf")
    refused(inner, scene_with("data:;base64,@@@"), "damaged base64", "scene.gltf")
    os.mkfifo(inner / "pipe.glb")
    with pytest.raises(AirlightError, match="not a regular file"):
        open_scene(inner / "pipe.glb")
    with pytest.raises(AirlightError, match="No such file"):
        open_scene(tmp_path / "none.glb")
    with pytest.raises(AirlightError, match="give table, flying, or a"):
        open_scene("sofa")


def test_files_larger_than_the_limit(tmp_path: Path) -> None:
    with open(tmp_path / "big.bin", "wb") as file:
        file.truncate(2**29 + 1)  # sparse
    refused(tmp_path, scene_with("big.bin"), "larger than the limit of 512 MiB", "scene.gltf")


def test_images_that_are_bombs_or_damaged(tmp_path: Path) -> None:
    good = gltfs.png(np.random.default_rng(1).integers(0, 256, (16, 16, 4), np.uint8))
    huge = good[:16] + struct.pack(">II", 30000, 30000) + good[24:]
    for data, words in ((huge, "megapixels"), (good[:600], "image 0: is damaged"), (b"RIFF" + bytes(40), "neither PNG, JPEG, WebP")):
        w = Writer()
        w.add("images", bufferView=w.view(data))
        material = w.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": w.add("textures", source=0)}})
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
        refused(tmp_path, w.glb(), words)
