"""The rays of a light over a picture: lines of equal angle, samples of equal distance, in picture diagonals whatever its resolution."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
LINES, RADII = 1024, 128  # of a grid: angles, and distances at which the sum is kept
STEPS = 4  # of the sum from one kept distance to the next
HALF_WEIGHT_DIAGONALS = 0.15  # diagonals: emitters at this distance from the light count half
FARTHEST_LIGHT_DIAGONALS = 40.0  # diagonals: lights beyond are put there, whose rays are parallel to a pixel
WIDE_VIEW_RAD = math.radians(120)  # an angle of view from which blurs over angles keep their size; narrower views have finer ones


@dataclass(frozen=True)
class RayGrid:
    """Lays the lines of one light over a picture. size: (width, height) of the picture in any unit; position: of the light, normalised."""

    size: tuple[int, int]
    position: tuple[float, float]
    box: tuple[float, float] = field(init=False)  # of the picture, in diagonals
    light: tuple[float, float] = field(init=False)
    inside: bool = field(init=False)  # the lines then go all the way round
    start: float = field(init=False)  # angle of the first line's beginning, radians, y down
    span: float = field(init=False)
    nearest: float = field(init=False)  # distance of the light to the picture, diagonals
    farthest: float = field(init=False)

    def __post_init__(self) -> None:
        diagonal = math.hypot(*self.size)
        box = self.size[0] / diagonal, self.size[1] / diagonal
        light = [self.position[axis] * box[axis] for axis in (0, 1)]
        middle = [0.5 * side for side in box]
        off = math.hypot(light[0] - middle[0], light[1] - middle[1])
        if off > FARTHEST_LIGHT_DIAGONALS:
            light = [middle[axis] + (light[axis] - middle[axis]) * FARTHEST_LIGHT_DIAGONALS / off for axis in (0, 1)]
        corners = [(x * box[0] - light[0], y * box[1] - light[1]) for x in (0, 1) for y in (0, 1)]
        inside = all(0 < light[axis] < box[axis] for axis in (0, 1))
        start, span, nearest = 0.0, 2 * math.pi, 0.0
        if not inside:
            axis = math.atan2(middle[1] - light[1], middle[0] - light[0])
            away = [corner for corner in corners if corner != (0, 0)]  # from a corner upon the light rays go all ways
            turned = [(math.atan2(y, x) - axis + math.pi) % (2 * math.pi) - math.pi for x, y in away]
            start, span = axis + min(turned), max(turned) - min(turned)
            nearest = math.hypot(*(min(max(light[i], 0.0), box[i]) - light[i] for i in (0, 1)))
        for name, value in (("box", box), ("light", (light[0], light[1])), ("inside", inside), ("start", start), ("span", span)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "nearest", nearest)
        object.__setattr__(self, "farthest", max(math.hypot(x, y) for x, y in corners))

    @property
    def scale(self) -> float:
        """Scale all blurs over angles by the view's width."""
        return min(1.0, self.span / WIDE_VIEW_RAD)

    @property
    def step(self) -> float:
        """Measure the distance between two kept samples, diagonals."""
        return (self.farthest - self.nearest) / RADII

    def lines(self, degrees: float) -> float:
        """Convert an angle of a blur, at full scale, to lines."""
        return math.radians(degrees) * self.scale * LINES / self.span

    def entry(self, dx: Array, dy: Array) -> Array:
        """Find the distance at which rays of these unit directions enter the picture, diagonals; 0 where the light lies in it."""
        if self.inside:
            return np.zeros(np.broadcast(dx, dy).shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_borders = [
                np.where(d != 0, np.minimum(-at / d, (side - at) / d), -np.inf)
                for d, at, side in zip((dx, dy), self.light, self.box, strict=True)
            ]
        return np.asarray(np.maximum(0, np.maximum(*to_borders)))

    def polar(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Find distance from the light, diagonals, and number of the line, fractional, of points in diagonals."""
        dx, dy = x - self.light[0], y - self.light[1]
        turn = (np.arctan2(dy, dx) - self.start) % (2 * math.pi)
        if not self.inside:  # what lies a little before the first line is not a whole turn after it
            turn = np.where(turn > 0.5 * self.span + math.pi, turn - 2 * math.pi, turn)
        return np.hypot(dx, dy), turn * (LINES / self.span) - 0.5


def points(width: int, height: int) -> tuple[Array, Array]:
    """Find the centres of pixels, in diagonals: (x, y), (H, W) each."""
    diagonal = math.hypot(width, height)
    x, y = np.meshgrid((np.arange(width) + 0.5) / diagonal, (np.arange(height) + 0.5) / diagonal)
    return x, y
