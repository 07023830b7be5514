"""Turn what the mouse does in the picture into positions: of a dragged light, of the split, of points in a scene."""

from collections.abc import Sequence

import numpy as np

NEAR = 14  # logical px within which a mark is taken hold of
Area = tuple[float, float, float, float]  # x, y, width, height, px


def fitted(size: tuple[int, int], room: Area) -> Area:
    """Fit a picture of width x height into the room, whole and in its middle, px; never enlarged beyond twice its size."""
    scale = min(room[2] / size[0], room[3] / size[1], 2.0)
    width, height = (max(1, round(scale * side)) for side in size)
    return (room[0] + (room[2] - width) // 2, room[1] + (room[3] - height) // 2, width, height)


def within(area: Area, size: tuple[int, int, int]) -> tuple[int, int, int, int]:
    """Cut an area to what lies in a texture, px."""
    x, y = (min(max(int(area[i]), 0), size[i] - 1) for i in (0, 1))
    width, height = (max(1, min(int(area[i] + area[2 + i]), size[i]) - at) for i, at in ((0, x), (1, y)))
    return x, y, width, height


def to_picture(at: tuple[float, float], area: Area) -> tuple[float, float]:
    """Convert a position on the canvas to one of the picture at `area`, normalised."""
    return (at[0] - area[0]) / area[2], (at[1] - area[1]) / area[3]


def to_canvas(position: Sequence[float], area: Area) -> tuple[float, float]:
    return area[0] + position[0] * area[2], area[1] + position[1] * area[3]


def clamped(at: tuple[float, float], area: Area, margin: float) -> tuple[tuple[float, float], tuple[float, float] | None]:
    """Pull a position on the canvas into an area, less a margin; and the unit direction in which it lies, None where it lies within."""
    x, y = (min(max(at[i], area[i] + margin), max(area[i] + area[2 + i] - margin, area[i] + margin)) for i in (0, 1))
    away = at[0] - x, at[1] - y
    length = float(np.hypot(*away))
    within = all(area[i] <= at[i] <= area[i] + area[2 + i] for i in (0, 1))
    return (at, None) if within else ((x, y), (away[0] / length, away[1] / length))


def nearest(at: tuple[float, float], marks: Sequence[tuple[float, float] | None], reach: float = NEAR) -> int | None:
    """Find the mark, on the canvas, that lies nearest to a position, within reach."""
    found = [(float(np.hypot(m[0] - at[0], m[1] - at[1])), i) for i, m in enumerate(marks) if m is not None]
    return min(found)[1] if found and min(found)[0] <= reach else None


def project(point: Sequence[float], clip: np.ndarray, area: Area) -> tuple[float, float] | None:
    """Project a point of the world onto the canvas; None behind the eye. clip: (4, 4) from world to clip space."""
    x, y, _, w = clip @ np.array([*point, 1.0])
    if w <= 1e-9:
        return None
    return to_canvas((0.5 + 0.5 * x / w, 0.5 - 0.5 * y / w), area)


def drag_in_view(point: Sequence[float], to: tuple[float, float], clip: np.ndarray, area: Area) -> tuple[float, float, float]:
    """Find the point of the world at the distance of `point` from the eye's plane that lies at `to` on the canvas."""
    here = clip @ np.array([*point, 1.0])
    x, y = to_picture(to, area)
    there = np.array([(2 * x - 1) * here[3], (1 - 2 * y) * here[3], here[2], here[3]])
    world = np.linalg.solve(clip, there)
    moved = world[:3] / world[3]
    return float(moved[0]), float(moved[1]), float(moved[2])


def toward_in_view(to: tuple[float, float], clip: np.ndarray, eye: Sequence[float], area: Area) -> tuple[float, float, float]:
    """Find the direction from the eye, of length 1, through a position on the canvas."""
    x, y = to_picture(to, area)
    far = np.linalg.solve(clip, np.array([2 * x - 1, 1 - 2 * y, 0.5, 1.0]))
    way = far[:3] / far[3] - np.asarray(eye)
    way = way / np.linalg.norm(way)
    return float(way[0]), float(way[1]), float(way[2])
