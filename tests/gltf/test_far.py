"""Scenes far from the origin: at 100 km, 1,000 km and in UTM coordinates they look as they do at the origin."""

from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltf_rooms import box
from gltfs import Writer

from airlight.colour import encode_codes
from airlight.options import March, Medium, Parameters, SceneOptions
from airlight.pygfx.origin import near_origin
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot, Studio
from airlight.scenes.origin import origin, recentred, shifted

AWAY = [(1e5, 0.0, -1e5), (1e6, 1e6, 1e6), (500_000.0, 0.0, 5_400_000.0)]
LIGHTS = {
    "sun": ({"type": "directional", "intensity": 3}, {"rotation": [-0.5, 0.2, 0, 0.84]}),
    "spot": (
        {"type": "spot", "intensity": 400, "spot": {"outerConeAngle": 0.7}},
        {"translation": [2, 4, 3], "rotation": [-0.45, 0.2, 0, 0.87]},
    ),
    "point": ({"type": "point", "intensity": 100}, {"translation": [1, 3, 2]}),
}
SHOT = Shot(160, 90, 1)


def scene(light: str, away: tuple[float, float, float], skinned: bool = False, in_vertices: bool = False) -> Writer:
    """A post on a floor, its top bent by a bone, under one light, seen by a camera; all moved by `away`."""
    w = Writer()
    apart, root = np.array(away), w.node(translation=list(away))
    kept, moved = (root, np.zeros(3)) if not in_vertices else (None, apart)
    floor, _, faces = box(4, 0.125, 4)
    w.node(kept, mesh=w.mesh(floor + moved, faces))
    post, _, faces = box(0.25, 1, 0.25)
    post = post + (0, 1.125, 0)
    if skinned:
        bone = w.node(root, translation=[0, 1, 0], rotation=[0, 0, 0.3, 0.954])
        still = w.node(root)
        up = (post[:, 1] > 1).astype(float)
        inverse = [np.eye(4), np.eye(4)]
        inverse[0][1, 3] = -1
        more = {"JOINTS_0": w.accessor([[0, 1, 0, 0]] * 24, "uint8"), "WEIGHTS_0": np.stack([up, 1 - up, 0 * up, 0 * up], 1)}
        skin = w.add("skins", joints=[bone, still], inverseBindMatrices=w.accessor(np.array(inverse).transpose(0, 2, 1).reshape(2, 16)))
        w.node(root, mesh=w.mesh(post, faces, **more), skin=skin)
    else:
        w.node(kept, mesh=w.mesh(post + moved, faces))
    described, where = LIGHTS[light]
    w.node(root, extensions=w.light(**described), **where)
    w.node(root, camera=w.add("cameras", type="perspective", perspective={"yfov": 0.8, "znear": 0.1}), translation=[0, 1.5, 6])
    return w


def codes(path: str, method: str = "epipolar", shot: Shot = SHOT, time: float = 0.0) -> np.ndarray:
    medium = Medium(sigma_t=(0.05,) * 3)  # the scene's radius rounds in float32
    studio = Studio(open_scene(path, "none"), shot, Parameters(method=method), None, SceneOptions(), medium=medium, march=March(steps=32))
    return encode_codes(studio.frame(time).pixels(), np.uint8).astype(int)


@pytest.mark.parametrize("method", ["epipolar", "march"])
@pytest.mark.parametrize("light, skinned", [("sun", False), ("spot", True), ("point", True)])
def test_what_is_far_looks_as_at_the_origin(light: str, skinned: bool, method: str, tmp_path: Path) -> None:
    here = codes(scene(light, (0, 0, 0), skinned).save(tmp_path), method)
    assert here.std() > 10
    for away in AWAY:
        there = codes(scene(light, away, skinned).save(tmp_path), method)
        assert np.abs(there - here).max() <= 1, away


@pytest.mark.parametrize("in_instances", [False, True])
def test_instances(in_instances: bool, tmp_path: Path) -> None:
    """Far away by their node, or by their own translations, of a mesh that is far away too."""

    def posts(away: np.ndarray) -> str:
        w = scene("sun", tuple(away))
        points, _, faces = box(0.125, 1, 0.125)
        own = away if in_instances else np.zeros(3)
        moves = np.array([[x, 1, 1] for x in (-2.0, 0.0, 2.0)]) + 2 * own
        many = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": w.accessor(moves), "SCALE": w.accessor([[1, 1, -1]] * 3)}}}
        sign = np.array([-1, -1, 1])
        w.node(None if in_instances else 0, mesh=w.mesh(points + sign * own, faces), extensions=many)
        w.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing", "KHR_lights_punctual"]
        return w.save(tmp_path)

    here, away = codes(posts(np.zeros(3)), "march"), np.array(AWAY[0])
    assert np.abs(codes(posts(away), "march") - here).max() <= 1


def test_vertices_that_hold_large_coordinates(tmp_path: Path) -> None:
    here = codes(scene("spot", (0, 0, 0)).save(tmp_path), "march")
    there = codes(scene("spot", AWAY[0], in_vertices=True).save(tmp_path), "march")  # float32 has 1/128 m there, in the file
    assert np.abs(there - here).max() <= 1


def test_numbers_of_a_user_are_the_files_coordinates(tmp_path: Path) -> None:
    away = np.array(AWAY[2])
    shots = [Shot(160, 90, 1, eye=tuple(apart + (3, 2, 5)), target=tuple(apart + (0, 1, 0)), lights=()) for apart in (np.zeros(3), away)]
    here = codes(scene("spot", (0, 0, 0)).save(tmp_path), "march", shots[0])
    there = codes(scene("spot", AWAY[2]).save(tmp_path), "march", shots[1])
    assert here.std() > 10 and np.abs(there - here).max() <= 1


def test_a_camera_that_flies_far_with_what_it_sees(tmp_path: Path) -> None:
    w = scene("spot", (0, 0, 0))
    here = codes(w.save(tmp_path))
    w.animate(0, "translation", [0, 1, 2], [[0, 0, 0], [1e6, 0, 0], [1e6, 0, 0]])
    path = w.save(tmp_path)
    studio = Studio(open_scene(path, "none"), SHOT, Parameters(method="additive"))
    first, later = (encode_codes(studio.frame(t).pixels(), np.uint8).astype(int) for t in (0.0, 1.5))
    assert np.abs(later - first).max() <= 1 and first.std() > 10 and here.std() > 10


def test_nothing_is_moved_for_good(tmp_path: Path) -> None:
    stage = open_scene(scene("sun", AWAY[1], skinned=True).save(tmp_path), "none")
    before = [thing.world.matrix.copy() for thing in stage.scene.iter()]
    camera = next(iter(stage.cameras.values()))
    place = origin(stage.center, stage.radius, camera)
    assert np.array_equal(place, AWAY[1])
    with near_origin(stage.scene, camera, place, stage.lights):
        placed = [thing for thing in stage.scene.iter() if isinstance(thing, (gfx.Mesh, gfx.DirectionalLight))]
        assert len(placed) >= 3 and max(np.abs(thing.world.position).max() for thing in placed) < 100
    assert all(np.array_equal(a, thing.world.matrix) for a, thing in zip(before, stage.scene.iter(), strict=True))


def test_recentred_points_and_their_matrices() -> None:
    points = np.float32([[1e6, 2e6, 4], [1e6 + 1, 2e6, 5], [1e6, 2e6 + 2, 6]])
    near, shift = recentred(points)
    assert near.dtype == np.float32 and np.abs(near).max() < 10 and np.array_equal(near + shift, points.astype(float))
    matrix = np.array([[0, 2, 0, 5], [1, 0, 0, -1e6], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    other = shifted(matrix, shift)
    expected = points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.allclose(near.astype(float) @ other[:3, :3].T + other[:3, 3], expected, rtol=0, atol=1e-6)
    same, none = recentred(np.float32([[1, 2, 3], [4, 5, 6]]))
    assert not none.any() and same[0, 0] == 1
