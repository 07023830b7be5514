"""glTF files as programs export them: what is odd but clear is mended, with a line; extensions that change the picture are followed."""

import io
import math
import warnings
from pathlib import Path
from typing import Any

import gltfs
import numpy as np
import pygfx as gfx
import pytest
from gltf_stage import Eye, agrees, corners, drawn, flat, frontal, refused, seen
from gltfs import SQUARE, SQUARE_FACES, SQUARE_UV, TRIANGLE, Writer
from PIL import Image

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.pygfx.casters import Casters
from airlight.scenes import Stage, open_scene
from airlight.scenes.gltf import images, meshes
from airlight.scenes.gltf.extensions import CHANGES, SILENT
from airlight.scenes.gltf.validate import EXTENSIONS
from airlight.scenes.triangles import of_mesh

HALF = math.sqrt(0.5)


def opened(w: Writer, folder: Path, *lines: str, **more: Any) -> Stage:
    """Open a file, which must warn of `lines` and of nothing else."""
    path = w.save(folder)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", AirlightWarning)
        stage = open_scene(path, "none", **more)
    texts = [str(one.message) for one in said if issubclass(one.category, AirlightWarning)]
    assert len(texts) == len(lines) and all(line in text for line, text in zip(lines, texts)), texts
    assert all(text.startswith(f"{path}: ") and "\n" not in text for text in texts)
    return stage


def square(**node: Any) -> Writer:
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, flat(w)), **node)
    return w


# ---------------------------------------------------------------- scales


def test_scale_tracks_of_one_in_a_chain_change_nothing(tmp_path: Path) -> None:
    """Rigs that are exported with "bake all" have such a track at each joint."""
    stages = []
    for tracks in (True, False):
        w = Writer()
        mesh, node = w.mesh(TRIANGLE), None
        for _ in range(30):
            node = w.node(node, translation=[0, 0.1, 0], rotation=[0, 0, 0.1, 0.995])
            if tracks:
                w.animate(node, "scale", [0, 1], [[1, 1, 1]] * 2, clip=0 if "animations" in w.json else None)
        w.node(node, mesh=mesh)
        stages.append(corners(opened(w, tmp_path)))
    np.testing.assert_array_equal(*stages)


@pytest.mark.parametrize("interpolation", ["LINEAR", "CUBICSPLINE"])
def test_what_is_scaled_to_nothing_vanishes_and_comes_back(interpolation: str, tmp_path: Path, eye: Eye) -> None:
    w = square()
    node = 0
    for _ in range(6):  # each of them vanishes: together they are below every float's least number
        keys: Any = [[1, 1, 1], [0, 0, 0], [-1, 1, 1]]
        if interpolation == "CUBICSPLINE":
            keys = [[0, 0, 0] if i != 1 else key for key in keys for i in range(3)]
        w.animate(node, "scale", [0, 1, 2], keys, interpolation, clip=0 if "animations" in w.json else None)
        node = w.node(node, mesh=0)
    stage = opened(w, tmp_path)
    for t, visible in ((0.0, True), (1.0, False), (1.9, True), (0.5, True), (1.0, False)):
        stage.pose(t, None)
        image = eye.linear(stage.scene, frontal())
        assert np.isfinite(image).all() and (image[..., 0].max() > 0.5) == visible, t
    stage.pose(0.5, None)
    agrees(eye, stage)  # to half of its size


def test_flat_things_are_seen_and_cast(tmp_path: Path, eye: Eye) -> None:
    w = square(scale=[1, 0.5, 0])
    stage = opened(w, tmp_path)
    agrees(eye, stage)
    assert seen(eye, stage).sum() == 32 * 16
    casters, _ = Casters(eye.renderer.device, stage.scene).gather()
    assert len(casters) == 1
    matrix = [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]  # a line
    w = square()
    w.node(mesh=0, matrix=matrix, name="line")
    stage = opened(w, tmp_path)
    assert seen(eye, stage).sum() == 32 * 32 and [thing.visible for thing in drawn(stage)] == [True, False]


def test_skins_share_joints_that_vanish_beside_morphs(tmp_path: Path, eye: Eye) -> None:
    """Two skins of the same joints, one of meshes with morph targets; a joint is scaled to 1e-9 at one key."""
    w = Writer()
    target = {"POSITION": w.accessor([[0, 0.5, 0]] * 4)}
    joints, weights = w.accessor([[0, 1, 0, 0]] * 4, "uint8"), w.accessor([[0, 1, 0, 0]] * 4)
    plain = w.mesh(SQUARE, SQUARE_FACES, flat(w), JOINTS_0=joints, WEIGHTS_0=weights)
    morph = w.mesh(SQUARE, SQUARE_FACES, flat(w), JOINTS_0=joints, WEIGHTS_0=weights, targets=[target])
    root = w.node(scale=[-1, 1, 1])
    tip = w.node(root, translation=[0.5, 0, 0])
    for mesh in (plain, morph):
        w.node(mesh=mesh, skin=w.add("skins", joints=[root, tip]), scale=[9, 9, 9])  # its own place counts for nothing
    w.animate(tip, "scale", [0, 1, 2], [[1, 1, 1], [1e-9, 1e-9, 1e-9], [1, 1, 1]])
    w.animate(3, "weights", [0, 2], [[0], [1]], clip=0)
    stage = opened(w, tmp_path)
    for t in (0.0, 0.5, 1.0, 1.75):
        stage.pose(t, None)
        size = abs(1 - t)
        places = corners(stage)
        np.testing.assert_allclose(places[:4], np.array(SQUARE) * (-size, size, size) + (-0.5, 0, 0), atol=1e-6)
        np.testing.assert_allclose(places[4:], places[:4] + (0, size * t / 4, 0), atol=1e-6)
        assert np.isfinite(eye.linear(stage.scene, frontal())).all()
        if t != 1.0:
            agrees(eye, stage)


def test_a_mirrored_skin_is_lit_as_its_vertices_are(tmp_path: Path, eye: Eye) -> None:
    """Against the same square without a skin, below the same nodes."""
    pictures = []
    tilt = [0.2, 0, 0, 0.98]
    for skinned in (True, False):
        w = Writer()
        w.node(extensions=w.light(type="directional", intensity=3), rotation=[-0.4, 0.3, 0, 0.87])
        above = w.node(scale=[-1, 1, 1], rotation=tilt)
        mesh = {"JOINTS_0": w.accessor([[0, 0, 0, 0]] * 4, "uint8"), "WEIGHTS_0": w.accessor([[1, 0, 0, 0]] * 4)} if skinned else {}
        shape = w.mesh(SQUARE, SQUARE_FACES, w.add("materials", pbrMetallicRoughness={"metallicFactor": 0}), NORMAL=[[0, 0, 1]] * 4, **mesh)
        joint = w.node(above, translation=[0.2, 0, 0])
        w.node(joint, mesh=shape, **({"skin": w.add("skins", joints=[joint])} if skinned else {}))
        stage = opened(w, tmp_path)
        stage.lights[0].target.cast_shadow = False  # of which pygfx knows no skins
        pictures.append(eye.linear(stage.scene, frontal())[..., :3])
    assert pictures[1][32, 48].max() > 0.2  # it is lit
    np.testing.assert_allclose(*pictures, atol=0.02)


# ---------------------------------------------------------------- what is mended


def test_keys_before_the_start_and_two_at_one_time(tmp_path: Path) -> None:
    w = square()
    w.animate(0, "translation", [-1, 1, 1, 2], [[-2, 0, 0], [2, 0, 0], [0, 5, 0], [0, 7, 0]])
    w.animate(0, "rotation", [-2, -1], [[0, 0, 0, 1], [0, 0, 1, 0]])
    stage = opened(w, tmp_path, "animation 0 begins at -1 s; shown from 0 s on", "animation 0 has two keys at one time")
    assert stage.duration == 2
    for t, place in ((0.0, (0, 0)), (0.5, (1, 0)), (0.999, (1.998, 0)), (1.0, (0, 5)), (1.5, (0, 6))):
        stage.pose(t, None)
        np.testing.assert_allclose(corners(stage).mean(axis=0)[:2], place, atol=1e-6)
    w = square()
    w.animate(0, "translation", [-3, -1], [[0, 0, 0], [1, 0, 0]])
    stage = opened(w, tmp_path, "begins at -3 s")
    assert stage.duration == 0 and corners(stage).mean(axis=0)[0] == 1  # all lies before: the last key holds


def test_a_scene_that_lists_a_child(tmp_path: Path) -> None:
    w = Writer()
    above = w.node(translation=[0, 1, 0])
    child = w.node(above, mesh=w.mesh(TRIANGLE))
    w.json["scenes"][0]["nodes"].append(child)
    stage = opened(w, tmp_path, "scene 0 lists node 1, which is the child of another; shown once")
    np.testing.assert_allclose(corners(stage), np.array(TRIANGLE) + (0, 1, 0))
    w.json["scenes"][0]["nodes"] = [child]
    stage = opened(w, tmp_path, "shown without the node above it")
    np.testing.assert_allclose(corners(stage), TRIANGLE)


def test_cones(tmp_path: Path) -> None:
    spots = ((0.35, 0.35, 0.35, 0), (0.6, 0.5, 0.5, 0), (0, 2, math.radians(89), 1), (0, 0, 0.001, 1))
    for inner, outer, angle, penumbra in spots:
        w = square()
        w.node(extensions=w.light(type="spot", spot={"innerConeAngle": inner, "outerConeAngle": outer}))
        lines = () if inner == outer > 0 else ("light 0 has a cone from",)  # equal ones mean a sharp border
        light = opened(w, tmp_path, *lines).lights[0].target
        assert (light.angle, light.penumbra) == pytest.approx((angle, penumbra), abs=2e-3)


def test_files_without_scenes_show_all_and_others_their_first(tmp_path: Path) -> None:
    w = square()
    w.node(mesh=0, translation=[5, 0, 0])
    del w.json["scene"]
    w.json["scenes"] = [{"nodes": [1]}, {"nodes": [0]}]
    assert corners(opened(w, tmp_path)).mean(axis=0)[0] == 5
    del w.json["scenes"]
    assert len(corners(opened(w, tmp_path))) == 8


def test_interleaved_attributes(tmp_path: Path, eye: Eye) -> None:
    w = square()
    rows = np.zeros(4, [("p", "<f4", 3), ("c", "u1", 4), ("uv", "<u2", 2)])
    rows["p"], rows["c"] = SQUARE, (0, 255, 0, 255)
    view = w.view(rows.tobytes(), byteStride=20)
    w.json["accessors"][0] = {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"}
    color = w.add("accessors", bufferView=view, byteOffset=12, componentType=5121, count=4, type="VEC4", normalized=True)
    w.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = color
    assert eye.linear(opened(w, tmp_path).scene, frontal())[32, 48, :3].tolist() == [0, 1, 0]


def test_strides_and_ranges_of_0_mean_none(tmp_path: Path) -> None:
    w = square()
    w.json["bufferViews"][0]["byteStride"] = 0
    w.node(extensions=w.light(type="point", intensity=1, range=0))
    assert opened(w, tmp_path).lights[0].target.distance == 0


def test_joints_that_are_left_out_are_told(tmp_path: Path) -> None:
    w = Writer()
    joints, weights = w.accessor([[0] * 4] * 4, "uint8"), w.accessor([[0.5, 0, 0, 0]] * 4)
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, JOINTS_0=joints, WEIGHTS_0=weights, JOINTS_1=joints, WEIGHTS_1=weights), skin=0)
    w.add("skins", joints=[w.node(translation=[0, 1, 0])])
    stage = opened(w, tmp_path, "vertices follow four joints at most")
    np.testing.assert_allclose(corners(stage), np.array(SQUARE) + (0, 1, 0))
    w.json["scenes"][0]["nodes"] = [0]
    stage = opened(w, tmp_path, "skin 0 has joints that are not in the scene", "vertices follow four joints")
    np.testing.assert_allclose(corners(stage), SQUARE)


# ---------------------------------------------------------------- extensions


def test_instances_are_the_nodes_that_they_stand_for(tmp_path: Path, eye: Eye) -> None:
    """With turns, scales and a mirror, under a node that is turned itself: pictures, casters, triangles and bounds."""
    moves = np.array([[-1.5, 0, 0], [0, 0.5, 0.2], [1.5, 0, -0.3], [0.2, -1, 0]], np.float32)
    turns = np.array([[0, 0, 0, 1], [0, 0, HALF, HALF], [0, HALF, 0, HALF], [0, 0, 0.3, 0.954]])
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    scales = np.array([[0.5, 0.5, 0.5], [0.5, 0.3, 1], [1, 1, 0.4], [-0.4, 0.4, 1]], np.float32)
    normals = [[0, 0, 1]] * 4
    both: list[Stage] = []
    for instanced in (True, False):
        w = Writer()
        w.node(extensions=w.light(type="directional", intensity=3), rotation=[-0.2, 0.1, 0, 0.97])
        mesh = w.mesh(SQUARE, SQUARE_FACES, w.add("materials", pbrMetallicRoughness={"metallicFactor": 0}), NORMAL=normals)
        above = w.node(rotation=[0, 0, 0.1, 0.995])
        if instanced:
            codes = np.rint(turns * 32767)
            attributes = {
                "TRANSLATION": w.accessor(moves),
                "ROTATION": w.accessor(codes, "int16", normalized=True),
                "SCALE": w.accessor(scales),
                "_ID": w.accessor([[1]] * 4),
            }
            w.node(above, mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
        else:
            for move, turn, scale in zip(moves, turns, scales):
                w.node(above, mesh=mesh, translation=move.tolist(), rotation=turn.tolist(), scale=scale.tolist())
        both.append(opened(w, tmp_path))
    pictures = [eye.linear(stage.scene, frontal())[..., :3] for stage in both]
    assert pictures[0].max() > 0.3
    np.testing.assert_allclose(*pictures, atol=0.01)
    np.testing.assert_allclose(*(np.sort(corners(stage), axis=0) for stage in both), atol=1e-4)
    found = [np.concatenate([of_mesh(thing) for thing in drawn(stage)]) for stage in both]
    np.testing.assert_allclose(*(np.sort(one.reshape(-1, 9), axis=0) for one in found), atol=1e-4)
    hulls = [Casters(eye.renderer.device, stage.scene).gather()[1].reshape(-1, 3) for stage in both]
    np.testing.assert_allclose(*([one.min(axis=0), one.max(axis=0)] for one in hulls), atol=0.2)
    assert both[0].radius == pytest.approx(both[1].radius, rel=1e-3)


@pytest.mark.parametrize("mode", [1, 4])
@pytest.mark.parametrize("far", [0.0, 5e5])
def test_instances_of_what_lies_far_from_its_origin(tmp_path: Path, far: float, mode: int) -> None:
    """Vertices far away, which instances bring near: as exporters write what has its transforms applied."""
    w = Writer()
    mesh = w.mesh(np.add(SQUARE, [far, 0, far]), SQUARE_FACES, w.add("materials", alphaMode="BLEND"), mode=mode)
    moves = np.array([[0, 0, 0], [3, 0, 0], [0, 5, 1]])
    attributes = {"TRANSLATION": w.accessor(moves), "SCALE": w.accessor([[1, 1, 1], [1, 1, 1], [1, -1, 1]])}
    w.node(mesh=mesh, translation=[-far, 0, -far], extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    found = corners(open_scene(w.save(tmp_path), "none"))
    wanted = np.array(SQUARE) + moves[:, None]
    for copy in wanted:
        assert np.linalg.norm(found[:, None] - copy, axis=2).min(axis=0).max() < 1e-3
    assert np.linalg.norm(found[:, None] - wanted.reshape(-1, 3), axis=2).min(axis=1).max() < 1e-3


def test_instances_of_points_lines_skins_and_nothing(tmp_path: Path, eye: Eye) -> None:
    moves = {"TRANSLATION": [[-1, 0, 0], [1, 0, 0]]}
    for mode in (0, 1, 2, 3):
        w = Writer()
        attributes = {name: w.accessor(values) for name, values in moves.items()}
        many = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
        colors = w.accessor([[1, 0, 0]] * 4)
        w.node(mesh=w.mesh(np.array(SQUARE) / 2, None, flat(w), mode=mode, COLOR_0=colors), extensions=many)
        mask = eye.linear(opened(w, tmp_path).scene, frontal())[..., 0] > 0.3
        assert mask[:, :48].any() and mask[:, 48:].any() and not mask[:, 42:54].any(), mode  # nothing joins the two
    w = square()
    scales = w.accessor([[1, 1, 1], [0, 0, 0]])
    w.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": scales}}}
    assert corners(opened(w, tmp_path)).shape == (4, 3)
    w = Writer()
    skinned = w.mesh(SQUARE, SQUARE_FACES, flat(w), JOINTS_0=w.accessor([[0] * 4] * 4, "uint8"), WEIGHTS_0=[[1, 0, 0, 0]] * 4)
    joint = w.node()
    many = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": w.accessor([[0, 0, 0], [1, 0, 0]])}}}
    w.node(mesh=skinned, skin=w.add("skins", joints=[joint]), extensions=many)
    assert len(drawn(opened(w, tmp_path, "a mesh with a skin is shown once"))) == 1


def test_instances_that_are_too_many_or_unequal(tmp_path: Path) -> None:
    w = square()
    many = w.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": w.accessor([[0, 0, 0]] * 2)}}}
    many["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = w.accessor([[1, 1, 1]] * 3)
    refused(tmp_path, w.glb(), "the instances of node 0 are 2 or 3")
    many["EXT_mesh_gpu_instancing"]["attributes"] = {"TRANSLATION": w.accessor(np.zeros((2**17 + 1, 3)))}
    refused(tmp_path, w.glb(), "shows 131073 instances")
    many["EXT_mesh_gpu_instancing"]["attributes"] = {"TRANSLATION": w.accessor([[9e8, 0, 0]])}
    refused(tmp_path, w.glb(), "reaches farther")


def test_boxes_stand_for_very_many_instances() -> None:
    mesh = gfx.InstancedMesh(gfx.sphere_geometry(1, 200, 100), gfx.MeshBasicMaterial(), 400)
    mesh.instance_buffer.data["matrix"][:, 3, 0] = np.arange(400)
    points = meshes.vertices(mesh)
    assert len(points) == 400 * 8
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[-1, -1, -1], [400, 1, 1]], atol=1e-3)


def test_hidden_nodes_show_and_shine_nothing(tmp_path: Path, eye: Eye) -> None:
    w = square()
    hidden = w.node(extensions={"KHR_node_visibility": {"visible": False}})
    below = w.node(hidden, translation=[1.5, 0, 0])
    w.node(below, mesh=0)
    w.node(below, extensions=w.light(type="point", intensity=9))
    w.node(below, camera=w.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}), name="eye")
    stage = opened(w, tmp_path)
    assert seen(eye, stage).sum() == 32 * 32 and len(drawn(stage)) == 1
    assert not any(isinstance(thing, gfx.PointLight) for thing in stage.scene.iter()) and list(stage.cameras) == ["eye"]
    w.json["nodes"][hidden]["extensions"]["KHR_node_visibility"]["visible"] = True
    assert len(drawn(opened(w, tmp_path))) == 2
    w = square(extensions={"KHR_node_visibility": {"visible": False}})
    refused(tmp_path, w.glb(), "shows nothing")


@pytest.mark.parametrize("mode", [0, 1, 3])
@pytest.mark.parametrize("kind", ["float32", "uint8", "uint16"])
@pytest.mark.parametrize("channels", [3, 4])
def test_colours_of_points_and_lines(mode: int, kind: str, channels: int, tmp_path: Path, eye: Eye) -> None:
    """Linear numbers, times the material's; alpha lets the background through."""
    w = Writer()
    most = 1 if kind == "float32" else np.iinfo(kind).max
    colors = w.accessor(np.tile(np.array([0.4, 1, 0, 1])[:channels], (2, 1)) * most, kind, normalized=kind != "float32")
    material = flat(w, pbrMetallicRoughness={"baseColorFactor": [1, 0.5, 1, 1]})
    w.node(mesh=w.mesh([[-1, 0, 0], [1, 0, 0]], None, material, mode=mode, COLOR_0=colors))
    image = eye.linear(opened(w, tmp_path).scene, frontal())
    row, column = np.unravel_index(image[..., 1].argmax(), image.shape[:2])
    np.testing.assert_allclose(image[row, column, :2], [0.4, 0.5], atol=0.02)


def encoded(color: tuple[int, int, int], kind: str) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (8, 8), color).save(out, kind, **({"lossless": True} if kind == "WEBP" else {"quality": 100}))
    return out.getvalue()


@pytest.mark.parametrize("kind, name", [("WEBP", "EXT_texture_webp"), ("AVIF", "EXT_texture_avif")])
def test_textures_of_newer_kinds_and_their_fallbacks(kind: str, name: str, tmp_path: Path, eye: Eye) -> None:
    for data, fallback, expected in (
        (encoded((255, 0, 0), kind), True, [1, 0, 0]),
        (encoded((255, 0, 0), kind), False, [1, 0, 0]),
        (b"RIFF of another kind" * 9, True, [0, 1, 0]),
    ):
        w = Writer()
        green = w.add("images", bufferView=w.view(gltfs.png(np.full((4, 4, 4), (0, 255, 0, 255), np.uint8))))
        other = w.add("images", bufferView=w.view(data))
        w.add("textures", **({"source": green} if fallback else {}), extensions={name: {"source": other}})
        material = flat(w, pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
        w.json["extensionsUsed"] = [name]
        np.testing.assert_allclose(eye.linear(opened(w, tmp_path).scene, frontal())[32, 48, :3], expected, atol=0.02)
    w.json["textures"][0].pop("source")
    refused(tmp_path, w.glb(), "image 1 is neither PNG, JPEG, WebP nor AVIF")


def test_sizes_are_read_before_anything_is_decoded(tmp_path: Path) -> None:
    for kind in ("WEBP", "AVIF", "PNG", "JPEG"):
        for more in ({}, {"lossless": True}, {"exif": b"Exif\0\0MM\0*\0\0\0\x08\0\0\0\0\0\0"}) if kind == "WEBP" else ({},):
            out = io.BytesIO()
            Image.new("RGB", (37, 21), (9, 8, 7)).save(out, kind, **more)
            assert images.size(out.getvalue()) == (kind.lower(), 37, 21), (kind, more)
            assert images.pixels(out.getvalue(), kind.lower(), "it").shape == (21, 37, 4)
    whole = encoded((1, 2, 3), "AVIF")
    at = whole.index(b"ispe")
    bomb = whole[: at + 8] + (40000).to_bytes(4, "big") * 2 + whole[at + 16 :]
    for data, words in ((bomb, "megapixels"), (whole[: len(whole) * 2 // 3], "image 0: is damaged")):
        w = Writer()
        w.add("images", bufferView=w.view(data))
        w.add("textures", extensions={"EXT_texture_avif": {"source": 0}})
        material = flat(w, pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
        refused(tmp_path, w.glb(), words)


def test_images_that_nobody_shows_are_not_opened(tmp_path: Path) -> None:
    w = square()
    w.add("images", uri="gone.png")
    w.add("images", bufferView=w.view(b"no image"))
    for image in (0, 1):
        texture = w.add("textures", source=image)
        w.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    w.mesh(SQUARE, SQUARE_FACES, 1, TEXCOORD_0=SQUARE_UV)  # of no node
    assert len(drawn(opened(w, tmp_path))) == 1


def test_basis_textures_give_way_or_are_told(tmp_path: Path, eye: Eye) -> None:
    basis = {"KHR_texture_basisu": {"source": 0}}
    w = Writer()
    w.add("images", bufferView=w.view(b"\xabKTX 20\xbb"))
    texture = w.texture(np.full((4, 4, 4), (0, 255, 0, 255), np.uint8))
    w.json["textures"][texture]["extensions"] = basis
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, flat(w, pbrMetallicRoughness={"baseColorTexture": {"index": 0}}), TEXCOORD_0=SQUARE_UV))
    assert eye.linear(opened(w, tmp_path).scene, frontal())[32, 48, :3].tolist() == [0, 1, 0]
    w.json["textures"][texture].pop("source")
    assert eye.linear(opened(w, tmp_path, "textures of KHR_texture_basisu are left out").scene, frontal())[32, 48, :3].tolist() == [1, 1, 1]


def test_what_is_ignored_is_listed_once(tmp_path: Path) -> None:
    w = square()
    for _ in range(3):
        w.add("materials", extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 1}})
    w.json["extensionsUsed"] = ["KHR_materials_unlit", "KHR_materials_clearcoat", "KHR_xmp_json_ld", "FB_own", "KHR_materials_clearcoat"]
    opened(w, tmp_path, "ignored: FB_own (unknown), KHR_materials_clearcoat (a coat of lacquer)")
    w.json["extensionsUsed"] = [f"X_{i:04}" for i in range(999)]
    opened(w, tmp_path, "X_0019 (unknown) and 979 more")
    w.json["extensionsRequired"] = ["FB_own"]
    refused(tmp_path, w.glb(), "needs 'FB_own'")


def test_no_extension_is_read_and_ignored() -> None:
    assert not EXTENSIONS & {*CHANGES, *SILENT} and not CHANGES.keys() & set(SILENT)


# ---------------------------------------------------------------- choices


def clips() -> Writer:
    w = square()
    for name, place in (("Idle", 1), ("Walk", 2), ("walk", 3), ("0", 4)):
        w.animate(0, "translation", [0], [[place, 0, 0]])
        w.json["animations"][-1]["name"] = name
    w.node(mesh=0, translation=[7, 0, 0])
    w.json["scenes"] = [{"nodes": [0], "name": "Day"}, {"nodes": [1], "name": "Night"}, {"nodes": [0, 1]}]
    return w


@pytest.mark.parametrize("wanted, place", [(None, 1), ("Walk", 2), ("walk", 3), ("1", 2), ("0", 4), ("IDLE", 1), ("2", 3)])
def test_an_animation_by_name_or_number(wanted: str | None, place: float, tmp_path: Path) -> None:
    assert corners(opened(clips(), tmp_path, animation=wanted)).mean(axis=0)[0] == pytest.approx(place)


@pytest.mark.parametrize("wanted, count, place", [(None, 4, 1), ("Night", 4, 7), ("night", 4, 7), ("2", 8, 4), ("0", 4, 1)])
def test_a_scene_by_name_or_number(wanted: str | None, count: int, place: float, tmp_path: Path) -> None:
    found = corners(opened(clips(), tmp_path, scene=wanted))
    assert len(found) == count and found.mean(axis=0)[0] == pytest.approx(place)


def test_choices_that_a_file_does_not_have(tmp_path: Path) -> None:
    path = clips().save(tmp_path)
    has = r"has no animation 'WALK'; it has 0 \('Idle'\), 1 \('Walk'\), 2 \('walk'\), 3 \('0'\)"  # two are alike
    for more, words in (
        ({"animation": "WALK"}, has),
        ({"animation": "9"}, "has no animation '9'"),
        ({"scene": "Dusk"}, r"has no scene 'Dusk'; it has 0 \('Day'\), 1 \('Night'\), 2 \(no name\)$"),
    ):
        with pytest.raises(AirlightError, match=words):
            open_scene(path, **more)
    with pytest.raises(AirlightError, match="has no scene '0'; it has none"):
        w = square()
        w.json.pop("scenes")
        open_scene(w.save(tmp_path), scene="0")
    with pytest.raises(AirlightError, match="table: has one animation at most; leave --animation out"):
        open_scene("table", animation="1")


def test_choices_on_the_command_line_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, size = clips().save(tmp_path), ["--width", "64", "--quality", "draft", "--environment", "none"]
    made = [str(tmp_path / name) for name in ("walk.png", "again.png", "first.png", "pair.png")]
    assert main(["render", path, "-o", made[0], "--animation", "walk", "--scene", "2", *size]) == 0
    assert main(["render", path, "-o", made[1], "--settings-from", made[0]]) == 0
    assert main(["render", path, "-o", made[2], "--scene", "2", *size]) == 0
    walk, again, first = (Path(name).read_bytes() for name in made[:3])
    assert walk == again != first
    assert main(["compare", path, "-o", made[3], "--animation", "run"]) == 2
    assert main(["view", made[0], "--animation", "1", "--screenshot", str(tmp_path / "v.png")]) == 2
    assert main(["view", path, "--scene", "Dawn", "--screenshot", str(tmp_path / "v.png")]) == 2
    run, picture, dawn = capsys.readouterr().err.splitlines()[-3:]
    assert "has no animation 'run'" in run and "--animation, --scene and --up are for" in picture and "has no scene 'Dawn'" in dawn


def test_an_empty_picture_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    w = square()
    w.animate(0, "scale", [0, 1], [[0, 0, 0], [1, 1, 1]])
    for name in ("left", "right"):
        w.node(camera=w.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}), translation=[0, 0, 5], name=name)
    path, size = w.save(tmp_path), ["--width", "32", "--quality", "draft", "--environment", "none", "-y", "-o", str(tmp_path / "it.png")]
    empty = "nothing of the scene is seen: place the camera by --eye x,y,z and --target x,y,z, or name one by --camera"
    for more, is_told in (
        (["--time", "0.5"], False),
        (["--time", "0.5", "--eye", "0,0,5", "--target", "0,9,5.1"], True),
        (["--time", "0"], True),  # it is scaled to nothing
    ):
        assert main(["render", path, *size, *more]) == 0
        assert (empty in capsys.readouterr().err) == is_told, more
    frames = ["--frames", "1-4", "--fps", "8", "-o", str(tmp_path / "it.#.png")]  # it appears in the second
    assert main(["render", path, *size[:-2], *frames]) == 0 and empty not in capsys.readouterr().err
