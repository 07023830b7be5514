"""The scene `table`: vessels on a table in a dim room before a lamp that can be moved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pygfx as gfx
import pylinalg as la

from airlight.planes import smoothstep
from airlight.pygfx import SceneLight
from airlight.scenes import ground
from airlight.scenes.environment import Environment
from airlight.scenes.gltf.load import model
from airlight.scenes.stage import Stage

LAMP = np.array([0.0, 2.95, -2.2])  # where the lamp hangs at first
LAMP_RADIANCE = (14.0, 8.0, 3.4)
LAMP_RADIUS = 0.2
CAGE = 0.42  # radius of the lantern's bars
TOP = 1.965  # height of the table, less what hides the gap of light that a shadow's bias leaves under things
THINGS = (  # mesh, place, size, turn in degrees
    ("table_rect", (0, 0, 0), 1.0, 90),
    ("wrld_basket_a", (-1.72, TOP, 0.25), 0.95, 20),
    ("wrld_vase_b", (-0.72, TOP, -0.3), 1.0, 0),
    ("wrld_vase_a", (0.78, TOP, -0.35), 1.0, 40),
    ("amphora_a", (1.62, TOP, 0.3), 1.0, 110),
    ("wrld_barrel_a", (-3.9, -0.05, -1.6), 1.0, 0),
    ("wrld_barrel_a", (4.3, -0.05, -2.0), 1.1, 130),
    ("wrld_basket_a", (3.1, -0.1, -0.2), 1.2, 70),
    ("amphora_a", (-2.75, -0.1, -2.9), 1.5, 0),
)
WALL = -4.2  # z of the wall behind the table
SMOKE = {"sigma_t": (0.06, 0.06, 0.06), "albedo": (1.0, 1.0, 1.0), "anisotropy": 0.8, "ambient": (0.006, 0.007, 0.01)}


def _plaster(seed: int) -> tuple[gfx.TextureMap, gfx.TextureMap]:
    """Paint albedo and normal map of an old lime-washed wall."""
    n = 1024
    spots, fine, big = ground.noise(n, seed, 1.3, 3), ground.noise(n, seed + 1, 0.8, 20), ground.noise(n, seed + 2, 2.0)
    worn = smoothstep(0.8 * spots + 0.35 * fine + 0.3 * big, 0.9, 1.3)
    albedo = ground.mix((0.36, 0.31, 0.25), (0.20, 0.145, 0.10), worn) * (1 + 0.07 * big + 0.05 * fine)[..., None]
    return ground.texture(ground.codes(albedo)), ground.texture(ground.normals(0.5 * spots + 0.25 * fine - 0.6 * worn, 0.22), srgb=False)


def _boards(seed: int, count: int = 8) -> gfx.TextureMap:
    """Paint the albedo of floor boards that run along v."""
    n = 1024
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(n) / n, np.arange(n) / n)
    board = (u * count).astype(int)
    grain = ground.noise(n, seed, 0.7, 4)
    stretched = np.stack([grain[(np.arange(n) // 10 + int(rng.integers(n))) % n] for _ in range(count)])  # (count, n, n)
    g = stretched[board, np.arange(n)[:, None], np.arange(n)[None, :]]
    across = u * count - board
    end = (v + rng.uniform(0, 1, count)[board]) % 0.5
    gap = np.minimum(smoothstep(np.minimum(across, 1 - across), 0, 0.025), smoothstep(np.minimum(end, 0.5 - end), 0, 0.003))
    tone = (rng.uniform(0.7, 1.15, count)[board] * (1 + 0.16 * g) * (0.25 + 0.75 * gap))[..., None]
    albedo = np.array([0.19, 0.115, 0.065]) * tone
    return ground.texture(ground.codes(albedo))


def _sheet(width: float, height: float, tile: float, **material: Any) -> gfx.Mesh:
    geometry = gfx.plane_geometry(width, height, 1, 1)
    geometry.texcoords.data[:] *= np.array([width, height], np.float32) / tile
    return gfx.Mesh(geometry, gfx.MeshStandardMaterial(metalness=0, side="front", **material))


def tessellate(geometry: gfx.Geometry) -> gfx.Geometry:
    """Split each triangle of a turned shape (about y) in four: a true circle around its axis, its outline bulging as the normals say.

    The outline: Boubekeur and Alexa, Phong Tessellation, SIGGRAPH Asia 2008, alpha 3/4, less where the normals at a place disagree.
    """
    p, n, uv = (np.asarray(getattr(geometry, name).data, np.float64) for name in ("positions", "normals", "texcoords"))
    faces = np.asarray(geometry.indices.data)
    radius = np.hypot(p[:, 0], p[:, 2])
    outward = p[:, [0, 2]] / np.maximum(radius, 1e-6)[:, None]
    outline, slope = np.stack([radius, p[:, 1]], axis=1), np.stack([(n[:, [0, 2]] * outward).sum(1), n[:, 1]], axis=1)
    _, same = np.unique(np.round(p, 4), axis=0, return_inverse=True)
    mean = np.zeros((same.max() + 1, 2))
    np.add.at(mean, same.ravel(), slope)
    mean = (mean / np.bincount(same.ravel())[:, None])[same.ravel()]
    smooth = np.linalg.norm(mean, axis=1)
    lift = mean / np.maximum(smooth, 1e-9)[:, None]
    edges, side = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    a, b = edges.T
    middle = (outline[a] + outline[b]) / 2
    bulge = sum(((outline[k] - middle) * lift[k]).sum(1, keepdims=True) * lift[k] / 2 for k in (a, b))
    middle += 0.75 * smoothstep(np.minimum(smooth[a], smooth[b]), 0.8, 1.0)[:, None] * bulge
    to = outward[a] * (radius[a] > 1e-3)[:, None] + outward[b] * (radius[b] > 1e-3)[:, None]
    to /= np.maximum(np.linalg.norm(to, axis=1, keepdims=True), 1e-9)
    lean = slope[a] + slope[b]
    lean /= np.maximum(np.linalg.norm(lean, axis=1, keepdims=True), 1e-9)
    i, j, k = faces.T
    ij, jk, ki = (side.reshape(-1, 3) + len(p)).T
    split = np.concatenate([np.stack(t, axis=1) for t in ((i, ij, ki), (ij, j, jk), (ki, jk, k), (ij, jk, ki))])
    new = [np.stack([to[:, 0] * x[:, 0], x[:, 1], to[:, 1] * x[:, 0]], axis=1) for x in (middle, lean)]
    return gfx.Geometry(
        positions=np.concatenate([p, new[0]]).astype(np.float32),
        normals=np.concatenate([n, new[1]]).astype(np.float32),
        texcoords=np.concatenate([uv, (uv[a] + uv[b]) / 2]).astype(np.float32),
        indices=split.astype(np.int32),
    )


def _bar(start: float, turn: float) -> gfx.Geometry:
    """Bend a thin rod that climbs around the lantern from the angle `start` by `turn` radians."""
    n, sides, thick = 17, 6, 0.017
    t = np.linspace(0, 1, n)
    angle, around = start + turn * (t - 0.5), np.arange(sides) * (2 * np.pi / sides)
    out = np.stack([np.cos(angle), 0 * t, np.sin(angle)], axis=1)
    along = np.stack([-CAGE * turn * np.sin(angle), np.full(n, 0.86), CAGE * turn * np.cos(angle)], axis=1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    aside = np.cross(out, along)
    normals = np.cos(around)[None, :, None] * out[:, None] + np.sin(around)[None, :, None] * aside[:, None]
    middle = CAGE * out + np.stack([0 * t, 0.86 * (t - 0.5), 0 * t], axis=1)
    positions = middle[:, None] + thick * normals
    i, k = (x.ravel() for x in np.meshgrid(np.arange(n - 1), np.arange(sides), indexing="ij"))
    a, b = i * sides + k, i * sides + (k + 1) % sides
    faces = np.concatenate([np.stack([a, a + sides, b], axis=1), np.stack([b, a + sides, b + sides], axis=1)])
    return gfx.Geometry(
        positions=positions.reshape(-1, 3).astype(np.float32),
        normals=normals.reshape(-1, 3).astype(np.float32),
        indices=faces.astype(np.int32),
    )


def _cage() -> gfx.Group:
    """Build a lantern's bars, hoops, lid and chain around the lamp at the origin."""
    iron = gfx.MeshStandardMaterial(color=gfx.Color.from_physical(0.05, 0.04, 0.032), roughness=0.5, metalness=0.8)
    cage = gfx.Group(name="lantern")

    def part(geometry: gfx.Geometry, place: tuple[float, float, float], standing: bool = True) -> None:
        mesh = gfx.Mesh(geometry, iron)
        mesh.local.position = place
        if standing:  # a cylinder's axis is z
            mesh.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
        cage.add(mesh)

    for hand in (-1, 1):
        for start in np.arange(9) * (2 * np.pi / 9):
            part(_bar(start, hand * 1.5), (0, 0, 0), standing=False)
    hoop = gfx.cylinder_geometry(CAGE + 0.025, CAGE + 0.025, 0.05, 40, 1, open_ended=True)
    for height in (-0.43, 0.43):
        part(hoop, (0, height, 0))
    part(gfx.cylinder_geometry(CAGE + 0.1, 0.06, 0.28, 40, 1), (0, 0.58, 0))
    part(gfx.cylinder_geometry(0.018, 0.018, 8.0, 8, 1), (0, 4.7, 0))
    return cage


def _room() -> np.ndarray:
    """Paint what little light the room gives, (128, 256, 3): cool from a window behind the viewer and above, warm from the walls."""
    n = 128
    v, u = (np.arange(n) + 0.5) / n * np.pi, ((np.arange(2 * n) + 0.5) / n - 1) * np.pi
    up, back = np.broadcast_to(np.cos(v)[:, None], (n, 2 * n)), -np.sin(v)[:, None] * np.cos(u)
    right = np.sin(v)[:, None] * np.sin(u)
    base = ground.mix((0.05, 0.036, 0.028), (0.05, 0.06, 0.085), smoothstep(up, -0.4, 0.8))
    window = np.exp(-(((right + 0.72) / 0.28) ** 2 + ((up - 0.35) / 0.25) ** 2)) * (back > 0)
    return np.asarray(base + window[..., None] * np.array([1.6, 2.2, 3.2]), np.float32)


def table() -> Stage:
    """Build the stage. Its lamp, a glowing ball, is `movable`: the light that it casts moves with it."""
    scene = gfx.Scene()
    Environment(_room()).surround(scene, background=False)
    scene.add(gfx.Background.from_color("#000000"))

    ball = gfx.Mesh(gfx.sphere_geometry(LAMP_RADIUS, 48, 24), gfx.MeshBasicMaterial(color=gfx.Color.from_physical(*LAMP_RADIANCE)))
    ball.local.position = LAMP
    glow = gfx.PointLight(color=gfx.Color.from_physical(1.0, 0.56, 0.24), intensity=32, decay=2, cast_shadow=True, name="lamp")
    glow.shadow.camera.depth_range = (0.1, 40)
    glow.shadow.bias = 0.0002  # in normalised depth: 1 cm at 2 units, 5 cm at 5
    ball.add(glow, _cage())
    scene.add(ball)

    floor = _sheet(90, 36, 3.2, map=_boards(3), roughness=0.55)
    floor.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    floor.local.position = (0, -0.1, WALL + 18)
    plaster, bumps = _plaster(8)
    wall = _sheet(90, 14, 6.0, map=plaster, normal_map=bumps, roughness=0.95)
    wall.local.position = (0, 6.9, WALL)
    scene.add(floor, wall)
    kinds = {node.name: node.children[0] for node in model("table")[0].iter() if any(isinstance(c, gfx.Mesh) for c in node.children)}
    shapes = {name: kind.geometry for name, kind in kinds.items()}
    for name in shapes.keys() - {"table_rect"}:
        for _ in range(3):
            shapes[name] = tessellate(shapes[name])
    for name, place, size, turn in THINGS:
        thing = gfx.Mesh(shapes[name], kinds[name].material)
        thing.local.position = place
        thing.local.scale = (size,) * 3
        thing.local.rotation = la.quat_from_axis_angle((0, 1, 0), np.radians(turn))
        scene.add(thing)
    for thing in scene.iter():
        if isinstance(thing, gfx.Mesh):
            thing.receive_shadow = thing is not ball
            thing.cast_shadow = thing not in (ball, floor, wall)

    camera = gfx.PerspectiveCamera(42, 16 / 9, depth_range=(0.1, 100))
    camera.local.position = (0.6, 3.3, 8.0)
    camera.look_at((0, 2.35, 0))
    high = gfx.PerspectiveCamera(42, 16 / 9, depth_range=(0.1, 100))
    high.local.position = (-5.2, 5.6, 6.0)
    high.look_at((0.3, 1.9, -0.4))
    lamp = SceneLight(target=ball)

    def pose(t: float, camera: gfx.PerspectiveCamera | None = None) -> None:
        """Leave everything: nothing moves by itself."""

    return Stage("table", scene, {"front": camera, "high": high}, [lamp], 0.0, pose, np.array([0.0, 2.2, 0.0]), 4.5, lamp, settings=SMOKE)
