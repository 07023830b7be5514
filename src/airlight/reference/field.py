"""Evaluates the density of a medium at points, in float64: air, fog by height and noise, then its fields in their order."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from airlight.medium.noise import noise_record
from airlight.medium.resolve import ResolvedMedium
from airlight.reference.noise import noise_density

if TYPE_CHECKING:
    from airlight.files.volumes import Volume

Array = npt.NDArray[Any]


def density(points: Any, medium: ResolvedMedium, footprint: Any = 0.0) -> Array:
    """Evaluates (...) the density of a medium at points (..., 3), m, in the axes in which it is drawn.

    footprint: (...) m, over which noise is averaged.
    """
    points = np.asarray(points, float)
    found = air_density(points, medium, footprint)
    for field in medium.fields:
        value, inside = grid_density(points + medium.origin, field.volume)
        found = blend(found, field.factor * value, inside, field.blend)
    return np.asarray(found)


def air_density(points: Array, medium: ResolvedMedium, footprint: Any = 0.0) -> Array:
    """Evaluates (...) the density of what fills all the space: air, fog and noise."""
    m, y = medium.settings, points[..., 1] - medium.fog_base
    found = np.full(points.shape[:-1], float(medium.air))
    if m.fog == "exponential":
        found *= np.exp(-np.maximum(y, 0) / medium.fog_depth)
    elif m.fog == "linear":
        found *= 1 + (m.fog_above - 1) * np.clip(y / medium.fog_depth, 0, 1)
    if m.noise_amount > 0:
        found *= noise_density(points, footprint, noise_of(medium))
    return found


def noise_of(medium: ResolvedMedium) -> dict[str, Any]:
    """Makes the record of a medium's noise for points in the axes in which it is drawn."""
    m = medium.settings
    return noise_record(medium.origin, m.wind, medium.time, medium.noise_size, m.noise_seed, m.noise_amount, m.noise_octaves)


def grid_density(points: Any, volume: "Volume") -> tuple[Array, Array]:
    """Interpolates (...) the density of a volume at points (..., 3), world, m, and tells (...) which of them lie in its box."""
    inverse = np.linalg.inv(volume.matrix)
    index = np.asarray(points, float) @ inverse[:3, :3].T + inverse[:3, 3]
    sides = np.array(volume.density.shape[::-1])
    inside = np.all((index >= -volume.edge) & (index <= sides - 1 + volume.edge), axis=-1)
    index = np.clip(index, 0, sides - 1)
    low = np.minimum(index.astype(np.int64), np.maximum(sides - 2, 0))
    share = index - low
    found: Any = 0.0
    for corner in np.ndindex(2, 2, 2):
        x, y, z = np.moveaxis(np.minimum(low + corner, sides - 1), -1, 0)
        found = found + np.where(corner, share, 1 - share).prod(axis=-1) * volume.density[z, y, x]
    return np.where(inside, found, 0.0), inside


def blend(there: Any, value: Any, inside: Any, how: str) -> Array:
    """Joins (...) a field's densities with those that lie there: adds; or, inside its box, multiplies, replaces, or takes min or max."""
    if how == "add":
        return np.asarray(there + np.where(inside, value, 0.0))
    joined = {"multiply": there * value, "replace": value, "min": np.minimum(there, value), "max": np.maximum(there, value)}[how]
    return np.where(inside, joined, there)
