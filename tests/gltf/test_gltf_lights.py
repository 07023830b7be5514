"""Lights and cameras of glTF files."""

import math
from pathlib import Path

import numpy as np
import pygfx as gfx
import pylinalg as la
import pytest
from gltf_stage import Eye, corners, frontal
from gltfs import SQUARE, SQUARE_FACES, TRIANGLE, Writer

from airlight.errors import AirlightWarning
from airlight.pygfx import SceneLight
from airlight.scenes import open_scene


def test_lights(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    mirrored = w.node(scale=[-2, 1, 1], rotation=[0, math.sqrt(0.5), 0, math.sqrt(0.5)], translation=[1, 2, 3])
    spot = {"innerConeAngle": 0, "outerConeAngle": 0.5}
    w.node(mirrored, extensions=w.light(type="spot", color=[0.5, 1, 0], intensity=30, spot=spot))
    w.node(extensions=w.light(type="spot", intensity=60, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.4}))
    w.node(extensions=w.light(type="point", intensity=15, range=7), translation=[0, 5, 0])
    w.node(extensions=w.light(type="directional", intensity=3), rotation=[-math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    stage = open_scene(w.save(tmp_path))
    first, second, point, sun = (light.target for light in stage.lights)
    assert isinstance(first, gfx.SpotLight) and first.decay == 2 and first.cast_shadow
    assert (first.angle, first.penumbra, first.intensity) == pytest.approx((0.5, 1, 30))
    np.testing.assert_allclose(first.color.to_physical(), (0.5, 1, 0), atol=1e-6)
    np.testing.assert_allclose(first.world.position, (1, 2, 3))
    ahead = first.target.world.position - first.world.position
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (-1, 0, 0), atol=1e-6)
    assert (second.angle, second.penumbra) == pytest.approx((0.4, 0.5))
    assert (point.intensity, point.decay, point.distance) == pytest.approx((15, 2, 7)) and isinstance(point, gfx.PointLight)
    assert sun.intensity == 3 and isinstance(sun, gfx.DirectionalLight)
    down = sun.target.world.position - sun.world.position
    np.testing.assert_allclose(down / np.linalg.norm(down), (0, -1, 0), atol=1e-6)
    looks = np.array([max(light.screen_tint) for light in stage.lights])
    np.testing.assert_allclose(looks[:3] / looks[1], [0.5, 1, 0.25])
    assert (looks > 0).all() and (looks <= 1).all()
    assert [(light.color, light.strength) for light in stage.lights] == [((1, 1, 1), 1)] * 4  # a medium has them as they are
    plain = open_scene(tmp_path / "scene.glb", "none")
    assert [max(light.screen_tint) for light in plain.lights] == [0.5, 1, 0.25, 1]
    assert all(isinstance(light, SceneLight) and light.disc_half_angle > 0 for light in stage.lights)
    assert stage.movable is stage.lights[0]


def test_near_planes_of_shadows_survive(tmp_path: Path, eye: Eye) -> None:
    """pygfx would put a spot's near plane at a millionth of its far one."""
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    for angle in (0.4, math.pi / 2):
        w.node(extensions=w.light(type="spot", range=20, spot={"outerConeAngle": angle}), translation=[0, 0, 3])
    w.node(extensions=w.light(type="point", range=20), translation=[0, 0, 3])
    stage = open_scene(w.save(tmp_path), "none")
    eye.linear(stage.scene, frontal())
    for light in stage.lights:
        assert light.target.shadow.camera.near == pytest.approx(stage.radius / 100)


def test_a_spot_lights_its_cone_and_an_occluder_its_shadow(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    white = w.add("materials", pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 1})
    w.node(mesh=w.mesh(np.array(SQUARE) * 4, SQUARE_FACES, white, NORMAL=[[0, 0, 1]] * 4))
    w.node(extensions=w.light(type="spot", intensity=100, spot={"outerConeAngle": 0.3}), translation=[0, 0, 5])
    stage = open_scene(w.save(tmp_path), "none")
    lit = eye.linear(stage.scene, frontal())[..., 0]
    ambient = lit[32, 90]
    assert lit[32, 48] - ambient == pytest.approx(100 / 25 / math.pi, rel=0.05)  # I / d^2 times albedo / pi
    assert (lit[32] > 1.2 * ambient).sum() == pytest.approx(2 * 5 * math.tan(0.3) * 16, abs=8)
    w.node(mesh=w.mesh(np.array(SQUARE) * 0.2, SQUARE_FACES, white, NORMAL=[[0, 0, 1]] * 4), translation=[0, 0, 2.5])
    behind = frontal()
    behind.depth_range = (-1, 50)  # does not see the occluder
    stage = open_scene(w.save(tmp_path), "none")
    assert eye.linear(stage.scene, behind)[32, 48, 0] == pytest.approx(ambient, rel=0.05)


def test_many_lights_are_cut_with_a_word(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    for i in range(12):
        w.node(extensions=w.light(type="point", intensity=i))
    with pytest.warns(AirlightWarning, match="11 lights; the 8 brightest"):
        stage = open_scene(w.save(tmp_path), "none")
    assert sorted(light.target.intensity for light in stage.lights) == list(range(4, 12))


def test_cameras(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    carrier = w.node(scale=[-3, 2, 2])
    lens = w.add("cameras", type="perspective", perspective={"yfov": 0.7, "znear": 0.25, "aspectRatio": 3})
    w.node(carrier, camera=lens, translation=[0, 0, 4], name="main")
    w.node(carrier, camera=lens, translation=[0, 0, 5], name="main")
    w.node(camera=w.add("cameras", type="orthographic", orthographic={"xmag": 3, "ymag": 2, "znear": 1, "zfar": 9}))
    stage = open_scene(w.save(tmp_path), "none")
    assert list(stage.cameras) == ["main", "main 2", "camera 3"]
    main, _, flat = stage.cameras.values()
    np.testing.assert_allclose(main.world.position, (0, 0, 8))
    np.testing.assert_allclose(main.world.forward, (0, 0, -1), atol=1e-9)
    assert np.linalg.det(main.world.matrix) == pytest.approx(1)
    main.set_view_size(1600, 900)
    assert 2 * math.atan(1 / main.projection_matrix[1, 1]) == pytest.approx(0.7)
    assert main.near == 0.25 and main.far > 8
    flat.set_view_size(1500, 1000)
    np.testing.assert_allclose(np.diag(flat.projection_matrix)[:2], (1 / 3, 1 / 2))
    w.animate(carrier, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    assert stage.cameras["main"].world.position[0] == 0  # only the camera in use moves
    stage.pose(0.5, stage.cameras["main"])
    assert stage.cameras["main"].world.position[0] == pytest.approx(0.5)


def test_a_file_without_camera_and_lights_gets_them(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(np.array(TRIANGLE) * 100), translation=[1000, 0, 0])
    stage = open_scene(w.save(tmp_path))
    (camera,) = stage.cameras.values()
    camera.set_view_size(1600, 900)
    ndc = la.vec_transform(corners(stage), camera.camera_matrix)
    assert np.abs(ndc[:, :2]).max() == pytest.approx(0.8, abs=0.05)
    assert (ndc[:, 2] > 0).all() and (ndc[:, 2] < 1).all()
    (sun,) = stage.lights
    assert isinstance(sun.target, gfx.DirectionalLight) and np.linalg.norm(sun.homogeneous()[:3]) == pytest.approx(1.5 * stage.radius)
    at = la.vec_transform(camera.world.position + sun.homogeneous()[:3] * 1000, camera.camera_matrix)
    assert np.abs(at[:2]).max() < 1, "the sun is in the picture"
    assert stage.scene.environment is not None
    assert [light for light in stage.scene.iter() if isinstance(light, gfx.DirectionalLight)] == [sun.target]
