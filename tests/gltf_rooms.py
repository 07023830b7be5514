"""Small rooms as glTF files, for tests of light in scenes."""

from typing import Any

import numpy as np
from gltfs import Writer


def box(x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """(24, 3) corners of faces, half sizes x, y, z; their normals; indices."""
    points, normals, faces = [], [], []
    for axis in range(3):
        for side in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for a, b in ((-1, -1), (side, -side), (1, 1), (-side, side)):
                corner = [0, 0, 0]
                corner[axis], corner[u], corner[v] = side, a, b
                points.append(corner)
                normals.append([side * (i == axis) for i in range(3)])
            faces += [len(points) - 4 + i for i in (0, 1, 2, 0, 2, 3)]
    return np.array(points) * (x, y, z), np.array(normals), faces


def add_box(w: Writer, size: tuple[float, float, float], at: tuple[float, float, float], material: int, **more: Any) -> int:
    points, normals, faces = box(*size)
    return w.node(mesh=w.mesh(points, faces, material, NORMAL=normals), translation=list(at), **more)


def room(bulb: float = 0.0) -> Writer:
    """Posts on a floor before a wall, seen from the front. bulb: radiance of a cube with sides of 0.4 m behind them, 0: none."""
    w = Writer()
    grey = w.add("materials", pbrMetallicRoughness={"baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 1, "metallicFactor": 0})
    add_box(w, (5, 0.1, 5), (0, -0.1, 0), grey, name="Floor")
    add_box(w, (5, 3, 0.1), (0, 3, -5), grey, name="Wall")
    for i in range(3):
        add_box(w, (0.15, 1, 0.15), (2 * i - 2, 1, 0), grey, name=f"Post {i + 1}")
    if bulb:
        strength = {"KHR_materials_emissive_strength": {"emissiveStrength": bulb}}
        add_box(w, (0.2, 0.2, 0.2), (0.4, 1.5, -2), w.add("materials", emissiveFactor=[1, 0.5, 0.25], extensions=strength), name="Bulb")
    camera = w.add("cameras", type="perspective", perspective={"yfov": 0.8, "znear": 0.1})
    w.node(camera=camera, translation=[0, 1.8, 6.5])
    return w
