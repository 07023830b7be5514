"""Places the table of what dims a light on its way through a density that varies, see scatter/march/shade.wgsl. float64, NumPy."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.shadows.fit import basis

CELLS_OF_TEXELS = 3 / 64  # along a table, for each texel along a shadow map
MIN_CELLS, MAX_CELLS = 32, 192
WIDEST_TANGENT = 1.5  # of the half angle of one face; what is wider takes the six of a cube
MAX_PIECES = 4  # from value to value
ALIGNED = 64  # values of which a column takes a multiple, as copies to a texture do


@dataclass(frozen=True)
class Shade:
    """Describes a light's table. All lengths in m.

    rows: (3, 4) from a place, as it is drawn, to an index; of a light with a position, to its axes. count: columns along x and y of a face,
    and values along a column. near, step: of a light with a position, the distance of the first values, and between two. tangent: of the
    half angle of a face. cell: width of a column, m or radians. pieces: see fill_shade.wgsl. alone: grids alone dim the light.
    """

    rows: np.ndarray
    count: tuple[int, int, int]
    faces: int
    near: float
    step: float
    tangent: float
    cell: float
    pieces: int
    alone: bool

    @property
    def into(self) -> np.ndarray:
        """Invert the rows: (3, 4)."""
        return np.asarray(np.linalg.inv(np.vstack([self.rows, [0, 0, 0, 1]]))[:3])

    @property
    def stride(self) -> int:
        """Count the values from a column to the next."""
        return -(-self.count[2] // ALIGNED) * ALIGNED

    @property
    def size(self) -> int:
        """Count the values, and what is left free between columns."""
        return self.faces * self.count[0] * self.count[1] * self.stride

    @property
    def texture_size(self) -> tuple[int, int, int]:
        """Count the texels of all faces: along a column, across, and down."""
        return self.count[2], self.count[0], self.faces * self.count[1]

    @property
    def key(self) -> tuple[Any, ...]:
        """Tell what it is made for."""
        return self.rows.tobytes(), self.count, self.faces, self.near, self.step, self.tangent, self.pieces, self.alone


def fit_shade(light: PunctualLight, medium: ResolvedMedium, box: np.ndarray) -> Shade | None:
    """Fit a light's table to a box (2, 3), as it is drawn, outside of which density is the air's; None where nothing but closed forms
    dims it."""
    if light.directional and (medium.sun_extinction == "none" or not (medium.fields or medium.sun_extinction == "all")):
        return None
    cells = round(min(max(medium.shadow_size * CELLS_OF_TEXELS, MIN_CELLS), MAX_CELLS))
    corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    voxel = min((_voxel(field.volume.matrix) for field in medium.fields), default=math.inf)
    if not isinstance(light, PositionalLight):
        axes = basis(light.axis()) * np.array([[1.0], [1.0], [-1.0]])  # the third one with the light
        local = corners @ axes.T
        low, high = local.min(axis=0), local.max(axis=0)
        cell = max(float((high - low).max()) / (cells - 3), 1e-9)
        low[:2] -= cell
        count = np.ceil((high - low) / cell).astype(int) + 2
        rows = np.column_stack([axes, -low]) / cell
        pieces = min(max(math.ceil(cell / voxel), 1), MAX_PIECES)
        alone = medium.sun_extinction == "volumes"
        return Shade(rows, (int(count[0]), int(count[1]), int(count[2])), 1, 0.0, cell, 1.0, cell, pieces, alone)
    at = np.asarray(light.position, float)
    to_middle, radius = box.mean(axis=0) - at, float(np.linalg.norm(box[1] - box[0])) / 2
    away = float(np.linalg.norm(to_middle))
    tangent = radius / math.sqrt(max(away**2 - radius**2, 1e-12)) if away > radius else math.inf
    one = tangent <= WIDEST_TANGENT
    axes = basis(to_middle / away) if one else np.eye(3)
    near, tangent = (away - radius, tangent * 1.02 + 1e-6) if one else (0.0, 1.0)
    across = cells if one else max(cells // 2, 16)
    step = (away + radius - near) / (cells - 1)
    pieces = min(max(math.ceil(step / voxel), 1), MAX_PIECES)
    rows, cell = np.column_stack([axes, -axes @ at]), 2 * tangent / (across - 1)
    return Shade(rows, (across, across, cells), 1 if one else 6, near, step, tangent, cell, pieces, False)


def _voxel(matrix: np.ndarray) -> float:
    """Measure a voxel's shortest side, m."""
    return float(np.linalg.norm(matrix[:3, :3], axis=0).min())
