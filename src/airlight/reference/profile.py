"""Profiles of camera rays before surfaces that are seen through, as scatter/march/profile.wgsl has them; and what is seen through several.

A span of knots is (first, last, count, reach): so many knots from first to last, m, evenly apart, and one more at the ray's end.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.medium import mean_transmittance

Array = npt.NDArray[np.float64]


def ray_distance(uv: Any, depth: Any, rays: Any, terms: Any, flat: Any) -> Array:
    """Measures how far along the camera's rays of picture positions uv (..., 2) depths (...) lie, m: see `eye_rays`, `depth_terms`."""
    rays, terms, depth = np.asarray(rays, float), np.asarray(terms, float), np.asarray(depth, float)
    at = rays[..., :2] * np.asarray(uv, float) + rays[..., 2:]
    ahead = (terms[..., 0] * depth + terms[..., 1]) / (terms[..., 2] * depth + terms[..., 3])
    return np.maximum(ahead, 0) * np.where(np.asarray(flat) > 0, 1.0, np.sqrt(1 + (at**2).sum(axis=-1)))


def knot(span: Any, k: Any) -> Array:
    """Places the k-th knots (...) of spans (..., 4), m."""
    first, last, count, reach = np.moveaxis(np.asarray(span, float), -1, 0)
    share = np.asarray(k, float) / np.maximum(count - 1, 1)
    return np.where(k >= count, reach, first + (last - first) * share)


def knot_before(span: Any, t: Any) -> Array:
    """Finds the knots (...) at or before which distances t lie; -1: before the first."""
    first, last, count, _ = np.moveaxis(np.asarray(span, float), -1, 0)
    along = (t - first) / np.maximum(last - first, 1e-20)
    found = np.where(t >= last, count - 1, np.floor(along * (count - 1)))
    return np.where((count == 0) | (t < first), -1.0, found)


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
