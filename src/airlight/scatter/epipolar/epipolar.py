"""The converged sum by a recurrence along epipolar lines: planning, and recording of its passes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.scatter.epipolar.grid import QUALITY, Fineness, Grid, Quadrant, tail_schedule
from airlight.scatter.epipolar.moments import Array, Mixture, mixture, step_weights

SCANS = {"four": ("scatter/epipolar/scan_four.wgsl", 32), "one": ("scatter/epipolar/scan_one.wgsl", 32)}  # lines a workgroup
GATHER = "scatter/epipolar/gather.wgsl"
TILE_WIDTH, NEAR, NEAR_TAPS = 32, 12, 64  # gather.wgsl
TILE = np.dtype([("corner", "u4", 2), ("", "u4", 2), ("minor", "f4", 4), ("node", "f4", 4), ("rate", "f4", 4), ("last", "f4", 4)])
BUNDLE = np.dtype(
    [(n, "u4") for n in ("line", "lines", "stride", "step", "steps", "tail", "row", "first", "state_in", "lines_in", "state_out", "keep")]
    + [(n, "f4", 4) for n in ("start", "seed", "tail_seed", "more", "gain")]
)
QUADRANT = np.dtype([(n, "f4", 4) for n in ("minor", "node", "rate", "last")])
FRAME = np.dtype(
    [("size", "u4", 2), ("light", "f4", 2), ("diagonal", "f4", 2), ("scale", "f4", 2), ("base", "f4", 4)]
    + [("ray", "f4", 4), ("gain", "f4", 4), ("quadrants", QUADRANT, 4)]
)


@dataclass
class Tables:
    """What the shaders read, as arrays."""

    table: np.ndarray  # (rows, 8, 4) f32
    zones: list[np.ndarray]  # BUNDLE records, a dispatch each
    frame: np.ndarray  # FRAME
    states: int  # floats


def _rows(grid: Grid, q: Quadrant, tail: bool, apron: int) -> Array:
    """(n, 8, 4) rows of the step table: two places, extras, then g, k1, k2, c of each power."""
    mix = grid.mix
    steps = q.tail if tail else q.steps
    assert steps is not None
    sign = -q.sign if tail and mix.opposite else q.sign
    out = np.zeros((len(steps.middle), 8, 4))
    scale = 1.0 / np.array([grid.size[0] + 2 * apron, grid.size[1] + 2 * apron] * 2)
    shift = np.array([apron, apron, 0, 0])
    out[:, 0] = (grid.uv(q, steps.s1, sign) + shift) * scale
    out[:, 1] = (grid.uv(q, steps.s2, sign) + shift) * scale
    p, c = (mix.tail_p, mix.tail_c) if tail else (mix.p, mix.c)
    g, k1, k2 = step_weights(p, steps.u[:-1], steps.middle, steps.u[1:])
    out[:, 3 : 3 + len(p)] = np.stack([g.T, k1.T, k2.T, np.broadcast_to(c, g.T.shape)], axis=-1)
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
        lead = _rows(grid, q, False, apron)
        node_row = np.arange(1, len(q.steps.u), dtype=float) - q.stored + q.row0
        for zone in range(1, fine.zones):  # a zone begins with a copy of the node where the last one ended
            node_row[q.splits[zone] :] += 1
        lead[:, 2, 2] = np.where(np.arange(1, len(q.steps.u)) < q.stored, grid.rows - 1, node_row)
        advanced = np.zeros(len(q.steps.u))
        if has_tail:
            count, place = tail_schedule(q, mix.tail_ratio)
            lead[:, 2, 0], lead[:, 2, 1] = count[1:], place[1:]
            lead[0, 2, 0] += count[0]
            advanced = np.cumsum(count)
            advanced[0] = 0
        blocks.append(lead)
        first_row, rows = rows, rows + len(lead)
        tail_row = rows
        if has_tail:
            tail = _rows(grid, q, True, apron)
            blocks.append(tail)
            rows += len(tail)
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
            record["row"] = q.row0 + (begin - q.stored if zone else 0) + zone
            record["first"] = q.stored
            record["more"][3] = place[begin] if has_tail else 0
            record["state_in"], record["lines_in"] = inherited
            if zone + 1 < fine.zones:
                inherited = (states, lines)
                record["state_out"], record["keep"] = states, 1
                states += components * lines
            if zone == 0:
                place0 = grid.uv(q, q.steps.u[:1], q.sign)[0] + np.array([apron, apron, 0, 0])
                record["start"] = place0 / np.array([grid.size[0] + 2 * apron, grid.size[1] + 2 * apron] * 2)
                lit, tail_lit = q.steps.lit_start, has_tail and q.tail is not None and q.tail.lit_start
                seeds = 1 / (mix.p + 1) * lit
                tail_seeds = 1 / (mix.tail_p + 1) * tail_lit
                record["seed"][: len(seeds)] = seeds
                record["tail_seed"][: min(4, len(tail_seeds))] = tail_seeds[:4]
                record["more"][:3] = tail_seeds[4] if len(tail_seeds) > 4 else 0, seeds @ mix.c, tail_seeds @ mix.tail_c
            for line in range(0, lines, per_workgroup):
                needed = min(end, _needed(grid, q, line, line + per_workgroup, stride, lines)) - begin
                if needed <= 0 and zone > 0:
                    continue
                record["line"], record["steps"] = line, max(needed, 0)
                zones[zone].append(record.copy())
        frame["quadrants"][{(0, 1): 0, (0, -1): 1, (1, 1): 2, (1, -1): 3}[q.axis, q.sign]] = _lookup(grid, q)
    return Tables(np.concatenate(blocks).astype(np.float32), [np.array(z, BUNDLE) for z in zones], frame, max(states, 4))


def _lookup(grid: Grid, q: Quadrant) -> np.ndarray:
    """How a pixel finds line and node: affine in its major coordinate t."""
    record = np.zeros((), QUADRANT)
    major, minor = grid.light[q.axis], grid.light[1 - q.axis]
    # v = minor + m_lo u, dv = dm u, with u = sign (t - major)
    record["minor"] = minor - q.m_lo * q.sign * major, q.m_lo * q.sign, -q.dm * q.sign * major, q.dm * q.sign
    k0, rate = q.rates[:, 0], q.rates[:, 1]
    split = q.steps.u[q.splits[1]] if len(q.splits) > 2 else np.inf
    record["node"] = *(k0 - rate * q.sign * major), np.clip(major + q.sign * split, -3e38, 3e38)
    record["rate"] = *(rate * q.sign), q.row0
    first = q.steps.u[q.stored + 1] if q.steps.u[q.stored] == 0 else 0.0
    start = (-q.sign * major / first, q.sign / first) if first else (3e38, 0)
    record["last"][:3] = q.lines - 1, *start
    return record


def tiles(size: tuple[int, int], light: tuple[float, float], frame: np.ndarray, zones: int, strip: int) -> dict[str, np.ndarray]:
    """Tiles of TILE_WIDTH x strip pixels by the entry point of gather.wgsl that serves them."""
    columns, rows = np.meshgrid(np.arange(0, size[0], TILE_WIDTH), np.arange(0, size[1], strip))
    x, y = columns.ravel(), rows.ravel()
    # the first and last pixel centres of each tile, as four corners
    cx = np.stack([x, x, x + TILE_WIDTH - 1, x + TILE_WIDTH - 1], axis=1) + 0.5
    cy = np.stack([y, y + strip - 1] * 2, axis=1) + 0.5
    dx, dy = cx - light[0], cy - light[1]
    along_x = np.abs(dx) >= np.abs(dy)
    quadrant = np.where(along_x, np.where(dx >= 0, 0, 1), np.where(dy >= 0, 2, 3))
    t = np.where(along_x, cx, cy)
    node, rate = frame["quadrants"]["node"][quadrant].astype(float), frame["quadrants"]["rate"][quadrant].astype(float)
    pieces = node[..., :3] + rate[..., :3] * t[..., None]
    last = frame["quadrants"]["last"][quadrant].astype(float)
    started = (last[..., 1] + last[..., 2] * t >= pieces.min(axis=-1)).all(axis=1)  # past the first node
    piece = pieces.argmin(axis=-1)
    far = ((t > node[..., 3]) == (quadrant % 2 == 0)) if zones == 2 else np.ones(t.shape, bool)
    inside = started & (pieces.min(axis=-1) >= 0).all(axis=1)
    one_quadrant = np.ptp(quadrant, axis=1) == 0
    across = one_quadrant & (quadrant[:, 0] < 2) & (np.abs(dx).min(axis=1) > 0)
    down = one_quadrant & ~across & (np.ptp(piece, axis=1) == 0) & (np.ptp(far.astype(int), axis=1) == 0) & inside & (quadrant[:, 0] >= 2)
    out = np.zeros(len(x), TILE)
    out["corner"] = np.stack([x, y], axis=1)
    for name in ("minor", "node", "rate", "last"):
        out[name] = frame["quadrants"][name][quadrant[:, 0]]
    k, f, index = piece[:, 0], far[:, 0], np.arange(len(x))
    out["node"][down, 0] = (node[index, 0, k] + rate[:, 0, 3] + (f if zones == 2 else 0))[down]
    out["rate"][down, 0] = rate[index, 0, k][down]
    out["minor"][down, 2:] *= np.where(f, 1, 2)[down, None]
    return {"across": out[across], "down": out[down], "mixed": out[~across & ~down]}


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
        strip = 16 if device.is_cpu else 1
        spare = before if before is not None else source
        uniform = device.buffer(frame.tobytes(), uniform=True)
        self.gathers = []
        for entry, some in tiles(size, light, frame, fine.zones, strip).items():
            if len(some):
                flags = {"STRIP": strip, "ADD": before is not None, "BASE": base is not None, "ZONES": fine.zones}
                pipeline = device.pipeline(GATHER, entry, **flags)
                bind = device.bind(GATHER, uniform, self.sums, device.sampler(), layer, device.buffer(some.tobytes()), spare, source)
                self.gathers.append((pipeline, bind, len(some)))
        if all(-NEAR < light[a] < size[a] + NEAR for a in (0, 1)):
            pipeline = device.pipeline(GATHER, "near", ADD=before is not None, BASE=base is not None)
            self.gathers.append((pipeline, bind, 2 * NEAR))

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
