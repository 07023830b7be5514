"""Makes the scene `matinee`, a film showing in an attic, and the frame of film in its projector: python scripts/matinee.py

All is made here, by numbers: no model of anybody else is in it. Lengths in metres.
"""

import io
import itertools
import math
from typing import Any

import numpy as np
from PIL import Image
from validation_scenes import ROOT, Scene, turn

OUT = ROOT / "src" / "airlight" / "data" / "scenes" / "models" / "matinee.glb"
WIDTH, HEIGHT, FINE = 720, 540, 3  # px of the frame, and samples of each along a side
LENS, AIM = (2.75, 1.62, -3.0), (-1.75, 1.5, -0.9)
FOV = (25.6, 19.4)
Picture = np.ndarray


# ---------------------------------------------------------------- the frame of film


def mixed(under: Picture, over: Any, share: Picture) -> Picture:
    return under + np.clip(share, 0, 1)[..., None] * (np.asarray(over, float) - under)


def inside(signed: Picture) -> Picture:
    """1 where a signed distance in heights of the frame is below 0, with an edge of a pixel."""
    return np.clip(0.5 - signed * HEIGHT, 0, 1)


def frame() -> Picture:
    """Draw the frame (HEIGHT, WIDTH, 3) uint8 sRGB: a rocket on its way to the moon, above wooded hills."""
    rng = np.random.default_rng(1902)
    y, x = (np.mgrid[: HEIGHT * FINE, : WIDTH * FINE] + 0.5) / (HEIGHT * FINE)
    wide = WIDTH / HEIGHT
    sky = mixed(np.broadcast_to((0.012, 0.03, 0.13), (*x.shape, 3)), (0.05, 0.16, 0.36), np.clip(y, 0, 1) ** 2)
    # The moon, its seas and a ring around it
    mx, my, radius = 0.92, 0.36, 0.225
    r = np.hypot(x - mx, y - my)
    sky = sky + 0.16 * np.exp(-np.maximum(r - radius, 0) / 0.075)[..., None] * (1.0, 0.72, 0.36)
    moon = np.broadcast_to((1.0, 0.86, 0.5), sky.shape)
    for dx, dy, size in ((-0.08, -0.07, 0.075), (0.075, 0.045, 0.06), (-0.035, 0.105, 0.045), (0.09, -0.1, 0.03), (-0.13, 0.045, 0.028)):
        moon = mixed(moon, (0.66, 0.44, 0.2), inside(np.hypot(x - mx - dx, y - my - dy) - size))
    picture = mixed(sky, moon, inside(r - radius))
    # Stars: few and large, so that each has a ray of its own
    stars = [(0.09, 0.12), (0.24, 0.33), (0.41, 0.1), (0.57, 0.24), (0.16, 0.55)]
    stars += [(0.62, 0.56), (1.22, 0.11), (1.25, 0.52), (0.34, 0.62), (0.47, 0.43)]
    for k, (sx, sy) in enumerate(stars):
        size, turned = 0.024 + 0.012 * rng.random(), rng.uniform(0, math.pi)
        a, d = np.arctan2(y - sy, x - sx) + turned, np.hypot(x - sx, y - sy)
        points = size * (0.72 + 0.28 * np.cos(5 * a))
        picture = mixed(picture, ((1, 1, 0.94), (0.72, 0.86, 1), (1, 0.9, 0.66))[k % 3], inside(d - points))
    # The rocket, along u; v across
    cx, cy, angle = 0.43, 0.365, math.radians(-24)
    u, v = (x - cx) * math.cos(angle) + (y - cy) * math.sin(angle), -(x - cx) * math.sin(angle) + (y - cy) * math.cos(angle)
    flame = 0.05 * np.clip((u + 0.34) / 0.22, 0, 1) * (1 + 0.2 * np.sin(u * 120))
    picture = mixed(picture, (1.0, 0.42, 0.06), inside(np.maximum(np.abs(v) - flame, np.maximum(u + 0.1, -0.34 - u))))
    picture = mixed(picture, (1.0, 0.88, 0.4), inside(np.maximum(np.abs(v) - 0.5 * flame, np.maximum(u + 0.1, -0.27 - u))))
    for side in (-1, 1):
        fin = np.maximum(np.maximum(-0.145 - u, side * v - 0.1), np.maximum(-side * v, u + 0.02 + 0.8 * (side * v - 0.03)))
        picture = mixed(picture, (0.86, 0.1, 0.07), inside(fin))
    hull = 0.052 * np.sqrt(np.clip(1 - ((u - 0.0) / 0.155) ** 2, 0, 1))
    hull = np.where(u < -0.06, np.minimum(hull, 0.049), hull)
    picture = mixed(picture, (0.95, 0.95, 0.9), inside(np.maximum(np.abs(v) - hull, np.maximum(-0.11 - u, u - 0.155))))
    picture = mixed(picture, (0.86, 0.1, 0.07), inside(np.maximum(np.abs(v) - hull, np.maximum(0.075 - u, u - 0.155))))
    picture = mixed(picture, (0.1, 0.24, 0.5), inside(np.hypot(u - 0.015, v) - 0.026))
    # Hills, and trees on them
    for base, high, colour, trees, seed in ((0.8, 0.05, (0.03, 0.16, 0.2), 0, 1), (0.9, 0.045, (0.006, 0.03, 0.035), 15, 4)):
        ridge = base + high * np.sin(x * (4.2 + seed) + seed) + 0.4 * high * np.sin(x * 11 + 2 * seed)
        land = ridge - y
        at = np.random.default_rng(seed)
        for k in range(trees):
            fx = (k + 0.5 + 0.6 * at.uniform(-0.5, 0.5)) * wide / trees
            foot = base + high * math.sin(fx * (4.2 + seed) + seed) + 0.4 * high * math.sin(fx * 11 + 2 * seed)
            tall = at.uniform(0.1, 0.2)
            up = (foot + 0.01 - y) / tall
            crown = tall * 0.24 * (1 - up) * (0.72 + 0.28 * (1 - (up * 4) % 1))
            land = np.minimum(land, np.maximum(np.abs(x - fx) - crown, np.maximum(-up, up - 1) * tall))
        picture = mixed(picture, colour, inside(land))
    # A gate with round corners
    across, along = np.abs(x - wide / 2) - (wide / 2 - 0.05), np.abs(y - 0.5) - 0.45
    edge = np.hypot(np.maximum(across, 0), np.maximum(along, 0)) + np.minimum(np.maximum(across, along), 0) - 0.035
    picture = picture * inside(edge)[..., None]
    small = np.clip(picture, 0, 1).reshape(HEIGHT, FINE, WIDTH, FINE, 3).mean(axis=(1, 3))
    return np.rint(255 * np.where(small <= 0.0031308, 12.92 * small, 1.055 * small ** (1 / 2.4) - 0.055)).astype(np.uint8)


# ---------------------------------------------------------------- the attic


def ball(s: Scene, paint: int, place: Any, size: Any, rotation: Any = (0, 0, 0, 1), parent: int | None = None) -> None:
    """An ellipsoid; size: its diameters."""
    rows, columns = 13, 20
    a, b = np.meshgrid(np.linspace(0, math.pi, rows), np.linspace(0, 2 * math.pi, columns + 1), indexing="ij")
    normals = np.stack([np.sin(a) * np.cos(b), np.cos(a), np.sin(a) * np.sin(b)], axis=-1).reshape(-1, 3)
    treest = [i * (columns + 1) + j for i in range(rows - 1) for j in range(columns)]
    faces = [k for n in treest for k in (n, n + 1, n + columns + 1, n + 1, n + columns + 2, n + columns + 1)]
    s.node(parent, mesh=s.writer.mesh(normals / 2, faces, paint, NORMAL=normals), translation=place, scale=size, rotation=rotation)


def tube(s: Scene, paint: int, a: Any, b: Any, radius: float, tip: float | None = None, parent: int | None = None) -> None:
    """A cylinder from a to b with its ends, or a part of a cone."""
    a, b, sides = np.array(a, float), np.array(b, float), 24
    along = (b - a) / np.linalg.norm(b - a)
    right = np.cross(along, (0, 1, 0) if abs(along[1]) < 0.9 else (1, 0, 0))
    right /= np.linalg.norm(right)
    angles = np.linspace(0, 2 * math.pi, sides + 1)[:, None]
    out = np.cos(angles) * right + np.sin(angles) * np.cross(along, right)
    top = radius if tip is None else tip
    points = np.concatenate([a + radius * out, b + top * out, a + radius * out, b + top * out, [a, b]])
    normals = np.concatenate([out, out, np.tile(-along, (sides + 1, 1)), np.tile(along, (sides + 1, 1)), [-along, along]])
    n, faces = sides + 1, []
    for k in range(sides):
        faces += [k, k + 1, n + k, k + 1, n + k + 1, n + k]
        faces += [4 * n, 2 * n + k + 1, 2 * n + k, 4 * n + 1, 3 * n + k, 3 * n + k + 1]
    s.node(parent, mesh=s.writer.mesh(points, faces, paint, NORMAL=normals))


def reel(s: Scene, paint: int, film: int, place: Any, radius: float, wound: float, along: Any) -> None:
    """A reel of film whose axle lies along a direction."""
    place, along = np.array(place, float), np.array(along, float) / np.linalg.norm(along)
    right = np.cross(along, (0, 1, 0))
    tube(s, film, place - 0.018 * along, place + 0.018 * along, wound)
    tube(s, paint, place - 0.03 * along, place + 0.03 * along, 0.22 * radius)
    angles = np.linspace(0, 2 * math.pi, 29)
    rim = [math.cos(a) * right + math.sin(a) * np.array([0, 1, 0]) for a in angles]
    for side in (-0.024, 0.024):
        for p, q in itertools.pairwise(rim):
            s.bar(paint, place + side * along + radius * p, place + side * along + radius * q, 0.014)
        for k in range(0, 28, 7):
            s.bar(paint, place + side * along, place + side * along + radius * rim[k], 0.014)


def chair(s: Scene, wood: int, place: Any, angle: float) -> int:
    """A kitchen chair; its front is +Z of the node that is returned."""
    top = s.node(translation=place, rotation=turn("y", angle))
    s.box(wood, (0, 0.45, 0), (0.42, 0.035, 0.42), parent=top)
    for x in (-0.18, 0.18):
        for z in (-0.18, 0.18):
            s.bar(wood, (x * 1.1, 0, z * 1.1), (x, 0.45, z), 0.035, parent=top)
        s.bar(wood, (x, 0.45, -0.18), (x, 0.96, -0.25), 0.035, parent=top)
    for k in range(3):
        y = 0.62 + 0.15 * k
        s.bar(wood, (-0.18, y, -0.2 - 0.02 * k), (0.18, y, -0.2 - 0.02 * k), 0.022, 0.07, parent=top)
    return top


def cat(s: Scene, fur: int, top: int) -> None:
    """A cat that sits on a chair and looks ahead."""
    ball(s, fur, (0, 0.6, -0.03), (0.2, 0.3, 0.24), parent=top)
    ball(s, fur, (0, 0.7, 0.02), (0.15, 0.24, 0.16), parent=top)
    ball(s, fur, (0, 0.84, 0.05), (0.14, 0.125, 0.13), parent=top)
    for x in (-0.042, 0.042):
        tube(s, fur, (x, 0.875, 0.045), (1.35 * x, 0.95, 0.045), 0.03, 0.002, parent=top)
        tube(s, fur, (x, 0.46, 0.09), (x, 0.62, 0.06), 0.025, parent=top)
    bent = [(0.1, 0.5, -0.1), (0.19, 0.48, -0.12), (0.24, 0.42, -0.1), (0.25, 0.32, -0.07), (0.23, 0.24, -0.05)]
    for a, b in itertools.pairwise(bent):
        tube(s, fur, a, b, 0.017, parent=top)


def bear(s: Scene, plush: int, top: int) -> None:
    """A teddy bear that sits on a chair."""
    ball(s, plush, (0, 0.6, -0.06), (0.25, 0.3, 0.22), parent=top)
    ball(s, plush, (0, 0.82, -0.04), (0.21, 0.19, 0.19), parent=top)
    ball(s, plush, (0, 0.8, 0.05), (0.09, 0.07, 0.08), parent=top)
    for x in (-1, 1):
        ball(s, plush, (0.085 * x, 0.91, -0.04), (0.08, 0.08, 0.05), parent=top)
        ball(s, plush, (0.14 * x, 0.62, 0.02), (0.09, 0.2, 0.09), turn("x", -40), parent=top)
        ball(s, plush, (0.09 * x, 0.51, 0.1), (0.1, 0.1, 0.24), parent=top)


def plane(s: Scene, paper: int, place: Any, angle: float, size: float) -> None:
    """A paper plane that hangs on a thread from a rafter."""
    tail = [(x, y, -0.4) for x, y in ((-0.3, 0.06), (-0.04, 0.06), (0, -0.12), (0.04, 0.06), (0.3, 0.06))]
    points = np.array([(0, 0, 0.5), *tail]) * size
    mesh = s.writer.mesh(points, [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5], paper)
    s.node(mesh=mesh, translation=place, rotation=turn("y", angle))


def attic(s: Scene) -> None:
    """Build floor, roof, gables and what stands about."""
    boards = [s.paint(*c, 0.75) for c in ((0.2, 0.125, 0.07), (0.16, 0.1, 0.055), (0.235, 0.15, 0.085))]
    beam, lining, plaster = s.paint(0.1, 0.06, 0.032), s.paint(0.19, 0.13, 0.085), s.paint(0.3, 0.27, 0.24)
    back, front, knee, half, ridge = -4.7, 5.0, 1.2, 4.4, 4.6
    count = 50
    for k in range(count):
        wide = 2 * half / count
        s.box(boards[(5 * k + k // 3) % 3], (-half + (k + 0.5) * wide, -0.02, (back + front) / 2), (wide - 0.008, 0.04, front - back))
    s.box(beam, (0, -0.06, (back + front) / 2), (2 * half, 0.04, front - back))
    for side in (-1, 1):
        s.box(plaster, (side * (half + 0.05), knee / 2, (back + front) / 2), (0.1, knee, front - back))
        rows = 15
        for k in range(rows):  # the lining of the roof, plank by plank
            a, b = (np.array([side * (half - half * t), knee + (ridge - knee) * t]) for t in (k / rows, (k + 1) / rows))
            middle, along = (a + b) / 2, b - a
            lean = math.degrees(math.atan2(along[1], along[0]))
            out = 0.04 * np.array([side * (ridge - knee), half]) / math.hypot(half, ridge - knee)
            place = (middle[0] + out[0], middle[1] + out[1], (back + front) / 2)
            size = float(np.hypot(*along)) - 0.01, 0.03, front - back
            s.box((lining, beam, lining)[(k * 7) % 3] if k % 4 == 1 else lining, place, size, turn("z", lean))
    for z in np.arange(back + 0.5, front, 1.15):
        for side in (-1, 1):
            s.bar(beam, (side * half, knee, z), (side * 0.1, ridge - 0.1 * (ridge - knee) / half, z), 0.11, 0.17)
        s.bar(beam, (-1.5, 3.02, z), (1.5, 3.02, z), 0.09, 0.15)
    s.bar(beam, (0, ridge - 0.12, back), (0, ridge - 0.12, front), 0.3, 0.3)
    gable(s, plaster, beam, back, knee, half, ridge)
    s.box(plaster, (0, ridge / 2, front + 0.05), (2 * half, ridge, 0.1))


def gable(s: Scene, plaster: int, wood: int, z: float, knee: float, half: float, ridge: float) -> None:
    """The wall behind, with a round window on to the evening."""
    middle, radius = np.array([-0.15, 2.75]), 0.42
    edge = [(-half, 0), (half, 0), (half, knee), (0, ridge), (-half, knee)]
    angles = np.linspace(0, 2 * math.pi, 49)
    rim = middle + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outer = []
    for a in angles:  # where a ray from the middle meets the wall's edge
        d = np.array([math.cos(a), math.sin(a)])
        hits = []
        for p, q in zip(edge, [*edge[1:], edge[0]], strict=True):
            p, e = np.array(p, float), np.subtract(q, p)
            det = d[0] * -e[1] + d[1] * e[0]
            if abs(det) > 1e-9:
                t, u = np.linalg.solve(np.column_stack([d, -e]), p - middle)
                if t > 0 and -1e-6 <= u <= 1 + 1e-6:
                    hits.append(t)
        outer.append(middle + 1.12 * min(hits) * d)
    points = [(*p, z) for p in (*rim, *outer)]
    faces = [k for i in range(48) for k in (i, i + 49, i + 1, i + 1, i + 49, i + 50)]
    s.node(mesh=s.writer.mesh(points, faces, plaster, NORMAL=[(0, 0, 1)] * len(points)))
    for p, q in zip(rim[:-1:2], rim[2::2], strict=True):
        s.bar(wood, (*p, z), (*q, z), 0.07, 0.12)
    s.bar(wood, (middle[0] - radius, middle[1], z), (middle[0] + radius, middle[1], z), 0.035)
    s.bar(wood, (middle[0], middle[1] - radius, z), (middle[0], middle[1] + radius, z), 0.035)
    dusk = {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 1}
    pane = s.writer.add("materials", pbrMetallicRoughness=dusk, emissiveFactor=[0.25, 0.5, 1.0], doubleSided=True)
    s.box(pane, (-2.05, 4.4, z - 9), (2.4, 2.4, 0.02))


def machine(s: Scene) -> None:
    """Build the projector on its table, its lens around LENS."""
    steel, dark, film = s.paint(0.2, 0.21, 0.22, 0.45), s.paint(0.05, 0.055, 0.06, 0.5), s.paint(0.03, 0.022, 0.02, 0.35)
    wood = s.paint(0.17, 0.09, 0.045, 0.6)
    lens, way = np.array(LENS), np.subtract(AIM, LENS)
    level = np.array([way[0], 0, way[2]]) / math.hypot(way[0], way[2])
    across = np.cross(level, (0, 1, 0))
    angle = math.degrees(math.atan2(-level[2], level[0]))
    body = lens - 0.36 * level
    s.box(steel, body + (0, -0.02, 0), (0.42, 0.36, 0.2), turn("y", angle))
    s.box(dark, body - 0.24 * level + (0, -0.03, 0), (0.2, 0.28, 0.26), turn("y", angle))
    for k in range(4):
        s.box(steel, body - 0.24 * level + (0, 0.135 + 0.02 * k, 0), (0.17, 0.008, 0.22), turn("y", angle))
    tube(s, dark, lens - 0.17 * level, lens - 0.005 * level, 0.055)
    tube(s, steel, lens - 0.03 * level, lens - 0.004 * level, 0.068)
    black = {"baseColorFactor": [0, 0, 0, 1]}
    glow = s.writer.add("materials", pbrMetallicRoughness=black, emissiveFactor=[1, 0.93, 0.78], doubleSided=True)
    tube(s, glow, lens - 0.012 * level, lens - 0.002 * level, 0.046)
    s.bar(dark, body + 0.1 * level + (0, 0.1, 0), body + 0.26 * level + (0, 0.36, 0), 0.03)
    s.bar(dark, body - 0.1 * level + (0, 0.1, 0), body - 0.28 * level + (0, 0.33, 0), 0.03)
    reel(s, steel, film, body + 0.26 * level + 0.05 * across + (0, 0.4, 0), 0.2, 0.15, across)
    reel(s, steel, film, body - 0.28 * level + 0.05 * across + (0, 0.37, 0), 0.2, 0.1, across)
    foot = body - 0.05 * level
    s.box(wood, foot + (0, -0.22, 0), (0.85, 0.035, 0.5), turn("y", angle))
    for a in (-0.37, 0.37):
        for b in (-0.2, 0.2):
            end = foot + a * level + b * across
            s.bar(wood, end + (0, -0.23, 0), (end + 0.06 * (a * level + b * across)) * (1, 0, 1), 0.05)


def furniture(s: Scene) -> None:
    """Put up the sheet, the chairs and who sits on them, and what is kept in an attic."""
    cloth, pole, paper = s.paint(0.36, 0.35, 0.33, 1.0), s.paint(0.2, 0.12, 0.06), s.paint(0.78, 0.76, 0.7, 1.0)
    wood, red = s.paint(0.24, 0.13, 0.06, 0.6), s.paint(0.3, 0.07, 0.05, 0.6)
    face = np.array([0.965, 0, 0.262])
    right = np.cross((0, 1, 0), face)
    sheet = np.array(AIM) - 0.17 * right  # the nearer side of the picture is the wider one
    wide, high, columns = 3.2, 2.1, 120
    points, normals, faces = [], [], []
    for i in range(columns + 1):  # with soft folds, of its normals alone: real ones would shade each other in lines
        u = i / columns
        slope = (0.016 * 17 * math.cos(17 * u + 0.6) + 0.004 * 39 * math.cos(39 * u)) / wide
        for v in (0.0, 1.0):
            points.append(sheet + right * wide * (u - 0.5) + (0, high * (v - 0.5), 0))
            normals.append((face - slope * (1.15 - v) * right) / math.hypot(1, slope))
    for i in range(columns):
        n = 2 * i
        faces += [n, n + 2, n + 1, n + 1, n + 2, n + 3]
    s.node(mesh=s.writer.mesh(points, faces, cloth, NORMAL=normals))
    s.bar(pole, sheet + right * -1.7 + (0, high / 2 + 0.02, 0), sheet + right * 1.7 + (0, high / 2 + 0.02, 0), 0.035)
    for side in (-1.6, 1.6):
        s.bar(pole, (sheet + right * side) * (1, 0, 1) - 0.04 * face, sheet + right * side + (0, high / 2 + 0.05, 0) - 0.04 * face, 0.05)
    towards = math.degrees(math.atan2(-1.0, -0.18))
    places = (0.42, 0.95, 6), (-0.62, 1.15, -8), (1.05, -0.1, 12), (0.0, -0.05, 2)
    seats = [chair(s, wood, (x, 0, z), towards + more) for x, z, more in places]
    cat(s, s.paint(0.035, 0.03, 0.028), seats[0])
    bear(s, s.paint(0.36, 0.2, 0.09), seats[1])
    # A trunk, crates, a ladder, books
    s.box(red, (2.75, 0.25, 0.1), (0.62, 0.5, 1.0), turn("y", 8))
    s.box(wood, (2.75, 0.53, 0.1), (0.66, 0.06, 1.04), turn("y", 8))
    s.box(wood, (2.9, 0.3, 1.6), (0.7, 0.6, 0.7), turn("y", -14))
    s.box(pole, (2.95, 0.8, 1.62), (0.5, 0.4, 0.5), turn("y", 9))
    for k, (wide_, tint) in enumerate(((0.3, red), (0.27, wood), (0.28, pole), (0.22, red))):
        s.box(tint, (2.7, 0.585 + 0.05 * k, 0.05), (wide_, 0.048, 0.2), turn("y", 8 + 17 * ((k * 5) % 3)))
    for side in (-0.22, 0.22):
        s.bar(wood, (-1.35 + side, 0, -4.0), (-1.15 + side, 3.1, -4.6), 0.05)
    for k in range(9):
        t = (k + 0.6) / 9.6
        s.bar(wood, (-1.57 + 0.2 * t, 3.1 * t, -4.0 - 0.6 * t), (-1.13 + 0.2 * t, 3.1 * t, -4.0 - 0.6 * t), 0.035)
    for (x, y, z), angle, size in (((0.85, 1.86, -2.12), 150, 0.3), ((-0.62, 2.0, -1.3), 20, 0.36)):
        plane(s, paper, (x, y, z), angle, size)
        s.bar(pole, (x, y, z), (x, 3.0, z), 0.006)


def main() -> None:
    s = Scene()
    s.writer.json["asset"]["copyright"] = "Airlight's own, under the MIT licence"
    attic(s)
    machine(s)
    furniture(s)
    data = io.BytesIO()
    Image.fromarray(frame()).save(data, "JPEG", quality=92, subsampling=0)
    image = s.writer.add("images", bufferView=s.writer.view(data.getvalue()), mimeType="image/jpeg", name="frame")
    s.light("spot", (1.0, 0.95, 0.86), 900, LENS, AIM, inner=16, outer=18)
    light = s.writer.json["extensions"]["KHR_lights_punctual"]["lights"][-1]
    light["extras"] = {"projector": {"fov": list(FOV), "near": 0.05, "cookie": image}}
    s.writer.json["nodes"][-1]["name"] = light["name"] = "projector"
    s.light("point", (1.0, 0.6, 0.3), 1.2, np.subtract(LENS, (-0.5, -0.28, 0.26)))
    s.writer.json["nodes"][-1]["name"] = s.writer.json["extensions"]["KHR_lights_punctual"]["lights"][-1]["name"] = "lamp house"
    s.light("spot", (0.4, 0.6, 1.0), 800, (-1.9, 6.4, -9.5), (0.75, 0.2, -0.9), inner=4.2, outer=5.2)
    s.writer.json["nodes"][-1]["name"] = s.writer.json["extensions"]["KHR_lights_punctual"]["lights"][-1]["name"] = "moon"
    s.camera("seats", (1.7, 1.12, 4.1), (0.05, 1.42, -1.4), 42)
    s.camera("screen", (-1.9, 1.25, 0.9), (1.6, 1.7, -2.6), 55)
    OUT.write_bytes(s.writer.glb())
    print(f"{OUT.name}: {OUT.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
