"""Compressed meshes: Draco's and meshoptimizer's, against the shapes that were compressed, whole and damaged."""

import json
import random
import resource
import struct
import time
from pathlib import Path
from typing import Any

import DracoPy
import gltfs
import numpy as np
import pygfx as gfx
import pytest
from fuzzing import mutate
from gltf_stage import drawn, refused
from gltfs import Writer

from airlight.errors import AirlightError
from airlight.scenes import open_scene
from airlight.scenes.gltf import draco, meshopt
from airlight.scenes.gltf.meshes import vertices
from airlight.scenes.gltf.validate import Gltf

MESHOPT = Path(__file__).parents[1] / "data" / "cases" / "meshopt.glb"


# ---------------------------------------------------------------- Draco


def sheet(n: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """A sheet with bumps: positions, triangles."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    i = np.arange(n * n).reshape(n, n)
    faces = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[:-1, :-1], i[1:, 1:], i[1:, :-1]], -1).reshape(-1, 3)
    return np.stack([u, v, np.sin(3 * u) * v], -1).reshape(-1, 3).astype(np.float32), faces.astype(np.uint32)


def packed(**more: Any) -> tuple[Writer, bytes]:
    """A skinned sheet in Draco's compression, and the compressed bytes."""
    positions, faces = sheet()
    share = ((positions[:, :1] + 1) / 2).astype(np.float32)
    weights = np.concatenate([share, 1 - share, 0 * share, 0 * share], axis=1)
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (len(positions), 1))
    uv = (positions[:, :2] + 1).astype(np.float64) / 2
    normals = np.tile([0.0, 0.0, 1.0], (len(positions), 1))
    own = {40: joints, 41: weights}
    more = {"quantization_bits": 16, "normals": normals, "tex_coord": uv, "generic_attributes": own, **more}
    data = DracoPy.encode(positions, faces, **more)
    ids = {one["attribute_type"]: one["unique_id"] for one in DracoPy.decode(data).attributes if one["attribute_type"] != 4}
    w = Writer()
    shapes = (("POSITION", "VEC3", 5126, ids[0]), ("NORMAL", "VEC3", 5126, ids[1]), ("TEXCOORD_0", "VEC2", 5126, ids[3]))
    shapes += (("JOINTS_0", "VEC4", 5121, 40), ("WEIGHTS_0", "VEC4", 5126, 41))
    primitive: dict[str, Any] = {"attributes": {}, "extensions": {}}
    for name, kind, component, _ in shapes:
        primitive["attributes"][name] = w.add("accessors", componentType=component, count=len(positions), type=kind)
    primitive["indices"] = w.add("accessors", componentType=5123, count=faces.size, type="SCALAR")
    numbers = {name: number for name, _, _, number in shapes}
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": w.view(data), "attributes": numbers}}
    skin = w.add("skins", joints=[w.node(translation=[0, 1, 0]), w.node(translation=[0, -1, 0])])
    w.node(mesh=w.add("meshes", primitives=[primitive]), skin=skin)
    w.json["extensionsUsed"] = w.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return w, data


def rows(array: np.ndarray) -> np.ndarray:
    """Rows in an order of their own: Draco keeps none."""
    return array[np.lexsort(np.round(array, 3).T)]


@pytest.mark.parametrize("more", [{}, {"preserve_order": True}, {"compression_level": 10}, {"create_metadata": True}])
def test_draco_gives_back_all_attributes_by_their_numbers(more: dict[str, Any], tmp_path: Path) -> None:
    w, data = packed(**more)
    positions, faces = sheet()
    assert draco.counts(data) == (len(faces), len(positions))
    (mesh,) = drawn(open_scene(w.save(tmp_path), "none"))
    found = mesh.geometry
    assert isinstance(mesh, gfx.SkinnedMesh)
    at = found.positions.data
    np.testing.assert_allclose(rows(at), rows(positions), atol=1e-4)
    np.testing.assert_allclose(found.texcoords.data, (at[:, :2] + 1) / 2, atol=1e-4)
    np.testing.assert_allclose(found.skin_weights.data[:, :2], np.stack([(at[:, 0] + 1) / 2, (1 - at[:, 0]) / 2], 1), atol=1e-3)
    assert found.skin_indices.data.tolist() == [[0, 1, 0, 0]] * len(at)
    np.testing.assert_allclose(found.normals.data, [[0, 0, 1]] * len(at), atol=1e-3)
    middles = [np.sort(p[f].mean(axis=1).round(3), axis=0) for p, f in ((at, found.indices.data), (positions, faces))]
    np.testing.assert_allclose(*middles, atol=2e-3)
    np.testing.assert_allclose(vertices(mesh)[:, 1], at[:, 1] + at[:, 0], atol=1e-3)  # the left joint is 2 lower


def test_draco_quantised_and_sparse(tmp_path: Path) -> None:
    """Integers that an accessor normalises, and a sparse accessor over what Draco gave."""
    positions, faces = sheet(3)
    codes = np.rint((positions + 1) * 127).astype(np.uint8)
    data = DracoPy.encode(positions, faces, preserve_order=True, generic_attributes={5: codes})
    w = Writer()
    at = w.add("accessors", componentType=5121, count=9, type="VEC3", normalized=True)
    primitive = {"attributes": {"POSITION": at}, "indices": w.add("accessors", componentType=5121, count=faces.size, type="SCALAR")}
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": w.view(data), "attributes": {"POSITION": 5}}}
    w.node(mesh=w.add("meshes", primitives=[primitive]))
    np.testing.assert_array_equal(vertices(drawn(open_scene(w.save(tmp_path), "none"))[0]), codes / np.float32(255))
    indices, values = {"bufferView": w.view(b"\4"), "componentType": 5121}, {"bufferView": w.view(b"\xff\0\xff")}
    w.json["accessors"][at]["sparse"] = {"count": 1, "indices": indices, "values": values}
    found = vertices(drawn(open_scene(w.save(tmp_path), "none"))[0])
    assert found[4].tolist() == [1, 0, 1] and (found[3] == codes[3] / np.float32(255)).all()


def test_draco_that_is_not_what_the_file_says(tmp_path: Path) -> None:
    w, data = packed()
    view = w.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["bufferView"]
    for change, words in (
        (lambda: w.json["accessors"][0].update(type="VEC2"), "of a wrong type|81 x 3 values instead of 81 x 2"),
        (lambda: w.json["accessors"][0].update(type="VEC3", componentType=5123), "attribute .* is float32 instead of uint16"),
        (lambda: w.json["accessors"][0].update(componentType=5126), None),
        (lambda: w.json["accessors"][5].update(count=9), "its header says 128 triangles"),
        (lambda: w.json["accessors"][5].update(count=2**30), "more than the limits"),
        (lambda: w.json["accessors"][5].update(count=384, componentType=5126), "list of triangles is uint32 instead of float32"),
        (lambda: w.json["accessors"][5].update(componentType=5123), None),
        (lambda: w.json["meshes"][0]["primitives"][0].update(mode=5), "not made of indexed triangles"),
        (lambda: w.json["meshes"][0]["primitives"][0].update(mode=4), None),
        (lambda: w.json["accessors"][5].update(count=999), None),  # degenerate triangles are dropped by encoders
        (lambda: [w.json["accessors"][i].update(count=99) for i in range(5)], None),
        (lambda: w.json["bufferViews"][view].update(byteLength=len(data) // 2), "is not what Draco writes"),
    ):
        change()
        if words is not None:
            refused(tmp_path, w.glb(), words)
        else:
            open_scene(w.save(tmp_path), "none")


def test_draco_headers_that_lie(tmp_path: Path) -> None:
    """Sequential and edge-breaking meshes of very many triangles: refused before Draco's own code makes room for them."""
    for method, body in ((0, b"\xff\xff\xff\xff\x0f\x03"), (1, b"\0\x03\xff\xff\xff\xff\x0f")):
        data = b"DRACO" + bytes((2, 2, 1, method)) + struct.pack("<H", 0) + body + bytes(50)
        with pytest.raises(ValueError, match="its header says 4294967295 triangles"):
            draco.decode(data, 3000, 2**27)
    for data in (b"", b"DRACO", b"DRACO\2\2\1\1\0\x80" + b"\xff" * 11, b"DRACO\1\2\1\1\0\0", b"DRACO\2\2\0\0\0\0"):
        with pytest.raises(ValueError, match=r"it is (cut off|of version)|does not begin|header is damaged"):
            draco.counts(data)


# ---------------------------------------------------------------- meshoptimizer


def ring() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The torus that the file holds: positions, normals, triangles."""
    n, k = 24, 12
    a, b = np.meshgrid(*(np.linspace(0, 2 * np.pi, count, endpoint=False) for count in (n, k)), indexing="ij")
    normals = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], -1).reshape(-1, 3)
    i = np.arange(n * k).reshape(n, k)
    j, right = np.roll(i, -1, 0), np.roll(i, -1, 1)
    faces = np.stack([i, j, np.roll(j, -1, 1), i, np.roll(j, -1, 1), right], -1).reshape(-1, 3)
    return np.stack([np.cos(a), np.sin(a), 0 * a], -1).reshape(-1, 3) + 0.35 * normals, normals, faces


def turned(faces: np.ndarray) -> np.ndarray:
    """Triangles, each begun at its least vertex: encoders begin where they like."""
    return np.array([np.roll(face, -int(face.argmin())) for face in faces])


def test_meshopt_gives_back_what_its_encoder_was_given() -> None:
    stage = open_scene(MESHOPT, "none")
    left, right, line = drawn(stage)
    positions, normals, faces = ring()
    at = [np.asarray(thing.world.matrix)[:3, 3] for thing in (left, right)]
    for thing, place, tolerance in ((left, at[0], 1e-4), (right, at[1], 1e-5)):
        np.testing.assert_allclose(vertices(thing) - place, positions, atol=tolerance)
        np.testing.assert_array_equal(turned(thing.geometry.indices.data), turned(faces))
        np.testing.assert_allclose(thing.geometry.normals.data, normals, atol=0.02)
    np.testing.assert_allclose(right.geometry.colors.data[:, :3], (normals + 1) / 2, atol=0.03)
    np.testing.assert_allclose(right.geometry.colors.data[:, 3], 1)
    np.testing.assert_allclose(line.geometry.positions.data, positions[[*range(0, len(positions), 12), 0]], atol=1e-5)
    for t in (0.25, 0.5, 1.0):
        stage.pose(t - 1e-9, None)
        c, s = np.cos(0.8 * np.pi * t), np.sin(0.8 * np.pi * t)
        spun = positions @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
        np.testing.assert_allclose(vertices(right) - at[1], spun, atol=2e-3)


def streams() -> list[tuple[bytes, int, int, str, str]]:
    """The compressed views of the file: data, count, stride, mode, filter."""
    document, binary = gltfs.parts(MESHOPT.read_bytes())
    found = []
    for view in document["bufferViews"]:
        for one in view.get("extensions", {}).values():
            data = binary[one["byteOffset"] : one["byteOffset"] + one["byteLength"]]
            found.append((data, one["count"], one["byteStride"], one["mode"], one.get("filter", "NONE")))
    return found


def test_all_kinds_of_streams_are_in_the_file() -> None:
    assert {(data[0], mode) for data, _, _, mode, _ in streams()} == {
        (0xA0, "ATTRIBUTES"), (0xA1, "ATTRIBUTES"), (0xE0, "TRIANGLES"), (0xE1, "TRIANGLES"), (0xD1, "INDICES")
    }  # fmt: skip
    assert {filter for *_, filter in streams()} == {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"}


def test_words_of_attributes_may_be_summed_or_turned() -> None:
    """Two elements by hand: bytes, words of two and of four bytes that are combined with what was before."""
    for channel, step, expected in (
        (0, b"\x02\x01\0\0", b"\x02\x01\x04\x05"),  # signs are in the lowest bit: 1, -1
        (1, b"\x02\0\x01\0", b"\x02\x02\x03\x05"),
        (2 | 8 << 4, b"\0\x01\0\0", bytes(a ^ b for a, b in zip(b"\x01\x02\x04\x05", b"\x01\0\0\0"))),
    ):
        base = b"\x01\x02\x04\x05"
        columns = b"".join(b"\0" + step[k : k + 1] for k in range(4))  # literal, two elements
        data = b"\xa1" + b"\xff" + columns + bytes(24 - 5) + base + bytes([channel])
        assert meshopt.decode(data, 2, 4, "ATTRIBUTES") == base + expected, channel


def test_exponents_and_colours_by_hand() -> None:
    def raw(elements: np.ndarray) -> bytes:
        """Encode literally: the first element is the base, and nothing changes after it."""
        one = elements[0].tobytes()
        return b"\xa1" + b"\xaa" * (len(one) // 4) + bytes(max(0, 24 - len(one) * 5 // 4)) + one + bytes(len(one) // 4)

    value = np.array([[(-3 << 24) | 40, (2 << 24) | (-7 & 0xFFFFFF)]], "<i4")
    assert np.frombuffer(meshopt.decode(raw(value), 1, 8, "ATTRIBUTES", "EXPONENTIAL"), "<f4").tolist() == [5, -28]
    grey = np.array([[64, 0, 0, 0x40 | 32]], np.uint8)  # seven bits: luma of 64, alpha of 64 of 127
    assert list(meshopt.decode(raw(grey), 1, 4, "ATTRIBUTES", "COLOR")) == [129, 129, 129, 129]
    red = np.array([[32, 63, 256 - 32, 0x7F]], np.uint8)  # r = y + co - cg, g = y + cg, b = y - co - cg
    assert list(meshopt.decode(raw(red), 1, 4, "ATTRIBUTES", "COLOR")) == [255, 0, 2, 255]


def test_meshopt_views_that_are_too_large_or_wrong(tmp_path: Path) -> None:
    def changed(**more: Any) -> bytes:
        document, binary = gltfs.parts(MESHOPT.read_bytes())
        document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"].update(more)
        return gltfs.glb(json.dumps(document).encode(), binary)

    refused(tmp_path, changed(count=2**30), "buffer view 0 is more than the limits")
    refused(tmp_path, changed(count=10**6), "buffer view 0 is not what meshoptimizer writes")
    refused(tmp_path, changed(mode="TRIANGLES"), "buffer view 0 is not what meshoptimizer writes")
    refused(tmp_path, changed(filter="EXPONENTIAL", byteStride=7), "buffer view 0 is not what|ends behind|every 7")
    refused(tmp_path, changed(byteLength=2**33), "ends behind the end of its buffer")
    refused(tmp_path, changed(mode="OTHER"), "not that of glTF 2.0")


# ---------------------------------------------------------------- damage


@pytest.mark.parametrize("kind", ["draco", "meshopt"])
def test_damaged_streams_are_refused_or_read_soon_and_in_little_memory(kind: str) -> None:
    """Bytes changed, cut off, repeated: a ValueError or a result, and nothing else."""
    whole = packed()[1]
    before, longest, read = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0.0, 0
    for i in range(600):
        chance = random.Random(f"{kind}:{i}")
        source, *shape = (whole,) if kind == "draco" else chance.choice(streams())
        data = bytearray(source)
        if chance.random() < 0.6:
            for _ in range(chance.choice((1, 2, 5))):
                data[chance.randrange(chance.choice((24, len(data))))] = chance.randrange(256)
        else:
            data = bytearray(mutate(chance, bytes(data), bytes(source)))
        start = time.monotonic()
        try:
            draco.decode(bytes(data), 3000, 2**27) if kind == "draco" else meshopt.decode(bytes(data), *shape)
            read += 1
        except ValueError:
            pass
        longest = max(longest, time.monotonic() - start)
    assert 30 < read < 570 and longest < 2
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # KiB


def test_damaged_files_are_refused_in_one_line(tmp_path: Path) -> None:
    good, path = MESHOPT.read_bytes(), tmp_path / "it.glb"
    begin = len(good) - len(gltfs.parts(good)[1])
    for i in range(60):
        chance = random.Random(i)
        data = bytearray(good)
        data[chance.randrange(begin, len(good))] ^= 1 << chance.randrange(8)
        path.write_bytes(data)
        try:
            Gltf(str(path))
        except AirlightError as error:
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error) and "; " in str(error)
