"""Writes a scene of a misty room with glass in it: python scripts/glass_room.py OUT.glb

The sun falls through two windows, one of them with coloured panes, onto a table with bottles; a glass screen stands in front. Metres, lux.
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from validation_scenes import Scene, turn

SIDES = 40  # of what is turned
PANES = ((0.95, 0.35, 0.12), (0.15, 0.45, 0.9), (0.98, 0.75, 0.15), (0.25, 0.75, 0.35), (0.75, 0.2, 0.45))


class Room(Scene):
    def turned(self, paint: int, place: Any, outline: Any) -> None:
        """What a line of (radius, height) makes when it is turned about the vertical."""
        line = np.array(outline, float)
        around = 2 * np.pi * np.arange(SIDES + 1) / SIDES
        circle = np.stack([np.cos(around), np.sin(around)], axis=-1)
        points = np.stack([np.insert(radius * circle, 1, height, axis=1) for radius, height in line])
        slope = np.gradient(line, axis=0)
        out = np.stack([np.insert(rise * circle, 1, -widening, axis=1) for widening, rise in slope])
        out /= np.linalg.norm(out, axis=-1, keepdims=True)
        faces = []
        for i in range(len(line) - 1):
            for j in range(SIDES):
                a, b = i * (SIDES + 1) + j, (i + 1) * (SIDES + 1) + j
                faces += [a, b, a + 1, a + 1, b, b + 1]
        self.node(mesh=self.writer.mesh(points.reshape(-1, 3), faces, paint, NORMAL=out.reshape(-1, 3)), translation=place)


def window(s: Room, wall: int, frame: int, openings: Any, y0: float, y1: float) -> None:
    """The left wall with its windows, each of three by three panes."""
    x, edges = -3.05, [-5.1, *(z for pair in openings for z in pair), 3.7]
    s.box(wall, (x, y0 / 2, -0.7), (0.1, y0, 8.8))
    s.box(wall, (x, (y1 + 3.4) / 2, -0.7), (0.1, 3.4 - y1, 8.8))
    for z0, z1 in zip(edges[::2], edges[1::2], strict=True):
        s.box(wall, (x, (y0 + y1) / 2, (z0 + z1) / 2), (0.1, y1 - y0, z1 - z0))
    for z0, z1 in openings:
        for k in range(1, 3):
            s.box(frame, (x, (y0 + y1) / 2, z0 + (z1 - z0) * k / 3), (0.07, y1 - y0, 0.05))
            s.box(frame, (x, y0 + (y1 - y0) * k / 3, (z0 + z1) / 2), (0.07, 0.05, z1 - z0))


def main(path: str) -> None:
    s = Room()
    wall, wood, frame, floor = (s.paint(*c) for c in ((0.30, 0.27, 0.24), (0.17, 0.09, 0.045), (0.06, 0.05, 0.045), (0.20, 0.15, 0.11)))
    s.room(wall, (-3, 0, -5), (3.4, 3.3, 3.6), "back right top front")
    s.room(floor, (-3, 0, -5), (3.4, 3.3, 3.6), "floor")
    openings, y0, y1 = ((-3.6, -1.9), (-0.9, 0.8)), 0.9, 2.9
    window(s, wall, frame, openings, y0, y1)
    coloured = [s.glass(*c, 0.8) for c in PANES]
    z0, z1 = openings[0]
    for i in range(3):
        for j in range(3):
            place = (-3.05, y0 + (y1 - y0) * (j + 0.5) / 3, z0 + (z1 - z0) * (i + 0.5) / 3)
            s.pane(coloured[(2 * i + 3 * j) % len(PANES)], place, (z1 - z0) / 3, (y1 - y0) / 3, turn("y", 90))
    # A table with bottles
    s.box(wood, (-0.15, 0.78, -1.55), (2.3, 0.06, 1.0))
    for x in (-1.15, 0.85):
        for z in (-1.95, -1.15):
            s.box(wood, (x, 0.38, z), (0.08, 0.76, 0.08))
    bottle = [(0.0, 0), (0.105, 0.0), (0.115, 0.03), (0.115, 0.3), (0.09, 0.38), (0.04, 0.44), (0.034, 0.56), (0.042, 0.58), (0.036, 0.6)]
    bowl = [(0.0, 0), (0.08, 0.0), (0.14, 0.06), (0.19, 0.14), (0.21, 0.22), (0.2, 0.22)]
    colours = (0.1, 0.5, 0.22, 0.45), (0.12, 0.3, 0.75, 0.4), (0.8, 0.4, 0.06, 0.45), (0.8, 0.9, 0.95, 0.16)
    green, blue, amber, clear = (s.glass(*colour) for colour in colours)
    for paint, place, shape in (
        (green, (-0.75, 0.81, -1.45), bottle),
        (amber, (-0.2, 0.81, -1.75), bottle),
        (blue, (0.28, 0.81, -1.35), bottle),
        (clear, (0.62, 0.81, -1.7), bowl),
    ):
        s.turned(paint, place, shape)
    # A screen of glass, half of the view, in a frame
    screen, angle = s.glass(0.55, 0.75, 0.7, 0.12), 14
    middle, across = np.array([0.75, 1.15, 0.5]), np.array([math.cos(math.radians(angle)), 0, -math.sin(math.radians(angle))])
    s.pane(screen, middle, 1.3, 2.1, turn("y", angle))
    for side in (-0.65, 0.0, 0.65):
        s.box(frame, middle + side * across, (0.035, 2.16, 0.035), turn("y", angle))
    for height in (-1.06, 0.0, 1.06):
        s.box(frame, middle + (0, height, 0), (1.33, 0.035, 0.035), turn("y", angle))
    s.light("directional", (1.0, 0.88, 0.68), 40, (-0.76, 0.5, 0.29), (0, 0, 0))
    s.light("point", (0.7, 0.8, 1.0), 3.0, (2.9, 2.9, -1.0))
    s.camera("room", (1.15, 1.5, 3.3), (-0.55, 1.22, -1.8), 44)
    Path(path).write_bytes(s.writer.glb())


if __name__ == "__main__":
    main(sys.argv[1])
