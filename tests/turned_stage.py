"""Scenes of one lamp with a shape, all of whose parts are turned and moved together."""

import math
from typing import Any

import numpy as np
import pygfx as gfx
from photometric_files import ies

from airlight.files.photometry import parse_photometry
from airlight.lights.shape import Cookie, axes_along
from airlight.pygfx import SceneLight
from airlight.pygfx.projector import Projector
from airlight.scenes.stage import Stage

RNG = np.random.default_rng(1919)
COOKIE = Cookie(RNG.uniform(size=(5, 6, 3)).astype(np.float32) ** 2)
VERTICAL, HORIZONTAL = np.arange(0, 181, 15), np.arange(0, 361, 30)
CANDELA = RNG.uniform(100, 900, (len(HORIZONTAL), len(VERTICAL))).round(1)
CANDELA[:, [0, -1]], CANDELA[-1] = 500.0, CANDELA[0]
LAMP = parse_photometry(ies("C", VERTICAL, HORIZONTAL, CANDELA), "lamp.ies")
EVEN = parse_photometry(ies("C", VERTICAL, HORIZONTAL, 0 * CANDELA + 500.0), "even.ies")
AT, TARGET, UP = np.array([-1.6, 1.9, 0.4]), np.array([0.5, -0.3, -0.2]), np.array([0.2, 1.0, 0.1])


def turn(axis: Any, degrees: float) -> np.ndarray:
    """(3, 3) about an axis, Rodrigues."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(math.radians(degrees)) * k + (1 - math.cos(math.radians(degrees))) * k @ k)


STILL = np.eye(3), np.zeros(3)
MOVED = turn((0.6, -0.5, 0.9), 131), np.array([4.1, -2.7, 3.3])
SHAPES = {"projector": COOKIE, "spot": COOKIE, "point": LAMP}


def turned_stage(kind: str, rotation: Any = STILL[0], move: Any = STILL[1], shape: Any = None) -> Stage:
    """A lamp of a kind; of a projector, whose shadow map turns with it, with a bar and a wall in its light."""
    scene = gfx.Scene().add(gfx.Background(None, gfx.BackgroundMaterial("#000")))

    def put(thing: Any, place: Any, own: Any = None) -> Any:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation @ (np.eye(3) if own is None else own), rotation @ place + move
        thing.local.matrix = matrix
        return thing

    grey = gfx.MeshStandardMaterial(color="#888")
    if kind == "projector":
        scene.add(put(gfx.Mesh(gfx.plane_geometry(30, 30), grey), (0, 0, -3)))
        scene.add(put(gfx.Mesh(gfx.box_geometry(0.2, 0.2, 2.0), grey), (-0.7, 1.0, 0.1)))
        plane = rotation @ (0.0, 1.0, 0.0)
        clip = [(*plane, float(0.8 - plane @ move))]
        lamp = Projector(intensity=40.0, fov=(50, 35), near=0.3, up=rotation @ UP, falloff="inverse", cookie=shape, clip=clip)
        more: dict[str, Any] = {}
    elif kind == "spot":
        lamp = gfx.SpotLight(intensity=40.0, angle=0.6, penumbra=0.3, decay=2)
        more = {"cookie": shape}
    else:
        lamp = gfx.PointLight(intensity=40.0, decay=2)
        more = {"photometry": shape}
    put(lamp, AT)
    if kind != "point":
        lamp.target.local.position = rotation @ TARGET + move
    light = SceneLight(lamp, **more)
    if kind != "projector" and shape is not None:  # in the light's own axes: those of a spot follow the world's up
        own = axes_along(TARGET - AT, UP) @ rotation.T
        frame = rotation if kind == "point" else axes_along(rotation @ (TARGET - AT), (0, 1, 0)).T * (1, 1, -1)
        light.turned = own @ frame
    scene.add(lamp)
    camera = put(gfx.PerspectiveCamera(60, 16 / 9, depth_range=(0.1, 40)), (0.4, 0.3, 4.0), turn((0, 1, 0), 6))
    settings = {"method": "march", "quality": "final", "sigma_t": (0.1, 0.14, 0.2), "max_distance": 12.0, "anisotropy": 0.3}
    return Stage("turned", scene, {"one": camera}, [light], 0.0, lambda t, c: None, move, 5.0, settings=settings)
