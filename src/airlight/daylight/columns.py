"""Integrates the densities of the air along rays to its end, and tabulates them.

Three columns, m, one a density, serve all wavelengths and settings: optical depth is columns @ extinction.
"""

from functools import cache
from typing import Any

import numpy as np

from airlight.daylight.rays import columns_along
from airlight.reference.daylight import Array, depth_table_position, depth_table_ray, distance_to_top, in_earth_shadow

SHADER_SIZE = (64, 256)  # heights, cosines of the table that shaders read
SIZE = (128, 512)  # of the one that the library reads


def columns_to_top(height: Any, mu: Any, count: int = 20) -> Array:
    """Integrate (..., 3) columns, m, from heights under cosines to the end of the air, by Gauss's rule; the ground hides nothing."""
    height, mu = (np.array(a) for a in np.broadcast_arrays(np.asarray(height, float), np.asarray(mu, float)))
    return columns_along(height, mu, distance_to_top(height, mu), count)


@cache
def columns_table(size: tuple[int, int] = SIZE) -> Array:
    """Tabulate (heights, cosines, 3) columns, m, at the nodes of `depth_table_ray`, both ends included."""
    y, x = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]), indexing="ij")
    ray = depth_table_ray(np.stack([x, y], axis=-1))
    table = np.empty((*size, 3))
    for values, height, mu in zip(table, ray[..., 0], ray[..., 1]):  # row by row, which stays in the cache
        for some in (mu >= 0, mu < 0):
            values[some] = columns_to_top(height[some], mu[some], 8)
    table.setflags(write=False)
    return table


def table_columns(height: Any, mu: Any, table: Array | None = None) -> Array:
    """Read (..., C) values for rays from heights under cosines to the end of the air, bilinear in a table (heights, cosines, C)."""
    table = columns_table() if table is None else table
    rows, across, channels = table.shape
    at = depth_table_position(height, mu) * (across - 1, rows - 1)
    first = np.minimum(at.astype(np.int32), (across - 2, rows - 2))
    fraction = (at - first).astype(table.dtype)
    index = first[..., 1] * across + first[..., 0]
    flat = table.reshape(-1, channels)
    fx, fy = fraction[..., :1], fraction[..., 1:]
    low = flat[index] * (1 - fx) + flat[index + 1] * fx
    high = flat[index + across] * (1 - fx) + flat[index + across + 1] * fx
    return np.asarray(low * (1 - fy) + high * fy)


def sun_transmittance(height: Any, mu_sun: Any, extinction: Array, table: Array | None = None) -> Array:
    """Evaluate (..., W) transmittance from heights to the sun under cosines, by a table of columns; 0 in the earth's shadow."""
    columns = table_columns(height, mu_sun, table)
    through = np.exp(columns @ -extinction.astype(columns.dtype))
    through[in_earth_shadow(height, mu_sun)] = 0
    return through
