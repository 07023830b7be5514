"""Writes the scenes that scattering is validated on, into the package's data/scenes/validation/: python scripts/validation_scenes.py

Lengths in metres, light in lux and candela. Everything is made here, by numbers; leaves are geometry, so that a ray tracer over
triangles knows them exactly.
"""

import itertools
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from gltfs import Writer  # noqa: E402

FOLDER = ROOT / "src" / "airlight" / "data" / "scenes" / "validation"
CUBE = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
CUBE_FACES = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]


def turn(axis: str, degrees: float) -> np.ndarray:
    """(4,) quaternion, x y z w."""
    half = math.radians(degrees) / 2
    return np.append(np.eye(3)["xyz".index(axis)] * math.sin(half), math.cos(half))


def aimed(eye: Any, target: Any) -> np.ndarray:
    """(4,) quaternion that turns -z from eye to target, level."""
    back = np.subtract(eye, target, dtype=float)
    back /= np.linalg.norm(back)
    right = np.cross([0, 1, 0] if abs(back[1]) < 0.999 else [0, 0, -1], back)
    right /= np.linalg.norm(right)
    m = np.column_stack([right, np.cross(back, right), back])
    values, vectors = np.linalg.eigh(  # Bar-Itzhack 2000
        np.array(
            [
                [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
                [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
                [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
                [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m.trace()],
            ]
        )
    )
    return vectors[:, np.argmax(values)]


class Scene:
    """A glTF file in the making."""

    def __init__(self) -> None:
        self.writer = Writer()
        self.writer.json["extensionsUsed"] = ["KHR_lights_punctual"]
        self._cubes: dict[int, int] = {}

    def paint(self, r: float, g: float, b: float, rough: float = 0.9) -> int:
        """A matte material of a linear colour."""
        surface = {"baseColorFactor": [r, g, b, 1], "metallicFactor": 0, "roughnessFactor": rough}
        return self.writer.add("materials", pbrMetallicRoughness=surface, doubleSided=True)

    def glass(self, r: float, g: float, b: float, alpha: float) -> int:
        """Glass of a colour that is seen through, from both sides."""
        surface = {"baseColorFactor": [r, g, b, alpha], "metallicFactor": 0, "roughnessFactor": 0.08}
        return self.writer.add("materials", pbrMetallicRoughness=surface, doubleSided=True, alphaMode="BLEND")

    def pane(self, glass: int, place: Any, width: float, height: float, rotation: Any) -> None:
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * (width / 2, height / 2, 1)
        normals = np.tile([0.0, 0.0, 1.0], (4, 1))
        mesh = self.writer.mesh(corners, [0, 1, 2, 0, 2, 3], glass, NORMAL=normals)
        self.node(mesh=mesh, translation=place, rotation=rotation)

    def node(self, parent: int | None = None, **more: Any) -> int:
        for name in ("translation", "rotation", "scale"):
            if name in more:
                more[name] = [round(float(v), 9) for v in more[name]]
        return self.writer.node(parent, **more)

    def box(self, paint: int, place: Any, size: Any, rotation: Any = (0, 0, 0, 1), parent: int | None = None) -> int:
        if paint not in self._cubes:
            self._cubes[paint] = self.writer.mesh(CUBE, CUBE_FACES, paint)
        return self.node(parent, mesh=self._cubes[paint], translation=place, rotation=rotation, scale=size)

    def bar(self, paint: int, a: Any, b: Any, wide: float, deep: float | None = None, parent: int | None = None) -> int:
        """A box from a to b."""
        a, b = np.array(a, float), np.array(b, float)
        length = float(np.linalg.norm(b - a))
        return self.box(paint, (a + b) / 2, (wide, deep or wide, length), aimed(b, a), parent)

    def light(
        self, kind: str, colour: Any, intensity: float, place: Any, target: Any = None, parent: int | None = None, **cone: float
    ) -> int:
        spot = {} if kind != "spot" else {"spot": {name + "ConeAngle": math.radians(angle) for name, angle in cone.items()}}
        light = self.writer.light(type=kind, color=list(colour), intensity=intensity, **spot)
        rotation = (0, 0, 0, 1) if target is None else aimed(place, target)
        return self.node(parent, translation=place, rotation=rotation, extensions=light)

    def camera(self, name: str, eye: Any, target: Any, fov: float, near: float = 0.05, far: float = 200.0) -> None:
        lens = {"yfov": math.radians(fov), "znear": near, "zfar": far, "aspectRatio": 16 / 9}
        index = self.writer.add("cameras", type="perspective", perspective=lens, name=name)
        self.node(camera=index, translation=eye, rotation=aimed(eye, target), name=name)

    def room(self, paint: int, low: Any, high: Any, sides: str = "floor back left right top front") -> None:
        """Walls around a space, 0.1 thick."""
        low, high = np.array(low, float), np.array(high, float)
        for i, names in enumerate((("left", "right"), ("floor", "top"), ("back", "front"))):
            for name, at, off in ((names[0], low, -0.05), (names[1], high, 0.05)):
                if name in sides.split():
                    place, size = (low + high) / 2, high - low + 0.2
                    place[i], size[i] = at[i] + off, 0.1
                    self.box(paint, place, size)

    def save(self, name: str) -> None:
        path = FOLDER / f"{name}.glb"
        path.write_bytes(self.writer.glb())
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


def slats() -> None:
    """A spot shines into a dark room through a window with slats."""
    s = Scene()
    wall, wood = s.paint(0.10, 0.11, 0.13), s.paint(0.22, 0.12, 0.06)
    s.room(wall, (-2.2, 0, -3), (4.2, 3.6, 6), "floor back right top")
    x, (y0, y1), (z0, z1) = -2.25, (0.9, 3.0), (-2.3, 0.5)
    s.box(wall, (x, y0 / 2, 1.5), (0.1, y0, 9.2))
    s.box(wall, (x, (y1 + 3.7) / 2, 1.5), (0.1, 3.7 - y1, 9.2))
    s.box(wall, (x, (y0 + y1) / 2, (z0 - 3.1) / 2), (0.1, y1 - y0, z0 + 3.1))
    s.box(wall, (x, (y0 + y1) / 2, (z1 + 6.1) / 2), (0.1, y1 - y0, 6.1 - z1))
    for k in range(7):
        y = y0 + 0.15 + 0.3 * k
        s.box(wood, (x, y, (z0 + z1) / 2), (0.2, 0.02, z1 - z0), turn("z", -38))
    for z in (z0, z1):
        s.box(wood, (x, (y0 + y1) / 2, z), (0.16, y1 - y0 + 0.1, 0.08))
    for y in (y0, y1):
        s.box(wood, (x, y, (z0 + z1) / 2), (0.16, 0.08, z1 - z0 + 0.1))
    s.box(wood, (1.55, 0.22, -1.2), (0.9, 0.44, 0.7), turn("y", 20))
    s.light("spot", (1.0, 0.82, 0.56), 950, (-5.4, 4.0, -0.9), (0.9, 0.5, -0.9), inner=17, outer=24)
    s.camera("room", (1.5, 1.55, 4.3), (-0.35, 1.5, -1.2), 42)
    s.save("slats")


def foliage() -> None:
    """A tree, its leaves rhombs, in the sun of a late afternoon; filmed against the sun, from the side, and with the sun behind."""
    s = Scene()
    rng = np.random.default_rng(11)
    earth, bark, leaf = s.paint(0.075, 0.07, 0.035), s.paint(0.06, 0.042, 0.03), s.paint(0.05, 0.11, 0.022, 0.7)
    s.box(earth, (0, -0.05, 0), (120, 0.1, 120))
    crown = np.array([0.0, 5.0, 0.0])
    s.bar(bark, (0.25, 0, 0.1), (0.1, 2.4, 0), 0.42)
    s.bar(bark, (0.1, 2.3, 0), (-0.05, 4.4, 0.05), 0.28)
    clumps = []
    for k in range(20):
        up = 1 - 1.75 * (k + 0.5) / 20
        around = k * math.pi * (3 - math.sqrt(5))
        flat = math.sqrt(1 - up * up)
        clumps.append(crown + np.array([2.6 * flat * math.cos(around), 2.0 * up, 2.4 * flat * math.sin(around)]) * rng.uniform(0.75, 1.05))
    for clump in clumps:
        s.bar(bark, (0, rng.uniform(2.5, 4.3), 0), clump, 0.09)
    points, faces = [], []
    for clump in clumps:
        for _ in range(68):
            place = clump + rng.normal(0, 0.33, 3)
            u, v = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
            u, v = u * rng.uniform(0.15, 0.24), v * rng.uniform(0.07, 0.11)
            n = len(points)
            points += [place - u, place + v - 0.2 * u, place + u, place - v - 0.2 * u]
            faces += [n, n + 1, n + 2, n, n + 2, n + 3]
    s.node(mesh=s.writer.mesh(np.array(points, np.float32), faces, leaf), name="leaves")
    elevation = math.radians(30)
    sun = np.array([0.0, math.sin(elevation), -math.cos(elevation)])
    s.light("directional", (1.0, 0.78, 0.5), 6.0, sun * 20, (0, 0, 0))
    s.camera("view", (0.55, 1.3, 7.2), (0.1, 3.5, 0), 52)
    s.camera("beside", (10.5, 1.6, 2.6), (0, 2.9, 2.0), 42)
    s.camera("behind", (-5.4, 2.6, -7.0), (0.3, 2.5, 1.5), 45)
    s.save("foliage")


def cage() -> None:
    """A lamp in a cage of bars, hung between pillars."""
    s = Scene()
    wall, iron = s.paint(0.10, 0.085, 0.075), s.paint(0.03, 0.03, 0.035)
    s.room(wall, (-3.2, 0, -3), (3.2, 3.4, 4.6), "floor back left right top")
    middle, r = np.array([0.0, 1.75, 0.0]), 0.42
    bars, wide = 9, math.radians(17)
    points, faces = [], []

    def patch(a0: float, a1: float, h0: float, h1: float) -> None:
        n = len(points)
        for a, h in ((a0, h0), (a1, h0), (a1, h1), (a0, h1)):
            points.append(middle + r * np.array([math.cos(h) * math.cos(a), math.sin(h), math.cos(h) * math.sin(a)]))
        faces.extend([n, n + 1, n + 2, n, n + 2, n + 3])

    heights = np.radians([-66, -50, -32, -14, 14, 32, 50, 66])
    for k in range(bars):
        a = 2 * math.pi * (k + 0.3) / bars
        for h0, h1 in itertools.pairwise(heights):
            patch(a - wide / 2, a + wide / 2, h0, h1)
    for k in range(24):
        a0, a1 = 2 * math.pi * k / 24, 2 * math.pi * (k + 1) / 24
        for h in (-32, 32):
            patch(a0, a1, math.radians(h - 4), math.radians(h + 4))
        patch(a0, a1, math.radians(66), math.pi / 2)
        patch(a0, a1, math.radians(-66), math.radians(-58))
    s.node(mesh=s.writer.mesh(np.array(points, np.float32), faces, iron), name="cage")
    s.bar(iron, middle + (0, r, 0), (0, 3.4, 0), 0.03)
    for x, z in ((-2.1, -1.7), (2.1, -1.7), (-2.1, 1.2), (2.1, 1.2)):
        s.box(wall, (x, 1.7, z), (0.34, 3.4, 0.34), turn("y", 12))
    s.light("point", (1.0, 0.62, 0.28), 24, middle)
    s.camera("room", (0.75, 1.5, 4.2), (0, 1.62, 0), 46)
    s.save("cage")


def two_spots() -> None:
    """Two coloured spots cross on the frame of a cube."""
    s = Scene()
    floor, frame = s.paint(0.09, 0.09, 0.10), s.paint(0.16, 0.16, 0.17)
    s.box(floor, (0, -0.05, -1), (14, 0.1, 12))
    s.box(floor, (0, 2.5, -4.05), (14, 5.2, 0.1))
    cube = s.node(translation=(0, 1.9, 0), rotation=turn("y", 28))
    cube = s.node(cube, rotation=turn("x", 35))
    half, wide = 0.75, 0.17
    for i in range(3):
        for a in (-half, half):
            for b in (-half, half):
                place, size = np.roll([0, a, b], i), np.roll([2 * half + wide, wide, wide], i)
                s.box(frame, place, size, parent=cube)
    for i in range(3):  # and a lattice in it
        place, size = np.zeros(3), np.full(3, 0.07)
        size[i] = 2 * half
        s.box(frame, place, size, parent=cube)
    s.light("spot", (1.0, 0.42, 0.12), 750, (-4.3, 4.3, 0.6), (0.15, 1.85, 0), inner=13, outer=18)
    s.light("spot", (0.12, 0.5, 1.0), 900, (4.3, 4.3, 0.4), (-0.15, 1.85, 0), inner=13, outer=18)
    s.camera("front", (0, 1.7, 6.6), (0, 2.0, 0), 42)
    s.save("two-spots")


def window() -> None:
    """The sun from the left, through two windows of a room, in an air that throws its light back."""
    s = Scene()
    wall, frame = s.paint(0.13, 0.11, 0.10), s.paint(0.16, 0.14, 0.11)
    s.room(wall, (-3, 0, -4), (3.4, 3.3, 3.6), "floor back right top front")
    x, y0, y1 = -3.05, 0.8, 2.9
    openings = ((-2.7, -1.1), (-0.3, 1.3))
    s.box(wall, (x, y0 / 2, -0.2), (0.1, y0, 7.8))
    s.box(wall, (x, (y1 + 3.4) / 2, -0.2), (0.1, 3.4 - y1, 7.8))
    edges = [-4.1, *(z for pair in openings for z in pair), 3.7]
    for z0, z1 in zip(edges[::2], edges[1::2]):
        s.box(wall, (x, (y0 + y1) / 2, (z0 + z1) / 2), (0.1, y1 - y0, z1 - z0))
    for z0, z1 in openings:
        for k in range(1, 3):
            s.box(frame, (x, (y0 + y1) / 2, z0 + (z1 - z0) * k / 3), (0.08, y1 - y0, 0.09))
        for k in range(1, 3):
            s.box(frame, (x, y0 + (y1 - y0) * k / 3, (z0 + z1) / 2), (0.08, 0.09, z1 - z0))
    s.box(frame, (1.1, 0.72, -1.7), (1.5, 0.07, 0.9))
    for dx in (-0.66, 0.66):
        for dz in (-0.36, 0.36):
            s.box(frame, (1.1 + dx, 0.35, -1.7 + dz), (0.07, 0.7, 0.07))
    s.light("directional", (1.0, 0.9, 0.72), 28, (-0.72, 0.5, 0.42), (0, 0, 0))
    s.camera("corner", (1.2, 1.63, 3.31), (-1.12, 1.25, -1.6), 43.4)
    s.save("window")


def headlamp() -> None:
    """A lamp beside the camera: what it throws forward is seen only where it comes back."""
    s = Scene()
    ground, post = s.paint(0.06, 0.06, 0.055), s.paint(0.16, 0.15, 0.14)
    s.box(ground, (0, -0.05, -8), (40, 0.1, 40))
    trunks = ((-1.3, -3.2, 3), (-0.25, -4.4, -2), (0.85, -3.6, 2), (-2.4, -5.6, -4), (1.9, -6.0, 3), (0.4, -8.2, 1), (-1.2, -9.5, -2))
    for x, z, tilt in trunks:
        s.box(post, (x, 1.4, z), (0.22, 2.9, 0.22), turn("z", tilt))
    s.bar(post, (-3.6, 1.0, -3.4), (3.4, 1.25, -3.3), 0.12)
    s.bar(post, (-3.6, 1.9, -3.5), (3.4, 2.0, -3.3), 0.12)
    s.light("spot", (1.0, 0.95, 0.85), 450, (1.15, 1.7, 0.3), (-0.35, 1.35, -4), inner=20, outer=30)
    s.camera("eye", (0, 1.6, 0), (0, 1.45, -4), 44)
    s.save("headlamp")


def dense() -> None:
    """A spot through a wheel, into water or smoke that swallows it."""
    s = Scene()
    wall, wheel = s.paint(0.12, 0.13, 0.13), s.paint(0.05, 0.05, 0.055)
    s.room(wall, (-3, -0.4, -2.6), (3, 4.2, 5), "floor back left right top")
    hub = np.array([0, 2.75, 0])
    centre = s.node(translation=hub, rotation=turn("z", 10))
    for k in range(7):
        spoke = s.node(centre, rotation=turn("y", 360 / 7 * k))
        s.box(wheel, (0.5, 0, 0), (1.0, 0.05, 0.2), parent=spoke)
        s.box(wheel, (0.97, 0, 0), (0.14, 0.05, 0.98), parent=spoke)
    s.box(wheel, (0, 0, 0), (0.42, 0.07, 0.42), parent=centre)
    s.light("spot", (0.75, 0.95, 1.0), 420, (0, 3.95, 0), (0, 0, 0), inner=28, outer=40)
    s.camera("front", (0.4, 1.55, 3.7), (0, 1.72, 0), 46)
    s.save("dense")


def mirrored() -> None:
    """Fins in a spiral, each a child of the one before: turned, mirrored and scaled unevenly each time; the lamp hangs on them too."""
    s = Scene()
    floor, fin = s.paint(0.10, 0.10, 0.11), s.paint(0.14, 0.09, 0.13)
    s.box(floor, (0, -0.05, 0), (16, 0.1, 16))
    s.box(floor, (0, 2.5, -4.5), (16, 5.2, 0.1))
    points = np.array([[x, y, z] for z in (-0.02, 0.02) for x, y in ((0.75, 0.0), (1.35, 0.12), (1.5, 1.0), (0.95, 1.75))], np.float32)
    faces = [0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6]
    for i in range(4):
        j = (i + 1) % 4
        faces += [i, i + 4, j, j, i + 4, j + 4]
    shape = s.writer.mesh(points, faces, fin)
    root = s.node(translation=(0, 0.55, 0), scale=(1.1, 1.0, -0.9), rotation=turn("z", 6))
    parent = root
    for i in range(11):  # mirrored, every second turns back
        parent = s.node(parent, rotation=turn("y", 33 * (-1) ** i), scale=(-0.985, 1.02, 1.01), mesh=shape)
    lamp = s.node(root, scale=(1, -1, 1), rotation=turn("x", 20))
    s.light("point", (1.0, 0.7, 0.75), 26, (0.1, -0.95, 0.05), parent=lamp)
    s.camera("front", (0.3, 2.9, 4.9), (0, 1.35, 0), 44)
    s.save("mirrored")


def panes() -> None:
    """The sun through tall windows of a hall, some of smoked glass, and a spot, across screens of glass that stand one behind the other."""
    s = Scene()
    wall, frame = s.paint(0.26, 0.24, 0.22), s.paint(0.035, 0.032, 0.03)
    s.room(wall, (-3, 0, -7), (1.6, 3.6, 4), "floor back right top front")
    s.box(wall, (-5.5, 1.35, -1.5), (0.1, 2.7, 16))
    x, y0, y1, edges = -3.05, 0.8, 3.1, np.array([-5.4, -4.4, -3.4, -2.4, -1.4, -0.4, 0.6, 1.6, 2.4, 3.4])
    s.box(wall, (x, y0 / 2, -1.5), (0.1, y0, 11.2))
    s.box(wall, (x, (y1 + 3.7) / 2, -1.5), (0.1, 3.7 - y1, 11.2))
    for z0, z1 in np.append(np.append(-7.1, edges), 4.1).reshape(-1, 2):
        s.box(wall, (x, (y0 + y1) / 2, (z0 + z1) / 2), (0.1, y1 - y0, z1 - z0))
    for k, (z0, z1) in enumerate(edges.reshape(-1, 2)):
        s.box(frame, (x, (y0 + y1) / 2, (z0 + z1) / 2), (0.06, y1 - y0, 0.05))
        if k % 2 == 0:
            smoked = s.glass(0.2, 0.2, 0.22, (0.5, 0.0, 0.65, 0.0, 0.3)[k])
            s.pane(smoked, (x, (y0 + y1) / 2, (z0 + z1) / 2), z1 - z0, y1 - y0, turn("y", 90))
    screens = (
        ((-0.65, 1.0), 2.1, 0.3, (0.15, 0.75, 0.7), -20),
        ((-0.2, -1.2), 2.2, 0.35, (0.95, 0.5, 0.08), -28),
        ((-1.0, -2.9), 2.6, 0.5, (0.12, 0.35, 0.85), -12),
        ((0.2, -5.2), 2.6, 0.3, (0.8, 0.15, 0.25), -24),
    )
    for (across, z), width, alpha, colour, degrees in screens:
        middle = np.array([across, 1.2, z])
        side = np.array([math.cos(math.radians(degrees)), 0, -math.sin(math.radians(degrees))]) * width / 2
        s.pane(s.glass(*colour, alpha), middle, width, 2.4, turn("y", degrees))
        for post in (-side, side):
            s.box(frame, middle + post, (0.03, 2.4, 0.03), turn("y", degrees))
        s.box(frame, middle + (0, 1.2, 0), (width + 0.03, 0.03, 0.03), turn("y", degrees))
    s.light("directional", (1.0, 0.86, 0.64), 34, (-0.76, 0.6, 0.2), (0, 0, 0))
    s.light("spot", (0.5, 0.72, 1.0), 300, (1.4, 3.3, -6.2), (-0.7, 0.5, -0.4), inner=12, outer=19)
    s.camera("hall", (1.1, 1.6, 3.9), (-1.0, 1.35, -2.4), 44)
    s.save("panes")


if __name__ == "__main__":
    from stained_glass import stained

    for make in (slats, foliage, cage, two_spots, window, headlamp, dense, mirrored, panes, stained):
        make()
