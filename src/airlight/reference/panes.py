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
COLOUR_CODES = np.array([2047, 2047, 1023])  # of 11, 11 and 10 bits
WHITE = 2**32 - 1
SAME = 1e-9  # of a distance, by which two that belong to one face may differ


@dataclass(frozen=True)
class Pane:
    """Describes what is seen through: triangles (N, 3, 3), world, and the share of light that each face lets through, 0..1, one or (3,).

    dims: whether it dims lights, which both sides do. side: on which the eye sees it, "front", "back" or "both".
    """

    triangles: Array
    passed: Any
    dims: bool = True
    side: str = "both"


def left_behind(depth: Any, surfaces: Any, left: Any) -> Array:
    """Finds what is left (...) of a light at depths (...), which fall with the distance from it, behind surfaces at depths (..., 4), each
    nearer to it than the next; left (..., 4): behind each."""
    count = (np.asarray(surfaces) > np.asarray(depth)[..., None]).sum(axis=-1)
    every = np.concatenate([np.ones((*count.shape, 1)), np.broadcast_to(left, (*count.shape, 4))], axis=-1)
    return np.asarray(np.take_along_axis(every, count[..., None], axis=-1)[..., 0])


def pack_left(left: Any) -> Array:
    """Packs (..., 3) what is left of a light, 0..1, into codes (...), uint32, of the roots of its parts."""
    codes = np.rint(np.sqrt(np.clip(left, 0, 1)) * COLOUR_CODES).astype(np.uint32)
    return np.asarray(codes[..., 0] | codes[..., 1] << np.uint32(11) | codes[..., 2] << np.uint32(22))


def unpack_left(code: Any) -> Array:
    """Unpacks (..., 3) what `pack_left` packs."""
    code = np.asarray(code, np.uint32)
    parts = np.stack([code & np.uint32(2047), code >> np.uint32(11) & np.uint32(2047), code >> np.uint32(22)], axis=-1)
    return np.asarray((parts / COLOUR_CODES) ** 2)


def code_behind(depth: Any, surfaces: Any, codes: Any) -> Array:
    """Chooses, as `left_behind`, codes (...), uint32, of what is left of a light; codes (..., 4): behind each surface."""
    count = (np.asarray(surfaces) > np.asarray(depth)[..., None]).sum(axis=-1)
    every = np.concatenate([np.full((*count.shape, 1), WHITE, np.uint32), np.asarray(codes, np.uint32)], axis=-1)
    return np.asarray(np.take_along_axis(every, count[..., None], axis=-1)[..., 0])


def dimmed_steps(n: Any, directional: bool, coloured: bool = False) -> Array:
    """Chooses how many of n steps take what is left of a light from one look-up."""
    n = np.asarray(n)
    if coloured:
        return np.where(n >= 64, 2.0, 1.0)
    return np.where(n >= 64, 8.0 if directional else 4.0, np.where(n >= 32, 2.0, 1.0))


class _Division:
    """Divides segments of rays where panes dim what is seen, or a light: as `tracer.layer` asks."""

    def __init__(self, panes: Sequence[Pane], lights: Sequence[PunctualLight]) -> None:
        self.panes = panes
        self.volumes = [[(tracer.shadow_volumes(pane.triangles, light), pane.passed) for pane in panes if pane.dims] for light in lights]

    def __call__(self, tile: tracer.Tile, number: int | None, segments: tracer.Segments) -> Iterator[tuple[Any, tracer.Segments]]:
        met = [(*self._seen_behind(tile, pane), pane.passed) for pane in self.panes]
        for volumes, passed in [] if number is None else self.volumes[number]:
            met.append((*tracer.hidden(tile.origin, tile.ray, tile.reach, tracer.in_reach(tile, *volumes)), passed))
        channels = 3 if any(np.size(passed) > 1 for *_, passed in met) else 1
        shaped = ((a, b, np.broadcast_to(passed, (*a.shape, channels))) for a, b, passed in met)
        low, high, left = (np.concatenate(parts, axis=1) for parts in zip(*shaped, strict=True))
        # Keep of each ray what dims a part of it
        dims = low < high
        order = np.argsort(~dims, axis=1, kind="stable")[:, : int(dims.sum(axis=1).max(initial=0))]
        left = np.take_along_axis(left, order[..., None], axis=1)
        low, high, dims = (np.take_along_axis(x, order, axis=1) for x in (low, high, dims))
        left = np.where(dims[..., None], left, 1.0)
        # Cut the segments, and weigh each part by all that dims it
        which, start, end = segments
        marks = np.column_stack([start, low[which], high[which], end])
        marks = np.sort(np.clip(marks, start[:, None], end[:, None]), axis=1)
        row, column = np.nonzero(marks[:, 1:] > marks[:, :-1])
        which, start, end = which[row], marks[row, column], marks[row, column + 1]
        middle = (start + end)[:, None] / 2
        behind = (low[which] < middle) & (middle < high[which])
        shares = np.where(behind[..., None], left[which], 1.0).prod(axis=1).round(12)
        different, each = np.unique(shares, axis=0, return_inverse=True)
        each = each.reshape(-1)
        for i in np.flatnonzero(different.any(axis=1)).tolist():
            some = each == i
            yield different[i], (which[some], start[some], end[some])

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


def with_lit(list: Any, k: Any) -> Array:
    """Notes in lists of steps that are lit, three bits each, that the k-th is."""
    return np.asarray(list, np.uint32) << np.uint32(3) | np.asarray(k, np.uint32)


def lit_step(list: Any, count: Any, part: Any) -> Array:
    """Chooses one of so many steps of a list to stand for all; part: 0..1."""
    at = np.floor(np.asarray(part, np.float32) * np.asarray(count, np.float32)).astype(np.uint32)
    return (np.asarray(list, np.uint32) >> np.uint32(3) * at & np.uint32(7)).astype(float)


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
