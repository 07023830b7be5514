"""A small stage that stands for the scenes, and `airlight render` of it."""

import functools
import math

import numpy as np
import pygfx as gfx

from airlight.cli import main
from airlight.files import read_image
from airlight.pygfx import SceneLight
from airlight.scenes import Stage, offline

LAMP = (0.0, 1.0, -6.0)


def stage(*_, **__) -> Stage:
    """A wall of 2 x 2 m at z = 0 that goes up and down, before a grey background; a lamp behind it; two cameras."""
    scene = gfx.Scene()
    scene.add(gfx.Background.from_color("#808080"))
    wall = gfx.Mesh(gfx.plane_geometry(2, 2), gfx.MeshBasicMaterial(color="#202020"))
    wall.name = "wall"
    lamp = gfx.Mesh(gfx.sphere_geometry(0.4), gfx.MeshBasicMaterial(color=gfx.Color.from_physical(4, 3, 2)))
    lamp.local.position = LAMP
    scene.add(wall, lamp)
    front, follower = (gfx.PerspectiveCamera(50, depth_range=(0.1, 100)) for _ in range(2))
    front.local.position = (0, 0, 5)

    def pose(t, camera):
        wall.local.position = (0, 0.5 * math.sin(2 * math.pi * t), 0)
        if camera is follower:
            follower.local.position = (wall.local.x, wall.local.y, 4)

    pose(0.0, None)
    light = SceneLight(lamp)
    return Stage("box", scene, {"front": front, "follower": follower}, [light], 1.0, pose, np.zeros(3), 2.0, light)


@functools.cache
def _renderer_of(width, height, samples):
    return make_renderer(offline.Shot(width, height, samples))


def kept_renderer(shot):
    return _renderer_of(shot.width, shot.height, shot.samples)


make_renderer = offline.make_renderer
SIZE = ["--width", "64", "--height", "48"]


def render(*args) -> int:
    return main(["render", "box", *SIZE, *[str(a) for a in args]])


def refused(capsys, *args, code=2) -> str:
    """The one line with which the command is refused."""
    assert main([str(a) for a in args]) == code
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("airlight: ") and err.count("\n") == 1 and "Traceback" not in err
    return err


def picture(path) -> np.ndarray:
    return read_image(path).linear()


def channels(path) -> dict[str, np.ndarray]:
    """Every channel of an EXR, by its name."""
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    pixels = file.read_image("float")
    return {name: pixels[..., i] for i, name in enumerate(file.spec().channelnames)}
