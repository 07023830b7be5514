"""Environments: the picture around a scene, its sun, and what it lights."""

import math
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pygfx as gfx
import pylinalg as la
import pytest
from gltf_stage import Eye, frontal
from gltfs import SQUARE
from hypothesis import given
from hypothesis import strategies as st

from airlight.errors import AirlightError
from airlight.scenes import environment, open_scene


def lat_long(width: int = 64) -> np.ndarray:
    """A sky that says where one looks: red to +x, green up, blue to +z."""
    v, u = np.mgrid[: width // 2, :width]
    places = np.stack([(u + 0.5) / width, (v + 0.5) / (width // 2)], axis=-1).reshape(-1, 2)
    towards = np.array([environment.direction(*place) for place in places]).reshape(width // 2, width, 3)
    return (towards * 0.5 + 0.5).astype(np.float32)


@given(st.floats(0, 0.999), st.floats(0.01, 0.99), st.floats(-7, 7))
def test_directions_of_the_picture(u: float, v: float, yaw: float) -> None:
    found = environment.equirectangular(environment.direction(u, v, yaw), yaw)
    assert (found[0] - u + 0.5) % 1 == pytest.approx(0.5, abs=1e-9) and found[1] == pytest.approx(v, abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 1.1])
def test_the_background_is_the_picture(eye: Eye, yaw: float) -> None:
    """Each pixel shows the colour that says where it looks."""
    scene = gfx.Scene()
    environment.Environment(lat_long(256), yaw).surround(scene)
    c, s = math.cos(-yaw), math.sin(-yaw)
    for towards in ((0, 0, -1), (1, 0.3, 0.2), (-1, -0.4, 0.1), (0.2, 0.1, 1)):
        camera = gfx.PerspectiveCamera(50, depth_range=(0.1, 10))
        camera.look_at(towards)
        found = eye.linear(scene, camera)[::16, ::16, :3]
        y, x = np.mgrid[0:64:16, 0:96:16]
        ndc = np.stack([(x + 0.5) / 48 - 1, 1 - (y + 0.5) / 32, np.full(x.shape, 0.9)], axis=-1)
        rays = la.vec_transform(ndc.reshape(-1, 3), np.linalg.inv(camera.camera_matrix)).reshape(*x.shape, 3)
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        turned = np.stack([c * rays[..., 0] - s * rays[..., 2], rays[..., 1], s * rays[..., 0] + c * rays[..., 2]], axis=-1)
        np.testing.assert_allclose(found, turned * 0.5 + 0.5, atol=0.02)


def test_holes_beside_a_sun_are_filled(tmp_path: Path) -> None:
    picture = np.full((64, 128, 3), 0.5, np.float32)
    picture[30, 60], picture[30, 61], picture[31, 60], picture[10, 10] = 5000, -40, 1e-4, -1
    out = oiio.ImageOutput.create(str(tmp_path / "it.exr"))
    assert out.open(str(tmp_path / "it.exr"), oiio.ImageSpec(128, 64, 3, "float")) and out.write_image(picture) and out.close()
    expected = np.maximum(picture, 0.5)
    np.testing.assert_allclose(environment.load_environment(str(tmp_path / "it.exr")).picture, expected)


def test_shafts_are_made_for_what_is_around_their_light() -> None:
    surroundings = environment.Environment(np.full((64, 128, 3), 2, np.float32), 0.4)
    surroundings.picture[:32] = 4
    assert surroundings.aureole(np.array([0.3, 1, 0]), 8) == pytest.approx(4)
    assert surroundings.aureole(np.array([0.3, -1, 0]), 8) == pytest.approx(2)
    assert surroundings.aureole(None, 8) == pytest.approx(3)
    assert surroundings.aureole(None, 3) == pytest.approx(2.5)


def test_the_sun_is_found_and_turned_to() -> None:
    picture = np.full((64, 128, 3), 0.2, np.float32)
    picture[20:22, 30:32] = 500, 400, 300
    surroundings = environment.Environment(picture)
    sun, irradiance = surroundings.sun_and_light()
    np.testing.assert_allclose(sun, environment.direction(31 / 128, 21 / 64), atol=1e-3)
    solid = 4 * (math.pi / 64) ** 2 * math.sin(math.pi * 21 / 64)
    np.testing.assert_allclose(irradiance, np.array([500, 400, 300]) * solid, rtol=0.01)
    for towards in ((1, 0, 0), (0.3, 0.5, -1), (-0.2, 0, 1)):
        turned = surroundings.turned_to(np.array(towards)).sun
        assert math.atan2(turned[0], turned[2]) == pytest.approx(math.atan2(towards[0], towards[2]))
        assert turned[1] == pytest.approx(sun[1])


def test_shipped_environments() -> None:
    for name, place in (("sunrise", (0.60, 0.46)), ("sky", (0.595, 0.234))):
        surroundings = environment.load_environment(name)
        assert surroundings.picture.min() >= 0 and np.isfinite(surroundings.picture).all()
        np.testing.assert_allclose(environment.equirectangular(surroundings.sun), place, atol=0.01)


def test_the_environment_lights(eye: Eye) -> None:
    """A white, rough square, under a sky of radiance 1, is white."""
    scene = gfx.Scene()
    environment.Environment(np.ones((32, 64, 3), np.float32)).surround(scene, background=False)
    normals, faces = np.array([[0, 0, 1]] * 4, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    geometry = gfx.Geometry(positions=np.array(SQUARE, np.float32), normals=normals, indices=faces)
    scene.add(gfx.Mesh(geometry, gfx.MeshStandardMaterial(roughness=1, metalness=0)))
    np.testing.assert_allclose(eye.linear(scene, frontal())[32, 48, :3], 1, atol=0.05)


def test_environments_that_are_refused(tmp_path: Path) -> None:
    for name, words in (("x.png", "is not an environment"), (str(tmp_path / "no.exr"), "No such file")):
        with pytest.raises(AirlightError, match=words):
            environment.load_environment(name)
    with pytest.raises(AirlightError, match="has its own environment"):
        open_scene("table", "sky")
