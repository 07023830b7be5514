"""Traces the layer of a medium behind, between and before panes that are seen through, as ground truth: by the tracer, in float64.

Each face of a pane leaves a share of the light that passes it, of a lamp's on its way into the air and of the air's on its way to the eye.
So rays are cut where they meet faces, and where they enter what faces hide from a light; a segment between counts by the product of what
the faces before it leave. Of panes that are opaque this is what `tracer` does itself, by which `tests/test_panes.py` holds it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.reference import tracer
from airlight.reference.medium import Layer

Array = tracer.Array
SAME = 1e-9  # of a distance, by which two that belong to one face may differ


@dataclass(frozen=True)
class Pane:
    """Describes what is seen through: triangles (N, 3, 3), world, and the share of light that each face lets through, 0..1.

    dims: whether it dims lights, which both sides do. side: on which the eye sees it, "front", "back" or "both".
    """

    triangles: Array
    passed: float
    dims: bool = True
    side: str = "both"


def left_behind(depth: Any, surfaces: Any, left: Any) -> Array:
    """Finds what is left (...) of a light at depths (...), which fall with the distance from it, behind surfaces at depths (..., 4), each
    nearer to it than the next; left (..., 4): behind each."""
    count = (np.asarray(surfaces) > np.asarray(depth)[..., None]).sum(axis=-1)
    every = np.concatenate([np.ones((*count.shape, 1)), np.broadcast_to(left, (*count.shape, 4))], axis=-1)
    return np.asarray(np.take_along_axis(every, count[..., None], axis=-1)[..., 0])


def dimmed_steps(n: Any, directional: bool) -> Array:
    """Chooses how many of n steps take what is left of a light from one look-up."""
    n = np.asarray(n)
    return np.where(n >= 64, 8.0 if directional else 4.0, np.where(n >= 32, 2.0, 1.0))


class _Division:
    """Divides segments of rays where panes dim what is seen, or a light: as `tracer.layer` asks."""

    def __init__(self, panes: Sequence[Pane], lights: Sequence[PunctualLight]) -> None:
        self.panes = panes
        self.volumes = [[(tracer.shadow_volumes(pane.triangles, light), pane.passed) for pane in panes if pane.dims] for light in lights]

    def __call__(self, tile: tracer.Tile, number: int | None, segments: tracer.Segments) -> Iterator[tuple[float, tracer.Segments]]:
        met = [(*self._seen_behind(tile, pane), pane.passed) for pane in self.panes]
        for volumes, passed in [] if number is None else self.volumes[number]:
            met.append((*tracer.hidden(tile.origin, tile.ray, tile.reach, tracer.in_reach(tile, *volumes)), passed))
        low, high, left = (np.concatenate(parts, axis=1) for parts in zip(*((a, b, np.full(a.shape, p)) for a, b, p in met), strict=True))
        # Keep of each ray what dims a part of it
        dims = low < high
        order = np.argsort(~dims, axis=1, kind="stable")[:, : int(dims.sum(axis=1).max(initial=0))]
        low, high, left, dims = (np.take_along_axis(x, order, axis=1) for x in (low, high, left, dims))
        left = np.where(dims, left, 1.0)
        # Cut the segments, and weigh each part by all that dims it
        which, start, end = segments
        marks = np.column_stack([start, low[which], high[which], end])
        marks = np.sort(np.clip(marks, start[:, None], end[:, None]), axis=1)
        row, column = np.nonzero(marks[:, 1:] > marks[:, :-1])
        which, start, end = which[row], marks[row, column], marks[row, column + 1]
        middle = (start + end)[:, None] / 2
        shares = np.where((low[which] < middle) & (middle < high[which]), left[which], 1.0).prod(axis=1).round(12)
        for share in np.unique(shares[shares > 0]).tolist():
            some = shares == share
            yield share, (which[some], start[some], end[some])

    @staticmethod
    def _seen_behind(tile: tracer.Tile, pane: Pane) -> tuple[Array, Array]:
        """Finds (R, K) from where to where rays run behind faces of a pane."""
        faces = pane.triangles[tracer.in_beam(pane.triangles, tile.beam)]
        low = tracer.hit_distances(tile.origin, tile.ray, faces, tile.near, tile.reach)
        if pane.side != "both":
            to_eye = -tile.ray @ np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]).T
            low = np.where((to_eye > 0) == (pane.side == "front"), low, np.inf)
        low = np.sort(low, axis=1)
        with np.errstate(invalid="ignore"):
            again = np.diff(low, axis=1, prepend=-1.0) < SAME * low  # through an edge that two share
        low = np.where(again, np.inf, low)
        return low, np.broadcast_to(tile.reach[:, None], low.shape)


def layer(
    view: Any,
    projection: Any,
    size: tuple[int, int],
    triangles: Array,
    panes: Sequence[Pane],
    lights: Sequence[PunctualLight],
    medium: ResolvedMedium,
    casters: Array | None = None,
    told: Callable[[float], None] = lambda share: None,
) -> Layer:
    """Computes the layer of a medium as `tracer.layer`, seen through panes. triangles, casters: without these.

    The transmittance is the medium's alone, up to what is solid.
    """
    more = {"divide": _Division(panes, lights)} if panes else {}
    return tracer.layer(view, projection, size, triangles, lights, medium, casters, told, **more)
