"""The gather from epipolar lines to pixels: triangles for adapters that run on a CPU, a pixel an invocation for GPUs."""

import itertools
import math
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import divide, timing
from airlight.scatter.epipolar.grid import Grid, Quadrant, joined
from airlight.scatter.epipolar.moments import Array

RASTER, COMPUTE = "scatter/epipolar/gather_raster.wgsl", "scatter/epipolar/gather_compute.wgsl"
NEAR_LIGHT_RADIUS_PX = 20  # gather.wgsl
NOWHERE = (1 << 32) - 1  # gather_raster.wgsl
SUBPIXELS = 16  # positions in a pixel that every rasteriser tells apart
FRAME = struct_dtype(RASTER, "Frame")
CORNER = struct_dtype(RASTER, "Corner")


def major_rows(grid: Grid) -> tuple[Array, list[int]]:
    """Find for each quadrant and pixel on its major axis, (n, 4), the row of the sums, and the factors of line = y n + z at the minor
    coordinate n; and where the quadrants right, left, down, up begin."""
    out, first = [np.zeros((0, 4))], [0, 0, 0, 0]
    for q in grid.quadrants:
        first[2 * q.axis + (q.sign < 0)] = sum(map(len, out))
        major, minor = grid.light[q.axis], grid.light[1 - q.axis]
        u = np.maximum(q.sign * (np.arange(grid.size[q.axis]) + 0.5 - major), 0)
        nodes = q.u[q.stored :]
        node = np.interp(u, nodes, q.stored + np.arange(len(nodes), dtype=float))
        zone = np.searchsorted(q.splits[1:-1], node)
        factor = 0.5 ** (len(q.splits) - 2 - zone)
        across = u * q.dm  # from line to line
        per = np.divide(factor, across, out=np.zeros_like(u), where=across > 1e-12)
        start = q.column0 - (minor + q.m_lo * u) * per
        out.append(np.stack([q.row0 + node - q.stored + zone, per, start, 0 * u], axis=1))
    return np.concatenate(out), first


def _cut(polygon: list[list[float]], axis: int, limit: float, keep: int) -> list[list[float]]:
    """Cut from a convex polygon of points [x, y] the part where keep * (point[axis] - limit) >= 0 (Sutherland and Hodgman)."""
    out = []
    for i, here in enumerate(polygon):  # few and short: quicker without arrays
        there = polygon[(i + 1) % len(polygon)]
        a, b = keep * (here[axis] - limit), keep * (there[axis] - limit)
        if a >= 0:
            out.append(here)
        if (a < 0) != (b < 0):
            along = a / (a - b)
            cut = [p + (q - p) * along for p, q in zip(here, there, strict=True)]
            cut[axis] = limit
            out.append(cut)
    return out


def _spans(q: Quadrant) -> list[tuple[int, int, int]]:
    """List (zone, first node, last node) of the stored nodes, wherever they lie evenly."""
    return [(zone, max(a, q.stored), b) for zone, runs in enumerate(q.runs) for a, b in runs if b > q.stored]


def corners(grid: Grid) -> Array:
    """Make CORNER records, three a triangle, which cover every pixel centre once.

    Corners lie on a grid of 1/16 px, exact for every rasteriser (Vulkan 1.3, subPixelPrecisionBits: at least 4), and the diagonals
    between the quadrants, moved by less than 0.1 px, pass no pixel centre: a centre is covered once although some corners lie on other
    triangles' edges.
    """
    x = round(SUBPIXELS * grid.light[0])
    y = x + 1 + 2 * round((SUBPIXELS * grid.light[1] - x - 1) / 2)  # x - y and x + y are odd, those of pixel centres even
    light = [x / SUBPIXELS, y / SUBPIXELS]
    out = []
    for q in grid.quadrants:
        spans = _spans(q)
        edge = float(grid.size[q.axis] if q.sign > 0 else 0)
        marks = [light[q.axis], *(round(SUBPIXELS * (grid.light[q.axis] + q.sign * q.u[b])) / SUBPIXELS for _, _, b in spans[:-1]), edge]
        points: list[list[float]] = []
        of: list[int] = []  # the span of each point
        for i, (start, stop) in enumerate(itertools.pairwise(marks)):
            low, high = sorted((start, stop))
            far = max(abs(low - light[q.axis]), abs(high - light[q.axis]))
            tip, edges = light[q.axis] + q.sign * far, (light[1 - q.axis] - far, light[1 - q.axis] + far)
            polygon = [list(light), *([tip, v] if q.axis == 0 else [v, tip] for v in edges)]  # to beyond the far mark, then cut down
            minor = 1 - q.axis
            low, high = max(low, 0), min(high, grid.size[q.axis])
            cuts = [(q.axis, low, 1), (q.axis, high, -1), (minor, 0, 1), (minor, grid.size[minor], -1)]
            for axis, limit, keep in cuts:
                polygon = _cut(polygon, axis, limit, keep)
            for k in range(1, len(polygon) - 1):  # a fan
                points += (polygon[0], polygon[k], polygon[k + 1])
                of += (i, i, i)
        if not points:
            continue
        position = np.round(SUBPIXELS * np.array(points)) / SUBPIXELS  # they are there but for the rounding of cuts far from the light
        zone, first, last = np.array(spans)[of].T
        u = q.sign * (position[:, q.axis] - grid.light[q.axis])
        v = position[:, 1 - q.axis] - grid.light[1 - q.axis]
        record = np.zeros(len(position), CORNER)
        record["position"] = position
        factor = 0.5 ** (len(q.splits) - 2 - zone)
        across = u / q.u[-1]
        line = (v - q.m_lo * u) * factor / (q.dm * q.u[-1]) if q.dm * q.u[-1] > 1e-12 else 0 * u
        record["line"] = np.stack([(line + (q.column0 + 0.5) * across) / grid.columns, across], axis=1)
        record["first"] = (q.column0 + 0.5) / grid.columns
        record["last"] = (q.column0 + (q.lines - 1) * factor + 0.5) / grid.columns
        node = first + (last - first) * (u - q.u[first]) / (q.u[last] - q.u[first])
        record["row"] = (q.row0 + node - q.stored + zone + 0.5) / grid.rows
        record["sector"] = NOWHERE
        out.append(record)
    return joined(out, CORNER)


class EpipolarGather:
    """Plans the pass that writes a light's layer from its sums; it allocates nothing when recorded.

    wedges, lit: CORNER records of close lines, drawn over what is there where their sector is lit; else the whole layer is written.
    """

    def __init__(
        self,
        device: Device,
        grid: Grid,
        sums: Any,
        source: Any,
        layer: Any,
        *,
        density: float,
        lam: float,
        apron: int,
        before: Any,
        gain: tuple[float, float, float],
        base: Any,
        wedges: Array | None = None,
        lit: Any = None,
    ) -> None:
        self.raster, self.layer, self.size = device.is_cpu or wedges is not None, layer.create_view(), grid.size
        frame = np.zeros((), FRAME)
        frame["size"], frame["light"] = grid.size, grid.light
        frame["diagonal"] = grid.light[0] - grid.light[1], grid.light[0] + grid.light[1]
        frame["scale"] = 1 / grid.columns, 1 / grid.rows
        taps = min(4096, max(64, math.ceil(3 * density * NEAR_LIGHT_RADIUS_PX), math.ceil(2 * lam)))
        step = 0.5 * lam / taps
        frame["ray"] = density, lam, (math.sinh(step) / step if step > 0 else 1.0) / taps, taps
        frame["gain"][:3] = gain
        frame["base"] = *(base or (0, 0, 0)), apron
        has_near = all(-NEAR_LIGHT_RADIUS_PX < grid.light[a] < grid.size[a] + NEAR_LIGHT_RADIUS_PX for a in (0, 1))
        flags: dict[str, Any] = {"ADD": before is not None, "BASE": base is not None}
        spare = before if before is not None else source
        if self.raster:
            records = corners(grid) if wedges is None else wedges
            self.draws = [(device.raster(RASTER, "corner", "gather", **flags), (len(records), 1))]
            if has_near:
                self.draws.append((device.raster(RASTER, "around", "near", **flags), (6, 1)))
            path, rest = RASTER, [device.buffer(records.tobytes()), device.buffer(size=16) if lit is None else lit]
        else:
            table, frame["first"] = major_rows(grid)
            self.draws = [(device.pipeline(COMPUTE, "gather", **flags), (-(-grid.size[0] // 64), grid.size[1]))]
            if has_near:
                self.draws.append((device.pipeline(COMPUTE, "near", **flags), (2 * NEAR_LIGHT_RADIUS_PX, 1)))
            path, rest = COMPUTE, [device.buffer(table.astype(np.float32).tobytes()), layer]
        uniform = device.buffer(frame.tobytes(), uniform=True)
        self.bind = device.bind(path, uniform, sums, device.sampler(), spare, source, *rest)

    def record(self, encoder: Any, timer: Any = None) -> None:
        if self.raster:
            target = {"view": self.layer, "load_op": "load", "store_op": "store"}
            run = encoder.begin_render_pass(color_attachments=[target], **timing(timer, "epipolar gather", encoder))
        else:
            run = encoder.begin_compute_pass(**timing(timer, "epipolar gather", encoder))
        run.set_bind_group(0, self.bind)
        for pipeline, count in self.draws:
            run.set_pipeline(pipeline)
            (run.draw if self.raster else run.dispatch_workgroups)(*count)
        run.end()
        divide(encoder)
