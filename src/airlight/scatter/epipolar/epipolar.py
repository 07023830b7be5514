"""The converged sum by a recurrence along epipolar lines: planning, and recording of its passes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.scatter.epipolar.grid import QUALITY, Fineness, Grid, Quadrant, tail_schedule
from airlight.scatter.epipolar.moments import Array, Mixture, mixture, step_weights

SCANS = {"four": ("scatter/epipolar/scan_four.wgsl", 32), "one": ("scatter/epipolar/scan_one.wgsl", 32)}  # lines a workgroup
GATHER = "scatter/epipolar/gather.wgsl"
LANES, NEAR, NEAR_TAPS = 64, 12, 64  # gather.wgsl
TILE = np.dtype([("corner", "u4", 2), ("way", "u4"), ("positive", "u4")])
BUNDLE = np.dtype(
    [(n, "u4") for n in ("line", "lines", "stride", "step", "steps", "tail", "row", "state_in", "lines_in", "state_out", "keep", "pad")]
    + [(n, "f4", 4) for n in ("start", "seed", "tail_seed", "c", "tail_c", "gain")]
)
FRAME = np.dtype(
    [("size", "u4", 2), ("light", "f4", 2), ("diagonal", "f4", 2), ("scale", "f4", 2), ("base", "f4", 4)]
    + [("ray", "f4", 4), ("gain", "f4", 4)]
)


@dataclass
class Tables:
    """What the shaders read, as arrays."""

    table: np.ndarray  # (rows, 8, 4) f32
    zones: list[np.ndarray]  # BUNDLE records, a dispatch each
    frame: np.ndarray  # FRAME
    states: int  # floats


def _places(grid: Grid, q: Quadrant, s: Array, sign: int, apron: int) -> Array:
    """(n, 4): where samples at distance s lie in the source, line 0 and from line to line, in texture coordinates."""
    size = np.array([grid.size[0] + 2 * apron, grid.size[1] + 2 * apron] * 2)
    return (grid.uv(q, s, sign) + np.array([apron, apron, 0, 0])) / size


def _rows(grid: Grid, q: Quadrant, apron: int) -> Array:
    """(n, 8, 4) rows of the step table, see `entry` in scan.wgsl, but for the tail's share."""
    mix, u = grid.mix, q.steps.u
    out = np.zeros((len(u) - 1, 8, 4))
    width = np.diff(u)
    out[:, 0] = _places(grid, q, u[:-1] + 0.25 * width, q.sign, apron)
    out[:, 1] = _places(grid, q, u[:-1] + 0.75 * width, q.sign, apron)
    out[:, 2 : 2 + len(mix.p), :3] = np.stack([w.T for w in step_weights(mix.p, u)], axis=-1)
    return out


def _tail_rows(grid: Grid, q: Quadrant, apron: int) -> Array:
    """(n, 8, 4) rows of the tail's steps."""
    assert q.tail is not None
    mix, u = grid.mix, q.tail.u
    out = np.zeros((len(u) - 1, 8, 4))
    out[:, 0] = _places(grid, q, 0.5 * (u[:-1] + u[1:]), -q.sign if mix.opposite else q.sign, apron)
    g, k1, k2 = step_weights(mix.tail_p, u)
    out[:, 2 : 2 + len(mix.tail_p), :2] = np.stack([g.T, (k1 + k2).T], axis=-1)
    return out


def _needed(grid: Grid, q: Quadrant, first: int, end: int, stride: int, lines: int) -> int:
    """Steps of a zone that some of its lines [first, end) need: until the last of them is well out of the image."""
    minor = grid.light[1 - q.axis]
    other = grid.size[1 - q.axis]
    slack = 2 + 4 * grid.fine.spacing
    reach = 0.0
    for index in (first, min(end, lines) - 1):
        m = q.m_lo + q.dm * stride * index
        if m > 0:
            reach = max(reach, (other + slack - minor) / m)
        elif m < 0:
            reach = max(reach, (-slack - minor) / m)
        else:
            reach = np.inf
        if first * stride * q.dm + q.m_lo <= 0 <= q.m_lo + q.dm * stride * (min(end, lines) - 1):
            reach = np.inf
    return int(np.searchsorted(q.steps.u, reach)) + 1


def tables(grid: Grid, apron: int, per_workgroup: int, gain: tuple[float, float, float]) -> Tables:
    """The step table, the bundles of each zone, and the frame, of a grid."""
    mix, fine = grid.mix, grid.fine
    has_tail = mix.tail_ratio > 0
    blocks: list[Array] = []
    zones: list[list[Any]] = [[] for _ in range(fine.zones)]
    frame = np.zeros((), FRAME)
    rows = states = 0
    components = 3 * (len(mix.p) + (len(mix.tail_p) + 2 if has_tail else 0))
    for q in grid.quadrants:
        lead = _rows(grid, q, apron)
        advanced, place = np.zeros(len(q.steps.u)), np.zeros(len(q.steps.u))
        if has_tail:
            count, place = tail_schedule(q, mix.tail_ratio)
            count[1] += count[0]  # what lies before the first node is caught up with at the first step
            lead[:, 2, 3] = count[1:] + np.minimum(place[1:], 1 - 1e-4)
            advanced = np.cumsum(count) - count[0] * (np.arange(len(count)) > 0)
            advanced[0] = 0
        first_row, rows = rows, rows + len(lead)
        blocks.append(lead)
        tail_row = rows
        if has_tail:
            blocks.append(_tail_rows(grid, q, apron))
            rows += len(blocks[-1])
        inherited = (0, 0)
        for zone in range(fine.zones):
            stride = 2 ** (fine.zones - 1 - zone)
            lines = (q.lines - 1) // stride + 1
            begin, end = q.splits[zone], q.splits[zone + 1]
            record = np.zeros((), BUNDLE)
            record["lines"], record["stride"] = lines, stride
            record["gain"][:3] = gain
            record["step"] = first_row + begin
            record["tail"] = tail_row + int(advanced[begin])
            record["row"] = (q.row0 + begin - q.stored + zone) % (1 << 32)
            record["c"][: len(mix.c)] = mix.c
            if has_tail:
                record["tail_c"][: min(4, len(mix.tail_c))] = mix.tail_c[:4]
                record["c"][3] = mix.tail_c[4] if len(mix.tail_c) > 4 else 0
            record["seed"][3] = place[begin]
            record["state_in"], record["lines_in"] = inherited
            if zone + 1 < fine.zones:
                inherited = (states, lines)
                record["state_out"], record["keep"] = states, 1
                states += components * lines
            if zone == 0:
                record["start"] = _places(grid, q, q.steps.u[:1], q.sign, apron)[0]
                if q.steps.lit_start:
                    record["seed"][: len(mix.p)] = 1 / (mix.p + 1)
                if has_tail and q.tail is not None and q.tail.lit_start:
                    seeds = 1 / (mix.tail_p + 1)
                    record["tail_seed"][: min(4, len(seeds))] = seeds[:4]
                    record["gain"][3] = seeds[4] if len(seeds) > 4 else 0
            for line in range(0, lines, per_workgroup):
                needed = min(end, _needed(grid, q, line, line + per_workgroup, stride, lines)) - begin
                if needed <= 0 and zone > 0:
                    continue
                record["line"], record["steps"] = line, max(needed, 0)
                zones[zone].append(record.copy())
    return Tables(np.concatenate(blocks).astype(np.float32), [np.array(z, BUNDLE) for z in zones], frame, max(states, 4))


def ways(grid: Grid, tile: int) -> list[Array]:
    """For each quadrant, (n, 4): for each pixel on its major axis (a whole number of tiles) the row of the sums, and the two factors
    of line = y n + z at the minor coordinate n."""
    out = []
    for q in grid.quadrants:
        major, minor = grid.light[q.axis], grid.light[1 - q.axis]
        t = np.arange(-(-grid.size[q.axis] // tile) * tile) + 0.5
        u = np.maximum(q.sign * (t - major), 0)
        nodes = q.steps.u[q.stored :]
        node = np.interp(u, nodes, q.stored + np.arange(len(nodes), dtype=float))
        zone = np.searchsorted(q.splits[1:-1], node)
        factor = 0.5 ** (len(q.splits) - 2 - zone)
        across = u * q.dm  # from line to line
        per = np.divide(factor, across, out=np.zeros_like(u), where=across > 1e-12)
        out.append(np.stack([q.row0 + node - q.stored + zone, per, -(minor + q.m_lo * u) * per, 0 * u], axis=1))
    return out


def tiles(grid: Grid, first: list[int], strip: int) -> dict[tuple[bool, bool], np.ndarray]:
    """TILE records by (major axis is y, tile is shared by quadrants). first: where each quadrant's ways start."""
    side = LANES, strip
    out: dict[tuple[bool, bool], list[np.ndarray]] = {}
    for q, start in zip(grid.quadrants, first, strict=True):
        corner = np.stack(np.meshgrid(*(np.arange(0, grid.size[a], side[a]) for a in (0, 1))), axis=-1).reshape(-1, 2)
        low = corner + 0.5 - np.array(grid.light)  # first and last pixel centre from the light
        high = np.minimum(corner + side, grid.size) - 0.5 - np.array(grid.light)
        nearest = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
        farthest = np.maximum(np.abs(low), np.abs(high))
        slack = 1e-3 + 1e-6 * farthest.max()  # of f32 in the shader
        u_min, u_max = (low, high) if q.sign > 0 else (-high, -low)
        seen = u_max[:, q.axis] + slack >= nearest[:, 1 - q.axis]
        whole = u_min[:, q.axis] - slack >= farthest[:, 1 - q.axis]
        for shared, chosen in ((False, whole), (True, seen & ~whole)):
            some = corner[chosen]
            record = np.zeros(len(some), TILE)
            record["corner"], record["way"], record["positive"] = some, start + some[:, q.axis], q.sign > 0
            out.setdefault((q.axis == 1, shared), []).append(record)
    return {key: np.concatenate(records) for key, records in out.items() if sum(map(len, records))}


class EpipolarPlan:
    """The passes of one light over a source of fixed size. `record` allocates nothing."""

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        light: tuple[float, float],
        *,
        density: float,
        lam: float,
        border: str,
        quality: str | Fineness,
        source: Any,
        layer: Any,
        apron: int = 0,
        before: Any = None,
        gain: tuple[float, float, float] = (1, 1, 1),
        base: Any = None,
    ) -> None:
        fine = QUALITY[quality] if isinstance(quality, str) else quality
        self.device, self.size = device, size
        self.mix: Mixture = mixture(density, lam, fine.tolerance)
        self.grid = Grid(size, light, self.mix, lam, density, fine, border, device.max_side)
        shader, lines = SCANS["four" if device.is_cpu else "one"]
        data = tables(self.grid, apron, lines, gain)
        frame = data.frame
        frame["size"], frame["light"] = size, light
        frame["diagonal"] = light[0] - light[1], light[0] + light[1]
        frame["scale"] = 1 / self.grid.columns, 1 / self.grid.rows
        step = 0.5 * lam / NEAR_TAPS
        frame["ray"][:3] = density, lam, (np.sinh(step) / step if step > 0 else 1.0) / NEAR_TAPS
        frame["gain"][:3] = gain
        frame["base"] = *(base or (0, 0, 0)), apron
        self.sums = device.texture(self.grid.columns, self.grid.rows, "rgba16float")
        rows = -(-len(data.table) // 32)  # 32 rows of 8 texels side by side: long marches would pass a texture's height
        table = device.texture(32 * 8, rows, "rgba32float", target=False)
        padded = np.zeros((rows * 32, 8, 4), np.float32)
        padded[: len(data.table)] = data.table
        device.write(table, padded, 32 * 8 * 16)
        self.state = device.buffer(size=4 * data.states)
        constants = {"POWERS": len(self.mix.p), "TAIL": len(self.mix.tail_p)}
        self.scans = []
        for zone, bundles in enumerate(data.zones):
            if len(bundles) == 0:
                continue
            pipeline = device.pipeline(shader, "scan", FIRST_ZONE=zone == 0, **constants)
            bind = device.bind(shader, source, device.sampler(), table, device.buffer(bundles.tobytes()), self.sums, self.state)
            self.scans.append((pipeline, bind, len(bundles)))
        strip = 8 if device.is_cpu else 4
        way = ways(self.grid, LANES)
        way_buffer = device.buffer(np.concatenate(way).astype(np.float32).tobytes())
        first = np.cumsum([0, *(len(w) for w in way[:-1])]).tolist()
        spare = before if before is not None else source
        uniform = device.buffer(frame.tobytes(), uniform=True)
        flags = {"ADD": before is not None, "BASE": base is not None}
        self.gathers = []
        for (down, shared), some in tiles(self.grid, first, strip).items():
            pipeline = device.pipeline(GATHER, "gather", STRIP=strip, DOWN=down, SHARED=shared, **flags)
            records = device.buffer(some.tobytes())
            bind = device.bind(GATHER, uniform, self.sums, device.sampler(), layer, records, spare, source, way_buffer)
            self.gathers.append((pipeline, bind, len(some)))
        if all(-NEAR < light[a] < size[a] + NEAR for a in (0, 1)):
            self.gathers.append((device.pipeline(GATHER, "near", **flags), bind, 2 * NEAR))

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the scan and the way back."""
        scan = encoder.begin_compute_pass(**({"timestamp_writes": timer.writes("epipolar scan")} if timer else {}))
        for pipeline, bind, count in self.scans:
            scan.set_pipeline(pipeline)
            scan.set_bind_group(0, bind)
            scan.dispatch_workgroups(count)
        scan.end()
        back = encoder.begin_compute_pass(**({"timestamp_writes": timer.writes("epipolar gather")} if timer else {}))
        for pipeline, bind, count in self.gathers:
            back.set_pipeline(pipeline)
            back.set_bind_group(0, bind)
            back.dispatch_workgroups(count)
        back.end()
