"""Close lines where a light needs them: in the sectors of lines that meet something bright, as the device finds them in the source."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import timing
from airlight.scatter.epipolar.gather import CORNER
from airlight.scatter.epipolar.grid import SECTOR, Grid
from airlight.scatter.epipolar.moments import Array

BRIGHT = "scatter/epipolar/bright.wgsl"
LINES = struct_dtype(BRIGHT, "Lines")
BLOCK, LANES = 16, 64  # bright.wgsl


def wedges(grid: Grid) -> Array:
    """Make CORNER records, three a triangle, of each sector of close lines; they may reach beyond the picture."""
    out = []
    for q in grid.quadrants:
        sectors = (q.lines - 1) // SECTOR
        across = q.m_lo + q.dm * SECTOR * np.arange(sectors + 1)
        for first, last in ((max(a, q.stored), b) for a, b in q.runs[0] if b > q.stored):
            # corners of two triangles: sector, side of it, end of the run
            i, side, end = (a.reshape(-1) for a in np.broadcast_arrays(np.arange(sectors)[:, None], [0, 0, 1, 1, 1, 0], [0, 1, 1, 1, 0, 0]))
            u = np.array([q.u[first], q.u[last]])[end]
            v = across[i + side] * u
            record = np.zeros(len(i), CORNER)
            record["position"][:, q.axis] = grid.light[q.axis] + q.sign * u
            record["position"][:, 1 - q.axis] = grid.light[1 - q.axis] + v
            begin = q.column0 + (SECTOR + 1) * i + 0.5
            share = u / q.u[-1]
            record["line"] = np.stack([(begin + SECTOR * side) * share / grid.columns, share], axis=1)
            record["first"], record["last"] = begin / grid.columns, (begin + SECTOR) / grid.columns
            record["row"] = (q.row0 + np.array([first, last])[end] - q.stored + 0.5) / grid.rows
            record["sector"] = q.sector0 + i
            out.append(record)
    return np.concatenate(out)


def lines(grid: Grid, wide: Grid, apron: int) -> Array:
    """Make four LINES records, by which a shader finds the sectors of a place in the source; zeros where there are fewer quadrants."""
    out = np.zeros(4, LINES)
    near = {(q.axis, q.sign): wide.near(q) for q in wide.quadrants}
    for record, q in zip(out, grid.quadrants, strict=False):
        major, minor = grid.light[q.axis] + apron, grid.light[1 - q.axis] + apron
        record["u"] = -q.sign * major, q.sign
        record["line"] = q.m_lo * q.sign * major - minor, -q.m_lo * q.sign
        record["scale"] = 1 / (q.dm * SECTOR)
        record["near"] = near[q.axis, q.sign]
        record["is_down"], record["first"], record["sectors"] = q.axis, q.sector0, (q.lines - 1) // SECTOR
    return out


class BrightSectors:
    """Plans the passes that find where the source is bright, and light the sectors of a grid that meet it. lit: a f32 a sector."""

    def __init__(self, device: Device, grid: Grid, wide: Grid, source: Any, apron: int) -> None:
        width, height, _ = source.size
        count = -(-width // BLOCK) * -(-height // BLOCK)
        self.lit = device.buffer(size=4 * sum((q.lines - 1) // SECTOR for q in grid.quadrants))
        blocks = device.buffer(size=8 * (count + 1))
        groups = -(-count // LANES)
        self.dispatches = [(device.pipeline(BRIGHT, entry), n) for entry, n in (("measure", groups), ("clear", 1), ("mark", groups))]
        self.bind = device.bind(BRIGHT, source, device.sampler(), device.buffer(lines(grid, wide, apron).tobytes()), blocks, self.lit)

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the passes."""
        run = encoder.begin_compute_pass(**timing(timer, "epipolar bright", encoder))
        run.set_bind_group(0, self.bind)
        for pipeline, count in self.dispatches:
            run.set_pipeline(pipeline)
            run.dispatch_workgroups(count)
        run.end()
