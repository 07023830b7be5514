"""The scene `valley`: a river winds between wooded hills towards a low sun, under fog that lies in the valley."""

from __future__ import annotations

import numpy as np
import pygfx as gfx

from airlight.planes import smoothstep
from airlight.pygfx import SceneLight
from airlight.scenes import ground
from airlight.scenes.environment import Environment
from airlight.scenes.gltf.load import model
from airlight.scenes.ground import Array
from airlight.scenes.landscape import FAR, land, mountains, sea, slope, square, sunrise, woods
from airlight.scenes.stage import Stage

SUN = np.array([0.16, 0.17, -1.0]) / np.linalg.norm([0.16, 0.17, -1.0])  # direction to it
FILL = 2.0  # how much brighter the sky lights than it looks, as in `flying`
SIZE, CELLS = 420.0, 640  # of the ground, m, and heights along a side
TREES = 1000
FOG = {
    "method": "march",
    "sigma_t": (0.05, 0.05, 0.05),
    "albedo": (1.0, 1.0, 1.0),
    "anisotropy": 0.7,
    "ambient": (0.02, 0.03, 0.05),
    "max_distance": 420.0,
    "fog": "exponential",
    "fog_base": 1.0,
    "fog_depth": 4.0,
    "noise_amount": 1.5,
    "noise_size": 30.0,
    "wind": (2.0, 0.0, 0.5),
    "cascades": 2,
}


def _river(z: Array) -> Array:
    """Compute the x of the river's middle."""
    return 26 * np.sin(z / 52 + 0.9) + 9 * np.sin(z / 23)


def _heights() -> Array:
    """Compute the ground's heights, (CELLS, CELLS); the water stands at 0."""
    x, z = square(CELLS, SIZE)
    rough, fine = ground.noise(CELLS, 41, 2.2, 3), ground.noise(CELLS, 42, 1.7, 14)
    aside = np.abs(x - _river(z))
    hills = smoothstep(aside / (1 + 0.16 * rough), 24.0, 170.0)
    h = 58 * hills + (1.2 + 9 * hills) * 0.6 * rough + 0.3 * fine * (0.4 + hills) + 2.4
    return np.asarray(ground.mix(np.full((1,), -1.5), h[..., None], smoothstep(aside, 4.0, 11.0))[..., 0])


def height_at(x: float, z: float) -> float:
    """Find the ground's height, m, at a place within it."""
    i, j = (round((value / SIZE + 0.5) * (CELLS - 1)) for value in (z, x))
    return float(_heights()[i, j])


def _ground(h: Array) -> gfx.Mesh:
    """Build the ground: meadow, darker under the woods, stone where it is steep, wet at the water."""
    patches = 0.5 + 0.5 * np.tanh(ground.noise(CELLS, 43, 1.3, 6))
    steep = smoothstep(slope(h, SIZE), 0.75, 1.3)
    albedo = ground.mix(ground.mix((0.075, 0.105, 0.03), (0.17, 0.15, 0.06), patches), (0.22, 0.20, 0.17), steep)
    albedo *= (1 + 0.25 * ground.noise(CELLS, 44, 0.5))[..., None].clip(0.4, 1.6)
    albedo *= ground.mix((0.4, 0.4, 0.4), (1, 1, 1), smoothstep(h, 0.0, 1.0))
    return land(h, SIZE, albedo, 45, 3, 0.10)


def _woods(h: Array) -> list[gfx.InstancedMesh]:
    """Plant oaks, thicker on the hills than in the meadows, none in the river."""
    rng = np.random.default_rng(46)
    wood = ground.noise(CELLS, 47, 1.5, 5)
    matrices: list[Array] = []
    while len(matrices) < TREES:
        x, z = rng.uniform(-0.48 * SIZE, 0.48 * SIZE, 2)
        i, j = (round((value / SIZE + 0.5) * (CELLS - 1)) for value in (z, x))
        aside = abs(x - _river(z))
        if h[i, j] < 1.2 or rng.random() > np.clip(0.35 + 0.9 * wood[i, j], 0.03, 1) * (0.45 if aside < 45 else 1):
            continue
        turn, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.36, 0.68)
        matrix = np.diag([size, size * rng.uniform(0.9, 1.15), size, 1.0])
        matrix[[0, 0, 2, 2], [0, 2, 0, 2]] = size * np.array([np.cos(turn), np.sin(turn), -np.sin(turn), np.cos(turn)])
        matrix[:3, 3] = x, h[i, j] - 0.1, z
        matrices.append(matrix)
    woods = []
    for part in (thing for thing in model("oak")[0].iter() if isinstance(thing, gfx.Mesh)):
        many = gfx.InstancedMesh(part.geometry, part.material, TREES)
        many.instance_buffer.data["matrix"] = np.transpose(matrices, (0, 2, 1))
        if part.material.alpha_test > 0:
            part.material.alpha_test = 0.65  # finer leaves, more sky between them
        woods.append(many)
    return woods


def valley() -> Stage:
    """Build the stage. It stands still; its fog drifts by the time that is asked for."""
    scene, h = gfx.Scene(), _heights()
    picture = ground.sky(SUN, 768, 5)
    scene.add(gfx.Background(None, gfx.BackgroundSkyboxMaterial(map=Environment(picture).cube(512))))
    Environment(FILL * picture).surround(scene, background=False)
    ranges = []
    for far, height, seed, haze in ((3000.0, 420.0, 31, 0.74), (1700.0, 190.0, 32, 0.5), (800.0, 70.0, 37, 0.3)):
        ranges.append(mountains(SUN, far, height, seed, haze))
    centre = np.array([0.0, 15.0, 0.0])
    disc, sun = sunrise(centre, SUN, 0.75 * SIZE)
    solid = [_ground(h), *_woods(h)]
    for thing in solid:
        thing.cast_shadow = thing.receive_shadow = True
    scene.add(sea(FILL), disc, sun.target, *ranges, *solid)
    cameras = {}
    for name, eye, target in (("hill", (-14.0, 22.0, 150.0), (16.0, 12.0, 0.0)), ("river", (38.0, 6.0, 110.0), (20.0, 9.0, 0.0))):
        cameras[name] = camera = gfx.PerspectiveCamera(45, 16 / 9, depth_range=(0.5, 2 * FAR))
        camera.local.position = eye
        camera.look_at(target)
    light = SceneLight(target=disc, screen_tint=(0.7, 0.7, 0.7))
    return Stage("valley", scene, cameras, [light], 0.0, lambda *_: None, centre, 150.0, settings=FOG, hazy=tuple(ranges), clear=woods())
