"""Profiles of camera rays before surfaces that are seen through, as scatter/march/profile.wgsl has them; and what is seen through several.

A span of knots is where up to four of them lie, m, or else the first and the last, between which the others lie evenly; their number; and
the ray's end, where one more lies.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.medium import mean_transmittance

Array = npt.NDArray[np.float64]
LISTED = 4  # knots of a span that have each its own place


def ray_distance(uv: Any, depth: Any, rays: Any, terms: Any, flat: Any) -> Array:
    """Measures how far along the camera's rays of picture positions uv (..., 2) depths (...) lie, m: see `eye_rays`, `depth_terms`."""
    rays, terms, depth = np.asarray(rays, float), np.asarray(terms, float), np.asarray(depth, float)
    at = rays[..., :2] * np.asarray(uv, float) + rays[..., 2:]
    ahead = (terms[..., 0] * depth + terms[..., 1]) / (terms[..., 2] * depth + terms[..., 3])
    return np.maximum(ahead, 0) * np.where(np.asarray(flat) > 0, 1.0, np.sqrt(1 + (at**2).sum(axis=-1)))


def knot_place(knots: Any, count: Any, reach: Any, k: Any) -> Array:
    """Places the k-th knots (...) of spans, m: knots (..., 4), count, reach."""
    knots, count, k = np.asarray(knots, float), np.asarray(count, float), np.asarray(k, float)
    even = knots[..., 0] + (knots[..., 1] - knots[..., 0]) * k / np.maximum(count - 1, 1)
    own = np.take_along_axis(knots, np.clip(k, 0, LISTED - 1).astype(int)[..., None], axis=-1)[..., 0]
    return np.where(k >= count, reach, np.where(count <= LISTED, own, even))


def knot_before(knots: Any, count: Any, t: Any) -> Array:
    """Finds the knots (...) of spans at or before which distances t lie; -1: before the first."""
    knots, count, t = np.asarray(knots, float), np.asarray(count, float), np.asarray(t, float)
    along = (t - knots[..., 0]) / np.maximum(knots[..., 1] - knots[..., 0], 1e-20)
    even = np.clip(np.floor(along * (count - 1)), -1, count - 1)
    listed = ((knots <= t[..., None]) & (np.arange(LISTED) < count[..., None])).sum(axis=-1) - 1
    return np.where(count <= LISTED, listed, even)


def listed_knots(extremes: Any, sums: Any, count: Any) -> Array:
    """Places the knots (..., 4) of up to four surfaces, from the extremes (..., 2) of their distances, m, and the sums (..., 2) of these
    and of their squares."""
    (first, last), (total, squares), count = np.moveaxis(extremes, -1, 0), np.moveaxis(sums, -1, 0), np.asarray(count)
    middle = (total - first - last) / 2
    spread = np.sqrt(np.maximum((squares - first**2 - last**2) / 2 - middle**2, 0))
    third = np.where(count <= 3, last, np.clip(middle + spread, first, last))
    second = np.where(count <= 3, np.clip(2 * middle, first, last), np.clip(middle - spread, first, last))
    return np.stack([first, np.where(count <= 2, last, second), third, last], axis=-1)


def unpack_span(span: Any) -> tuple[Array, Array, Array]:
    """Unpacks spans, records of PackedSpan: knots (..., 4), count, reach."""
    knots = np.ascontiguousarray(span["knots"]).view(np.float16).astype(float)
    return knots, span["count"].astype(float), span["reach"].astype(float)


def pack_knot(value: Any) -> npt.NDArray[np.uint32]:
    """Packs (..., 4), in-scattered radiance and optical length, as half floats: (..., 2)."""
    return np.ascontiguousarray(np.minimum(np.asarray(value, float), 65504), np.float16).view(np.uint32)


def unpack_knot(packed: Any) -> Array:
    """Unpacks (..., 4), in-scattered radiance and optical length."""
    return np.ascontiguousarray(packed, np.uint32).view(np.float16).astype(float)


def between_knots(a: Any, b: Any, share: Any, sigma_t: Any) -> Array:
    """Interpolates (..., 4), in-scattered radiance and optical length, at shares (...) of the way between two knots."""
    a, b, share = np.asarray(a, float), np.asarray(b, float), np.asarray(share, float)[..., None]
    every = b[..., 3:] - a[..., 3:]
    part = share * mean_transmittance(sigma_t * (share * every)) / mean_transmittance(np.asarray(sigma_t) * every)
    return np.concatenate([a[..., :3] + part * (b[..., :3] - a[..., :3]), a[..., 3:] + share * every], axis=-1)


def seen_through(behind: Any, source: Any, passed: Any, air: Any, transmittance: Any) -> Array:
    """Composites radiance (..., 3) seen through panes, from the farthest to the nearest.

    behind: what is seen without them, through the medium. Of each pane, (N, ..., 3): source: what it sends to the eye, premultiplied;
    passed: the share of what is behind that it lets through; air: radiance scattered in before it; transmittance: of the medium there.

    A pane of opacity a at t, L and T the medium's up to there, makes of what is behind L + T [S + (1 - a) (it, as seen from t)], which is
    (1 - a) behind + a L + T S.
    """
    out = np.asarray(behind, float)
    for s, p, light, t in zip(source, passed, air, transmittance, strict=True):
        out = np.asarray(p) * out + (1 - np.asarray(p)) * light + np.asarray(t) * s
    return out
