"""Meshes of glTF files: transforms, skins, morph targets, primitives, accessors."""

import math
import warnings
from pathlib import Path

import numpy as np
import pygfx as gfx
import pylinalg as la
import pytest
from gltf_stage import HAWK, SIZE, Eye, agrees, corners, flat, seen
from gltfs import SQUARE, SQUARE_FACES, TRIANGLE, Writer
from hypothesis import given
from hypothesis import strategies as st

from airlight.scenes import open_scene
from airlight.scenes.gltf import meshes
from airlight.scenes.gltf.load import model


def test_mirrored_and_nested_scales_and_sheared_matrices(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    mesh = w.mesh(TRIANGLE, [0, 1, 2], flat(w))
    a = w.node(scale=[-1, 0.5, 1], rotation=[0, 0, math.sin(0.3), math.cos(0.3)], translation=[0.5, 0, 0])
    shear = np.array([[1, 0.5, 0, 0.2], [0, 1, 0, -0.3], [0, 0, 1, 0], [0, 0, 0, 1]])
    b = w.node(a, matrix=shear.T.ravel().tolist())
    w.node(b, scale=[0.8, 1, 1], mesh=mesh)
    stage = open_scene(w.save(tmp_path), "none")
    c, s = math.cos(0.6), math.sin(0.6)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    local = np.array(TRIANGLE) * (0.8, 1, 1)
    local = local @ shear[:3, :3].T + shear[:3, 3]
    expected = (local * (-1, 0.5, 1)) @ turn.T + (0.5, 0, 0)
    np.testing.assert_allclose(corners(stage), expected, atol=1e-6)
    agrees(eye, stage)  # single-sided, mirrored once
    for scale, front in (([0.8, -1, 1], True), ([0.8, 1, -1], False), ([0.8, -1, -1], False)):
        w.json["nodes"][2]["scale"] = scale
        assert seen(eye, open_scene(w.save(tmp_path), "none")).any() == front, scale


def test_skin(tmp_path: Path, eye: Eye) -> None:
    """The joints alone place a skin; inverse bind matrices and weights that do not add up to 1."""
    w = Writer()
    root = w.node(translation=[0, -1, 0])
    tip = w.node(root, translation=[0, 1, 0])
    inverse = [np.eye(4), np.eye(4)]
    inverse[0][1, 3], inverse[1][1, 3] = 1, 0
    skin = w.add("skins", joints=[root, tip], inverseBindMatrices=w.accessor(np.stack([m.T for m in inverse]).reshape(2, 16)))
    strip = [[-0.3, -1, 0], [0.3, -1, 0], [-0.3, 0, 0], [0.3, 0, 0], [-0.3, 1, 0], [0.3, 1, 0]]
    weights = [[2, 0, 0, 0], [2, 0, 0, 0], [1, 1, 0, 0], [1, 1, 0, 0], [0, 0.5, 0, 0], [0, 0.5, 0, 0]]
    joints = w.accessor([[0, 1, 0, 0]] * 6, "uint8")
    mesh = w.mesh(strip, None, flat(w, doubleSided=True), mode=5, JOINTS_0=joints, WEIGHTS_0=weights)
    w.node(mesh=mesh, skin=skin, translation=[50, 50, 50], scale=[3, 3, 3])  # to be ignored
    half = math.sqrt(0.5)
    w.animate(tip, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, half, half]])
    stage = open_scene(w.save(tmp_path), "none")
    np.testing.assert_allclose(corners(stage), strip, atol=1e-6)
    agrees(eye, stage)
    w.animate(root, "translation", [0, 1], [[0, -1, 0], [0.5, -1, 0]], clip=0)
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    turn = np.array([[half, -half, 0], [half, half, 0], [0, 0, 1]])
    points = np.array(strip)
    still, turned = points + (0.25, 0, 0), points @ turn.T + (0.25, 0, 0)
    np.testing.assert_allclose(corners(stage), np.concatenate([still[:2], (still[2:4] + turned[2:4]) / 2, turned[4:]]), atol=1e-6)
    agrees(eye, stage)


def test_skin_without_matrices(tmp_path: Path) -> None:
    w = Writer()
    joint = w.node(translation=[1, 2, 3])
    joints = w.accessor([[0, 0, 0, 0]] * 3, "uint8")
    w.node(mesh=w.mesh(TRIANGLE, JOINTS_0=joints, WEIGHTS_0=[[1, 0, 0, 0]] * 3), skin=w.add("skins", joints=[joint]))
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), np.array(TRIANGLE) + (1, 2, 3))


def test_morph_targets(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    up, right = ({"POSITION": w.accessor([move] * 3)} for move in ([0, 1, 0], [1.5, 0, 0]))
    mesh = w.mesh(np.array(TRIANGLE) * 0.5, [0, 1, 2], flat(w), targets=[up, right])
    w.json["meshes"][mesh]["weights"] = [0.5, 0]
    node = w.node(mesh=mesh)
    stage = open_scene(w.save(tmp_path), "none")
    np.testing.assert_allclose(corners(stage), np.array(TRIANGLE) * 0.5 + (0, 0.5, 0))
    agrees(eye, stage)
    w.animate(node, "weights", [0, 2], [[0], [0], [1], [1]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(1.0, None)
    np.testing.assert_allclose(corners(stage), np.array(TRIANGLE) * 0.5 + (0.75, 0.5, 0))
    agrees(eye, stage)


@given(st.integers(0, 6), st.integers(0, 9))
def test_strips_and_fans(mode: int, count: int) -> None:
    faces = meshes.triangles(np.arange(count), mode) if mode >= 4 else None
    if faces is None:
        return
    if mode == 4:
        expected = [(i, i + 1, i + 2) for i in range(0, count - 2, 3)]
    elif mode == 5:
        expected = [(i, i + 1 + i % 2, i + 2 - i % 2) for i in range(count - 2)]
    else:
        expected = [(i + 1, i + 2, 0) for i in range(count - 2)]
    assert [tuple(face) for face in faces.tolist()] == expected


def test_points_and_lines(tmp_path: Path, eye: Eye) -> None:
    for mode in (0, 1, 2, 3):
        w = Writer()
        w.node(mesh=w.mesh(SQUARE, None, flat(w), mode=mode))
        assert seen(eye, open_scene(w.save(tmp_path), "none")).sum() >= (4 if mode == 0 else 32), mode


def test_sparse_accessors_and_quantised_positions(tmp_path: Path) -> None:
    w = Writer()
    indices, values = w.view(np.array([1, 3], "<u2").tobytes()), w.view(np.array([[5, 6, 7], [8, 9, 10]], "<f4").tobytes())
    sparse = {"count": 2, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}}
    mesh = w.mesh(SQUARE, SQUARE_FACES)
    w.json["accessors"][0]["sparse"] = sparse
    w.node(mesh=mesh)
    expected = np.array(SQUARE, float)
    expected[[1, 3]] = [[5, 6, 7], [8, 9, 10]]
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), expected)
    del w.json["accessors"][0]["bufferView"]  # zeros, then
    expected[[0, 2]] = 0
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), expected)

    w = Writer()
    mesh = w.mesh(SQUARE, SQUARE_FACES)
    packed = np.zeros((4, 8), np.int8)  # of 3 bytes every 8
    packed[:, :3] = np.array(SQUARE) * 127
    view = w.view(packed.tobytes(), byteStride=8)
    w.json["accessors"][0] = {"bufferView": view, "componentType": 5120, "normalized": True, "count": 4, "type": "VEC3"}
    w.node(mesh=mesh, scale=[2, 2, 2])
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), np.array(SQUARE) * 2.0)


def test_inside_out_meshes_are_turned(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES[::-1], flat(w), NORMAL=[[0, 0, 1]] * 4))
    assert seen(eye, open_scene(w.save(tmp_path), "none")).sum() == 32 * 32
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES[::-1], flat(w)))  # nothing says which side is meant
    assert not seen(eye, open_scene(w.save(tmp_path), "none")).any()


def test_model_gives_a_group_and_its_pose() -> None:
    group, pose = model(str(HAWK))
    group.local.position = (10, 0, 0)
    group.local.scale = (2, 2, 2)
    (mesh,) = (thing for thing in group.iter() if isinstance(thing, gfx.Mesh))
    stage = open_scene(HAWK, "none")
    for t in (0.2, 0.6):
        pose(t)
        stage.pose(t, None)
        np.testing.assert_allclose(meshes.vertices(mesh), 2 * corners(stage) + (10, 0, 0), atol=1e-5)


def test_hawk_is_seen_where_its_vertices_are(eye: Eye) -> None:
    """On the screen, skinned by the GPU, against the NumPy twin."""
    stage = open_scene(HAWK, "none")
    camera = next(iter(stage.cameras.values()))
    for thing in stage.scene.iter():
        if isinstance(thing, gfx.Mesh):
            thing.material = gfx.MeshBasicMaterial(color="#fff", side="both")
    for t in (0.0, 0.3, 0.6):
        stage.pose(t, camera)
        mask = seen(eye, stage, camera)
        places = la.vec_transform(corners(stage), camera.camera_matrix)[:, :2] * (1, -1) * 0.5 + 0.5
        low, high = places.min(axis=0) * SIZE, places.max(axis=0) * SIZE
        ys, xs = np.nonzero(mask)
        assert [xs.min(), ys.min(), xs.max() + 1, ys.max() + 1] == pytest.approx([*low, *high], abs=2), t


def test_nothing_warns() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_scene(HAWK).pose(0.5, None)
