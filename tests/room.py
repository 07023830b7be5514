"""A room of sheets without thickness, for light that must not come through its joints."""

from typing import Any

import numpy as np
import pygfx as gfx

HALF, HEIGHT = (3.0, 4.0), 3.0  # along x and z; it stands on y = 0
OVER = 0.01  # metres by which the sheets around the window reach over others
WINDOW = ((1.0, 2.2), (-2.5, -0.5))  # in its wall at x = 3, along y and z


def _sheet(*corners: tuple[float, float, float]) -> Any:
    """A square seen from the side from which its corners go round counter-clockwise."""
    p = np.array(corners, np.float32)
    normals = np.tile(np.cross(p[1] - p[0], p[2] - p[0]), (4, 1)).astype(np.float32)
    geometry = gfx.Geometry(positions=p, normals=normals, indices=np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    mesh = gfx.Mesh(geometry, gfx.MeshStandardMaterial(color="#999", roughness=1.0, metalness=0.0, side="both"))
    mesh.cast_shadow = mesh.receive_shadow = True
    return mesh


def room(window: bool = False) -> list[Any]:
    """List its sheets. Those around a window reach over each other: where a corner lies on an edge, drivers may leave a gap of a texel."""
    (x, z), y = HALF, HEIGHT
    (low, high), (back, front) = WINDOW

    def wall(bottom: float, top: float, start: float, end: float) -> Any:
        return _sheet((x, bottom, start), (x, bottom, end), (x, top, end), (x, top, start))

    sheets = [
        _sheet((-x, 0, -z), (-x, 0, z), (x, 0, z), (x, 0, -z)),
        _sheet((-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)),
        _sheet((-x, 0, -z), (x, 0, -z), (x, y, -z), (-x, y, -z)),
        _sheet((-x, 0, z), (-x, y, z), (x, y, z), (x, 0, z)),
        _sheet((-x, 0, -z), (-x, y, -z), (-x, y, z), (-x, 0, z)),
    ]
    if not window:
        return [*sheets, wall(0, y, -z, z)]
    across = -z - OVER, z + OVER
    beside = wall(low - OVER, high + OVER, -z - OVER, back), wall(low - OVER, high + OVER, front, z + OVER)
    return [*sheets, wall(-OVER, low, *across), wall(high, y + OVER, *across), *beside]


def in_beam(points: np.ndarray, direction: np.ndarray, wider: float = 0.0) -> np.ndarray:
    """Whether the way from points (..., 3) in the room towards a sun leads through its window, wider by so many metres on each side."""
    (low, high), (back, front) = WINDOW
    s = (HALF[0] - points[..., 0]) / direction[0]
    y, z = points[..., 1] + s * direction[1], points[..., 2] + s * direction[2]
    return np.asarray((y > low - wider) & (y < high + wider) & (z > back - wider) & (z < front + wider))


def camera(width: int, height: int) -> Any:
    made = gfx.PerspectiveCamera(60, width / height, depth_range=(0.01, 100))
    made.local.position = (-0.5, 1.5, 3.7)
    made.look_at((0, 1.3, -4))
    made.set_view_size(width, height)
    return made


def seen(made: Any, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) where the pixels' rays meet the room, and (H, W) metres on the way there."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    far = np.stack([x, y, np.ones_like(x), np.ones_like(x)], axis=-1) @ np.linalg.inv(made.camera_matrix).T
    eye = np.asarray(made.world.position, float)
    rays = far[..., :3] / far[..., 3:] - eye
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    low, high = np.array([-HALF[0], 0, -HALF[1]]), np.array([HALF[0], HEIGHT, HALF[1]])
    t = np.where(rays > 0, (high - eye) / rays, (low - eye) / rays).min(axis=-1)
    return eye + t[..., None] * rays, t
