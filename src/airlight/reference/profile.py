"""Profiles of camera rays before surfaces that are seen through, as scatter/march/profile.wgsl has them; and what is seen through several.

A span of knots is (first, last, count, reach): so many knots from first to last, m, evenly apart, and one more at the ray's end.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.medium import mean_transmittance

Array = npt.NDArray[np.float64]


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


def between_knots(a: Any, b: Any, share: Any, sigma_t: Any) -> Array:
    """Interpolates (..., 4), in-scattered radiance and optical length, at shares (...) of the way between two knots."""
    a, b, share = np.asarray(a, float), np.asarray(b, float), np.asarray(share, float)[..., None]
    every = b[..., 3:] - a[..., 3:]
    part = share * mean_transmittance(sigma_t * (share * every)) / mean_transmittance(np.asarray(sigma_t) * every)
    return np.concatenate([a[..., :3] + part * (b[..., :3] - a[..., :3]), a[..., 3:] + share * every], axis=-1)


def seen_through(behind: Any, source: Any, passed: Any, air: Any, transmittance: Any) -> Array:
    """Composites radiance (..., 3) seen through panes, from the farthest to the nearest.

    behind: what is seen without them, through the medium; of each pane, (N, ..., 3): source: what it sends to the eye itself, premultiplied;
    passed: the share of what is behind that it lets through; air: in-scattered radiance before it; transmittance: of the medium before it.

    Of a surface B at a distance T, L and T the medium's up to a distance, behind = L(T) + T(T) B, a pane of opacity a at t makes of it
    L(t) + T(t) [S + (1 - a) (what is behind, seen from t)] = (1 - a) behind + a L(t) + T(t) S.
    """
    out = np.asarray(behind, float)
    for s, p, light, t in zip(source, passed, air, transmittance, strict=True):
        out = np.asarray(p) * out + (1 - np.asarray(p)) * light + np.asarray(t) * s
    return out
