"""Makes the scene `stained` of validation: a chapel whose three windows are of stained glass. Run by scripts/validation_scenes.py."""

import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from validation_scenes import Scene, turn

Points = np.ndarray
WIDE, SILL, SPRING, TIP = 1.24, 0.95, 3.55, 4.65  # m of a window: its width, and the heights of its sill, where its arch begins and ends
WALL, DEEP = -3.0, 0.3  # m: the inner face of the wall with the windows, and how deep it is
LEAD = 0.026
ARCH = 9  # points along each side of an arch
PALETTE = [  # sRGB codes
    (172, 8, 14), (12, 34, 158), (222, 142, 12), (10, 104, 48), (96, 12, 112), (228, 222, 196), (18, 104, 164), (204, 66, 8),
]  # fmt: skip
RED, BLUE, AMBER, GREEN, PURPLE, WHITE, SKY, ORANGE = range(8)


def outline(inset: float) -> Points:
    """A pointed window's edge (N, 2), counter-clockwise from below on the left: across and up, m; so far within it."""
    half = WIDE / 2
    radius = (half**2 + (TIP - SPRING) ** 2) / (2 * half)  # of a side, whose centre is level with the spring
    start = math.pi
    end = math.pi - math.asin((TIP - SPRING) / radius)
    side = [(radius - half + (radius - inset) * math.cos(a), SPRING + (radius - inset) * math.sin(a)) for a in np.linspace(start, end, 40)]
    side = [point for point in side if point[0] < 0]
    tip = (0.0, SPRING + math.sqrt((radius - inset) ** 2 - (radius - half) ** 2))
    keep = [side[i] for i in np.linspace(0, len(side) - 1, ARCH).round().astype(int)]
    left = [(-half + inset, SILL + inset), *keep]
    return np.array([*left, tip, *((-x, y) for x, y in reversed(left))])[::-1]


def clipped(cell: Points, region: Points) -> Points:
    """What of a convex cell lies in a convex region, both counter-clockwise."""
    for a, b in zip(region, np.roll(region, -1, axis=0), strict=True):
        off = (b - a)[0] * (cell - a)[:, 1] - (b - a)[1] * (cell - a)[:, 0]
        out = []
        for p, q, s, t in zip(cell, np.roll(cell, -1, axis=0), off, np.roll(off, -1), strict=True):
            if s >= -1e-9:
                out.append(p)
            if (s > 0) != (t > 0) and s != t:
                out.append(p + (q - p) * s / (s - t))
        if len(out) < 3:
            return np.zeros((0, 2))
        cell = np.array(out)
    return cell if area(cell) > 1e-5 else np.zeros((0, 2))


def area(edge: Points) -> float:
    """Of a polygon."""
    x, y = edge.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Points:
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)


def lattice(region: Points, colours: Iterable[int], wide: float, high: float) -> list[tuple[Points, int]]:
    """Diamonds over a region."""
    chosen, found = tuple(colours), []
    low, top = region.min(axis=0), region.max(axis=0)
    for j in range(math.floor((top[1] - low[1]) / high * 2) + 2):
        for i in range(-6, 7):
            middle = np.array([(i + 0.5 * (j % 2)) * wide, low[1] + j * high / 2])
            cell = clipped(middle + np.array([(0, -high / 2), (wide / 2, 0), (0, high / 2), (-wide / 2, 0)]), region)
            if len(cell):
                found.append((cell, chosen[(2 * i + 3 * j) % len(chosen)]))
    return found


def medallion(y: float, radius: float, half: float, colours: tuple[int, int, int, int]) -> list[tuple[Points, int]]:
    """A rose of petals in two rings, and the corners around it."""
    middle, petals = np.array([0.0, y]), 6
    found = []

    def at(r: float, a: float) -> Points:
        return middle + r * np.array([math.cos(a), math.sin(a)])

    angles = np.linspace(0, 2 * math.pi, 2 * petals + 1) + math.pi / (2 * petals)
    found.append((np.array([at(0.24 * radius, a) for a in angles[:-1]]), colours[2]))
    for k in range(petals):
        a, b, c = angles[2 * k : 2 * k + 3]
        inner = [at(share * radius, angle) for share, angle in ((0.7, b), (0.66, c), (0.24, c), (0.24, b), (0.24, a), (0.66, a))]
        found.append((np.array(inner), colours[k % 2]))
        outer = [at(share * radius, angle) for share, angle in ((1, b), (1, c), (0.66, c), (0.7, b), (0.66, a), (1, a))]
        found.append((np.array(outer), colours[2 + (k + 1) % 2]))
    for k in range(4):  # a fan from each corner
        corner = middle + half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)][k])
        ends = [at(radius * math.cos(math.pi / (2 * petals)), a * math.pi / 2) for a in (k, k + 1)]  # amid edges of the rose
        arc = [ends[0], *(at(radius, a) for a in angles if k < a / (math.pi / 2) < k + 1), ends[1]]
        sides = middle + half * np.array([(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)])[k : k + 2]
        found.append((np.array([corner, sides[1], *arc[::-1], sides[0]]), colours[(k + 1) % 2]))
    return found


def pieces(plan: int) -> list[tuple[Points, int]]:
    """The glass of a window: (its edge, its colour), from a corner that sees all of it."""
    outer, inner = outline(0.0), outline(0.13)
    colours = ((RED, WHITE, AMBER), (BLUE, WHITE, SKY), (GREEN, AMBER, WHITE))[plan]
    found = []
    for i in range(len(outer)):
        j = (i + 1) % len(outer)
        count = max(round(float(np.linalg.norm(outer[j] - outer[i])) / 0.5), 1)
        for k in range(count):
            a, b = k / count, (k + 1) / count
            edge = [outer[i] + (outer[j] - outer[i]) * a, outer[i] + (outer[j] - outer[i]) * b]
            edge += [inner[i] + (inner[j] - inner[i]) * b, inner[i] + (inner[j] - inner[i]) * a]
            found.append((np.array(edge), colours[(i + k) % 3]))
    half = WIDE / 2 - 0.13
    roses = (SILL + 0.3 + half, SILL + 0.47 + 3 * half)
    first, second = ((BLUE, PURPLE, AMBER, RED), (RED, ORANGE, WHITE, BLUE)), ((RED, AMBER, WHITE, GREEN), (BLUE, SKY, AMBER, RED))
    sets = (first, second, ((PURPLE, BLUE, WHITE, AMBER), (GREEN, SKY, AMBER, PURPLE)))[plan]
    for y, own in zip(roses, sets, strict=True):
        found += medallion(y, 0.92 * half, half, own)
    edges = [SILL + 0.13, *(y + side * half for y in roses for side in (-1, 1)), TIP]
    fields = ((BLUE, SKY, BLUE, AMBER), (RED, ORANGE, RED, WHITE), (PURPLE, BLUE, PURPLE, SKY))[plan]
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        field = clipped(rectangle(-half, low, half, high), inner)
        if len(field):
            found += lattice(field, fields, 0.33, 0.5)
    return found


def glaze(s: Scene, glass: int, lead: int, z: float, plan: int) -> None:
    """A window's glass, each piece of one texel of the palette, in a net of lead."""
    points, uv, faces = [], [], []
    lines, covered = {}, 0.0
    for edge, colour in pieces(plan):
        covered += sum(area(edge[[0, i, i + 1]]) for i in range(1, len(edge) - 1))
        first = len(points)
        points += [(WALL - DEEP / 2, y, z - x) for x, y in edge]
        uv += [((colour + 0.5) / len(PALETTE), 0.5)] * len(edge)
        faces += [first + k for i in range(1, len(edge) - 1) for k in (0, i, i + 1)]
        for a, b in zip(edge, np.roll(edge, -1, axis=0), strict=True):
            lines[tuple(sorted((tuple(a.round(4)), tuple(b.round(4)))))] = None
    assert math.isclose(covered, area(outline(0.0)), rel_tol=3e-3), "pieces overlap, or leave gaps"
    s.node(mesh=s.writer.mesh(points, faces, glass, NORMAL=[(1, 0, 0)] * len(points), TEXCOORD_0=uv), name=f"glass {plan + 1}")
    points, faces = [], []
    for a, b in lines:
        a, b = np.array(a), np.array(b)
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
        out = LEAD / 2 * np.array([-along[1], along[0]])
        ends = [a - out - LEAD / 2 * along, b - out + LEAD / 2 * along, b + out + LEAD / 2 * along, a + out - LEAD / 2 * along]
        first = len(points)
        points += [(WALL - DEEP / 2 + 0.004, y, z - x) for x, y in ends]
        faces += [first + k for k in (0, 1, 2, 0, 2, 3)]
    s.node(mesh=s.writer.mesh(points, faces, lead, NORMAL=[(1, 0, 0)] * len(points)), name=f"lead {plan + 1}")


def pierced(s: Scene, paint: int, centres: Iterable[float], low: float, high: float, top: float) -> None:
    """The wall with its windows: what lies between them, below, and above their arches."""
    middle, edges = WALL - DEEP / 2, [low]
    for z in centres:
        edges += [z - WIDE / 2, z + WIDE / 2]
    edges.append(high)
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        s.box(paint, (middle, top / 2, (a + b) / 2), (DEEP, top, b - a))
    arch = outline(0.0)[1:-1]
    for z in centres:
        s.box(paint, (middle, SILL / 2, z), (DEEP, SILL, WIDE))
        corners, faces = [], []
        for (x0, y0), (x1, y1) in itertools.pairwise(arch):
            n = len(corners)
            for x in (WALL, WALL - DEEP):
                corners += [(x, y0, z - x0), (x, y1, z - x1), (x, top, z - x1), (x, top, z - x0)]
            faces += [n + k for k in (0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6, 0, 4, 5, 0, 5, 1)]
        s.node(mesh=s.writer.mesh(corners, faces, paint))


def stained() -> None:
    """The sun through three windows of stained glass, into the dust of a chapel."""
    s = Scene()
    stone, dark, wood, floor = (s.paint(*c) for c in ((0.34, 0.31, 0.27), (0.2, 0.18, 0.16), (0.12, 0.07, 0.035), (0.42, 0.39, 0.34)))
    lead, cloth = s.paint(0.015, 0.015, 0.017), s.paint(0.5, 0.46, 0.4)
    codes = np.array([[(*colour, 255) for colour in PALETTE]], np.uint8)
    palette = {"index": s.writer.texture(codes, {"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071})}
    more: dict[str, Any] = {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.95}}, "doubleSided": True}
    more |= {"emissiveTexture": palette, "emissiveFactor": [0.6, 0.6, 0.6]}  # the sky behind them
    surface = {"baseColorTexture": palette, "metallicFactor": 0, "roughnessFactor": 0.4}
    glass = s.writer.add("materials", pbrMetallicRoughness=surface, **more)
    s.writer.json["extensionsUsed"].append("KHR_materials_transmission")
    top, centres = 5.0, (-4.55, -2.25, 0.05)
    s.room(stone, (WALL, 0, -6.9), (2.9, top, 3.3), "back right top front")
    s.room(floor, (WALL - DEEP, 0, -6.9), (2.9, top, 3.3), "floor")
    pierced(s, stone, centres, -7.0, 3.4, top)
    for plan, z in enumerate(centres):
        glaze(s, glass, lead, z, plan)
    # Piers between the windows, and ribs from them over the ceiling
    for z in (-5.7, -3.4, -1.1, 1.2):
        s.box(dark, (WALL + 0.11, 2.0, z), (0.22, 4.0, 0.3))
        s.box(dark, (2.9 - 0.11, 2.0, z), (0.22, 4.0, 0.3))
        bent = [np.array([-0.05 - 2.85 * math.cos(a), 3.9 + 1.05 * math.sin(a), z]) for a in np.linspace(0, math.pi, 11)]
        for a, b in itertools.pairwise(bent):
            s.bar(dark, a, b, 0.22, 0.22)
    # An altar on two steps, a cross behind it, and pews
    s.box(dark, (0.3, 0.08, -5.8), (4.2, 0.16, 2.1))
    s.box(dark, (0.3, 0.24, -6.0), (3.3, 0.16, 1.6))
    s.box(stone, (0.3, 0.78, -6.1), (1.9, 0.92, 0.75))
    s.box(cloth, (0.3, 1.25, -6.1), (2.0, 0.03, 0.82))
    s.box(cloth, (0.3, 1.05, -5.7), (0.7, 0.42, 0.02))
    s.bar(wood, (0.3, 1.26, -6.3), (0.3, 2.5, -6.3), 0.09)
    s.bar(wood, (-0.08, 2.12, -6.3), (0.68, 2.12, -6.3), 0.09)
    for k in range(4):
        z = -3.9 + 1.3 * k
        for x, wide in ((-1.45, 1.9), (1.85, 1.8)):
            s.box(wood, (x, 0.44, z), (wide, 0.05, 0.42))
            s.box(wood, (x, 0.72, z + 0.2), (wide, 0.5, 0.05), turn("x", 8))
            for side in (-1, 1):
                s.box(wood, (x + side * (wide / 2), 0.46, z + 0.02), (0.06, 0.92, 0.5))
    s.light("directional", (1.0, 0.93, 0.8), 150, (-0.73, 0.62, 0.16), (0, 0, 0))
    s.light("point", (1.0, 0.72, 0.4), 14, (0.3, 3.1, -4.9))
    s.camera("nave", (1.3, 1.62, 3.15), (-0.8, 1.75, -3.0), 50)
    s.save("stained")
