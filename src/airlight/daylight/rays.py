"""Places the nodes of a quadrature along rays through the air, and integrates its densities up to each.

A ray is cut where its integrand may have a corner: at its lowest point, where it enters and leaves the earth's shadow, at the ends of what
else hides the sun. Each piece has Gauss's nodes in two halves, that crowd exponentially towards the piece's ends: what is near the eye, the
ground and an edge of a shadow is met at any density of the air.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from airlight.reference.daylight import (
    AEROSOL_HEIGHT,
    GROUND_RADIUS,
    RAYLEIGH_HEIGHT,
    Array,
    air_density,
    height_along,
    ozone_column,
    view_cosine_along,
)

HAZE, HAZE_LEVELS = 0.2, (1200.0, 2500.0, 4000.0, 6000.0, 8500.0)  # optical depth of aerosol beyond which rays are cut at heights, m
LONGEST_SCALE = 60_000.0  # m, over which nodes crowd in the thinnest air


class Nodes(NamedTuple):
    """Holds N nodes of rays (...): t and weights (..., N), m, to sum with; densities and columns to the eye (..., N, 3), m.

    end (..., 3): columns of the whole ray, m; piece (N,): index of each node's piece; middles (..., pieces), m: where each is halved.
    """

    t: Array
    weights: Array
    height: Array
    density: Array
    columns: Array
    end: Array
    piece: Array
    middles: Array


@cache
def gauss(count: int) -> tuple[Array, Array, Array]:
    """Give Gauss's nodes and weights on 0..1 (count,), and (count, count) what integrates up to each node."""
    x, weights = np.polynomial.legendre.leggauss(count)
    powers = np.polynomial.legendre.legvander(x, count - 1)
    upto = np.stack([np.polynomial.legendre.legval(x, np.polynomial.legendre.legint(row, lbnd=-1)) for row in np.eye(count)], axis=-1)
    return (x + 1) / 2, weights / 2, np.asarray(upto @ np.linalg.inv(powers)) / 2


def lowest_point(height: Array, mu: Array) -> Array:
    """Evaluates the way, m, to a ray's point nearest to the earth's centre; 0 where it rises from the start."""
    return np.asarray(np.maximum(-(GROUND_RADIUS + height) * mu, 0))


def reaching(height: Array, mu: Array, level: float) -> tuple[Array, Array]:
    """Evaluates the ways, m, to where a ray comes below a height, and to where it leaves it; 0 where that lies behind, or nowhere."""
    along = (GROUND_RADIUS + height) * mu
    squared = along**2 + (level - height) * (2 * GROUND_RADIUS + height + level)
    root = np.sqrt(np.maximum(squared, 0))
    return np.where(squared > 0, np.maximum(-along - root, 0), 0), np.where(squared > 0, np.maximum(root - along, 0), 0)


def earth_shadow(height: Array, mu: Array, mu_sun: Array, cosine: Array, level: float = 0.0) -> tuple[Array, Array]:
    """Evaluates where on a ray the earth's shadow begins and ends, m; both 0 where the ray meets none.

    The shadow is the cylinder behind the earth. mu, mu_sun: cosines of ray and sun at the ray's start; cosine: between ray and sun.
    level: m, of a sphere above the ground whose shadow is meant: within it sunlight has come below that height.
    """
    radius = GROUND_RADIUS + height
    a = np.maximum(1 - cosine**2, 1e-15)  # squared distance from the cylinder's axis, less R^2: a t^2 + 2 b t + c
    b = radius * (mu - mu_sun * cosine)
    c = (height - level) * (2 * GROUND_RADIUS + height + level) - (radius * mu_sun) ** 2
    squared = b * b - a * c
    root = np.sqrt(np.maximum(squared, 0))
    first, last = (-b - root) / a, (-b + root) / a
    towards = np.where(np.abs(cosine) > 1e-15, cosine, 1e-15)
    turn = -radius * mu_sun / towards  # where the sun is level: behind it is the dark half
    first, last = np.where(towards > 0, first, np.maximum(first, turn)), np.where(towards > 0, np.minimum(last, turn), last)
    first, last = np.maximum(first, 0), np.maximum(last, 0)
    meets = (squared > 0) & (last > first)
    return np.asarray(np.where(meets, first, 0)), np.asarray(np.where(meets, last, 0))


def crowd(height: Array, mu: Array, edges: Array, extinction: Array, count: int) -> tuple[Array, Array]:
    """Place nodes in pieces of rays (..., pieces + 1): t, m, and its speed by Gauss's x, both (..., pieces, 2 halves, count).

    In a first half x goes from the piece's start, in a second from its end backwards. extinction: (3, W), 1/m, of the densities.
    """
    x = gauss(count)[0]
    half = np.diff(edges, axis=-1)[..., None, None] / 2
    ends = np.stack([edges[..., :-1], edges[..., 1:]], axis=-1)
    height, mu = height[..., None, None], mu[..., None, None]
    thickest = (air_density(height_along(height, mu, ends)) @ extinction).max(axis=-1)
    scale = 1 / (thickest + np.abs(view_cosine_along(height, mu, ends)) / AEROSOL_HEIGHT + 1 / LONGEST_SCALE)[..., None]
    rate = np.log1p(half / scale)
    grown = np.exp(rate * x)
    return ends[..., None] + np.minimum(scale * (grown - 1), half) * np.array([[1.0], [-1.0]]), scale * rate * grown


def columns_along(height: Array, mu: Array, length: Array, count: int) -> Array:
    """Integrate (..., 3) columns of the densities, m, over rays of shape (...): the tent of ozone exactly, the others by Gauss's rule."""
    inner = [np.minimum(lowest_point(height, mu), length)] if (mu < 0).any() else []  # rays that rise have one piece
    edges = np.stack([np.zeros_like(length), *inner, length], axis=-1)
    t, speed = crowd(height, mu, edges, np.zeros((3, 1)), count)
    at = np.maximum(height_along(height[..., None, None, None], mu[..., None, None, None], t), 0)
    weights = speed * gauss(count)[1]
    rayleigh, aerosol = ((np.exp(-at / scale) * weights).sum(axis=(-3, -2, -1)) for scale in (RAYLEIGH_HEIGHT, AEROSOL_HEIGHT))
    return np.stack([rayleigh, aerosol, ozone_column(height, mu, length)], axis=-1)


def hazy(extinction: Array) -> bool:
    """Decide whether an aerosol is so dense that rays are cut at heights. extinction: (3, W), 1/m."""
    return bool(extinction[1].max() * AEROSOL_HEIGHT > HAZE)


def place_nodes(height: Array, mu: Array, length: Array, breaks: list[Array], extinction: Array, count: int) -> Nodes:
    """Place nodes along rays of shape (...): height, cosine and length, m.

    breaks: (...) each, where rays are cut, any order; extinction: (3, W), 1/m, of the densities; count: of nodes in half a piece, fewer in
    haze, which makes more pieces.
    """
    if hazy(extinction):
        breaks, count = [*breaks, *(way for level in HAZE_LEVELS for way in reaching(height, mu, level))], max(count // 2, 4)
    _, weights, upto = gauss(count)
    inner = [np.clip(one, 0, length) for one in np.broadcast_arrays(length, lowest_point(height, mu), *breaks)[1:]]
    edges = np.sort(np.stack([np.zeros_like(length), *inner, length], axis=-1), axis=-1)
    edges[..., 1:] = np.sort(np.where(np.diff(edges) > 0, edges[..., 1:], length[..., None]), axis=-1)  # pieces without length come last,
    edges = edges[..., : int((np.diff(edges) > 0).sum(axis=-1).max(initial=1)) + 1]  # and those that no ray needs are left out
    t, speed = crowd(height, mu, edges, extinction, count)
    heights = np.maximum(height_along(height[..., None, None, None], mu[..., None, None, None], t), 0)
    density = air_density(heights)
    by_x = density * speed[..., None]
    column = np.matmul(upto, by_x)
    total = np.matmul(weights, by_x)  # (..., pieces, 2, 3)
    column[..., 1, :, :] = total[..., 1, None, :] - column[..., 1, :, :]  # which went from the piece's end
    before = np.cumsum(total.reshape(*total.shape[:-3], -1, 3), axis=-2).reshape(total.shape)
    column = np.maximum(column + (before - total)[..., None, :], 0)
    column[..., 2] = ozone_column(height[..., None, None, None], mu[..., None, None, None], t)  # whose tent Gauss's rule would round off
    end = before[..., -1, -1, :]
    end[..., 2] = ozone_column(height, mu, length)
    flat = (*length.shape, -1)
    return Nodes(
        t=t.reshape(flat), weights=(speed * weights).reshape(flat), height=heights.reshape(flat), density=density.reshape(*flat, 3),
        columns=column.reshape(*flat, 3), end=end, piece=np.repeat(np.arange(edges.shape[-1] - 1), 2 * count),
        middles=(edges[..., 1:] + edges[..., :-1]) / 2,
    )  # fmt: skip


def path_weights(nodes: Nodes, extinction: Array) -> tuple[Array, Array]:
    """Give (..., N, W) weights of nodes times transmittance to the eye, and (..., W) transmittance of whole rays.

    In haze, where nodes may be few, weights are scaled down so that no ray loses more than it has. extinction: (3, W), 1/m.
    """
    left = nodes.weights[..., None] * np.exp(-nodes.columns @ extinction)
    through = np.exp(-nodes.end @ extinction)
    if hazy(extinction):
        lost = (left * (nodes.density @ extinction)).sum(axis=-2)
        left *= np.minimum(-np.expm1(-nodes.end @ extinction) / np.maximum(lost, 1e-300), 1)[..., None, :]
    return left, through
