"""Close lines where a light needs them: in the sectors of lines whose sums bend from one wide line to the next, as the device finds."""

import itertools
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import timing
from airlight.scatter.epipolar.gather import CORNER
from airlight.scatter.epipolar.grid import SECTOR, Grid, Quadrant
from airlight.scatter.epipolar.moments import Array

DETAIL = "scatter/epipolar/detail.wgsl"
WINDOW = struct_dtype(DETAIL, "Window")
MOST = 0.04  # root mean square of the bend from line to line, over the mean of all sums, up to which wide lines do
LANES = 64  # detail.wgsl
NEEDLE = 0.25  # of a run's far end, up to which its near end is so narrow that its triangles would be needles
ROWS = 32  # of the sums, that are judged together


def wedges(grid: Grid) -> Array:
    """Make CORNER records, three a triangle, of each sector of close lines; they may reach beyond the picture."""
    out = []
    for q in grid.quadrants:
        sectors = (q.lines - 1) // SECTOR
        across = q.m_lo + q.dm * SECTOR * np.arange(sectors + 1)
        runs = [(max(a, q.stored), b) for a, b in q.runs[0] if b > q.stored]
        for first, last in reversed(runs):  # from the farthest: a nearer one is drawn over it
            # from the light in one triangle, where two would make needles: corners' sectors, sides of them, ends of the run
            is_whole = q.u[first] < NEEDLE * q.u[last]
            sides, ends = ([0, 0, 1], [0, 1, 1]) if is_whole else ([0, 0, 1, 1, 1, 0], [0, 1, 1, 1, 0, 0])
            i, side, end = (a.reshape(-1) for a in np.broadcast_arrays(np.arange(sectors)[:, None], sides, ends))
            # the picture's nearest and farthest pixels may lie on the first and last node, or a rounding outside
            before = q.u[first] if is_whole else min(1.0, q.u[first]) * (first == q.stored)
            after = 1.0 * (last == len(q.u) - 1)
            u = np.array([q.u[first] - before, q.u[last] + after])[end]
            node = np.array([first - before / (q.u[first + 1] - q.u[first]), last + after / (q.u[last] - q.u[last - 1])])[end]
            v = across[i + side] * u
            record = np.zeros(len(i), CORNER)
            record["position"][:, q.axis] = grid.light[q.axis] + q.sign * u
            record["position"][:, 1 - q.axis] = grid.light[1 - q.axis] + v
            begin = q.column0 + (SECTOR + 1) * i + 0.5
            share = u / q.u[-1]
            record["line"] = np.stack([(begin + SECTOR * side) * share / grid.columns, share], axis=1)
            record["first"], record["last"] = begin / grid.columns, (begin + SECTOR) / grid.columns
            record["row"] = (q.row0 + node - q.stored + 0.5) / grid.rows
            record["sector"] = q.sector0 + i
            out.append(record)
    return np.concatenate(out)


def _pieces(wide: Grid, q: Quadrant) -> list[tuple[int, int, int]]:
    """List (zone, first node, nodes) of some nodes of wide lines each, from where these are farther apart than CLOSE_PX."""
    out = []
    for zone, (begin, end) in enumerate(itertools.pairwise(q.splits)):
        first = max(begin, q.stored, int(np.searchsorted(q.u, wide.near(q))))
        if first <= end:
            cuts = np.linspace(first, end + 1, -(-(end + 1 - first) // ROWS) + 1).round().astype(int).tolist()
            out += [(zone, a, b - a) for a, b in itertools.pairwise(cuts)]
    return out


def _seen(wide: Grid, q: Quadrant, slopes: Array) -> tuple[Array, Array]:
    """Find the distances along the major axis at which lines of some slopes enter the picture, and leave it."""
    ends = np.array([0.0, wide.size[1 - q.axis]]) - wide.light[1 - q.axis]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = [np.where(slopes == 0, np.copysign(np.inf, end), end / slopes) for end in ends]
    return np.minimum(*crossings), np.maximum(*crossings)


def windows(close: Grid, wide: Grid) -> Array:
    """Make WINDOW records of the sums of wide lines, by which the sectors of close lines are judged."""
    out = []
    of = {(q.axis, q.sign): q for q in wide.quadrants}
    for q in close.quadrants:
        own = of[q.axis, q.sign]
        sector = np.arange((q.lines - 1) // SECTOR)
        is_judged = np.zeros(len(sector), bool)
        for zone, node, nodes in _pieces(wide, own):
            stride = 2 ** (len(own.splits) - 2 - zone)
            last = (own.lines - 1) // stride - 1  # column that has a neighbour on each side
            ends = (q.m_lo - own.m_lo + q.dm * SECTOR * np.stack([sector, sector + 1])) / (own.dm * stride)
            begin = np.clip(np.floor(ends[0]), 1, max(last, 1))
            end = np.clip(np.ceil(ends[1]), 1, max(last, 1))
            # beyond the picture their sums may not have been written
            slopes: Array = own.m_lo + own.dm * stride * np.stack([begin - 1, end + 1])
            entry, leave = _seen(wide, own, slopes)
            first = np.maximum(np.searchsorted(own.u, entry.max(axis=0)), node)
            final = np.minimum(np.searchsorted(own.u, leave.min(axis=0)), node + nodes) - 1
            record = np.zeros(len(sector), WINDOW)
            record["row"], record["rows"] = own.row0 + first - own.stored + zone, np.maximum(final - first + 1, 0)
            record["column"], record["columns"] = own.column0 + begin, (end - begin + 1) * (last >= 1)
            record["sector"] = q.sector0 + sector
            beyond = np.minimum(final + 1, len(own.u) - 1)
            record["area"] = 0.5 * np.abs(own.u[beyond] ** 2 - own.u[np.minimum(first, beyond)] ** 2) * q.dm * SECTOR
            out.append(record[final >= first])
            is_judged[record["sector"][final >= first] - q.sector0] = True
        edges = np.asarray(q.m_lo + q.dm * SECTOR * np.stack([sector, sector + 1]), np.float64)
        missed = np.flatnonzero(~is_judged & (_seen(wide, own, edges)[1].max(axis=0) > wide.near(own)))
        record = np.zeros(len(missed), WINDOW)
        record["sector"] = q.sector0 + missed
        out.append(record)
    return np.concatenate(out)


class DetailedSectors:
    """Plans the passes that find the sectors of close lines that a picture needs, in the sums of wide ones. lit: a f32 a sector."""

    def __init__(self, device: Device, close: Grid, wide: Grid, sums: Any) -> None:
        self.lit = device.buffer(size=4 * sum((q.lines - 1) // SECTOR for q in close.quadrants))
        judged = windows(close, wide)
        counts = {"measure": -(-len(judged) // LANES), "mark": 1}
        self.dispatches = [(device.pipeline(DETAIL, entry, MOST=MOST), count) for entry, count in counts.items()]
        number = device.buffer(np.array([len(judged), 0, 0, 0], np.uint32).tobytes(), uniform=True)
        found = device.buffer(size=8 * len(judged))
        self.bind = device.bind(DETAIL, sums, device.buffer(judged.tobytes()), number, found, self.lit)

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the passes."""
        run = encoder.begin_compute_pass(**timing(timer, "epipolar detail", encoder))
        run.set_bind_group(0, self.bind)
        for pipeline, count in self.dispatches:
            run.set_pipeline(pipeline)
            run.dispatch_workgroups(count)
        run.end()
