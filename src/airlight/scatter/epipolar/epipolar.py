"""The converged sum by a recurrence along epipolar lines: planning, and recording of its passes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import current
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import divide, timing
from airlight.lights import ImageLight
from airlight.options.shafts import Parameters
from airlight.scatter.epipolar.detail import DetailedSectors, wedges
from airlight.scatter.epipolar.gather import NOWHERE, EpipolarGather
from airlight.scatter.epipolar.grid import QUALITY, SECTOR, Fineness, Grid, Quadrant, joined
from airlight.scatter.epipolar.moments import Array, Mixture, end_weights, mixture, step_weights
from airlight.scatter.radial.radial import RadialPlan
from airlight.scatter.screen import Target, gains

SCANS = {"four": ("scatter/epipolar/scan_four.wgsl", 32), "one": ("scatter/epipolar/scan_one.wgsl", 32)}  # lines a workgroup
FAINT_RATIO = 0.25  # of the far end's distance over the pixel's, up to which one sample there stands for several steps
AT_ONCE = 32  # workgroups of a scan that are carried out at once, in work that is done in slices
TABLE_ROW_TEXELS = 256  # texels of a row of the table's texture, see `table_texel` in scan.wgsl
BUNDLE = struct_dtype(SCANS["one"][0], "Bundle")


@dataclass
class Tables:
    """Holds what the scan reads, as arrays."""

    table: np.ndarray  # (texels, 4) f32
    zones: list[np.ndarray]  # BUNDLE records, a dispatch each
    states: int  # floats


def _positions(grid: Grid, q: Quadrant, s: Array, sign: int, apron: int) -> Array:
    """Place samples at distances s in the source, (n, 4): on line 0 and from line to line, in texture coordinates."""
    size = np.array([grid.size[0] + 2 * apron, grid.size[1] + 2 * apron] * 2)
    return (grid.uv(q, s, sign) + np.array([apron, apron, 0, 0])) / size


def _steps(mix: Mixture, u: Array, start: float) -> Array:
    """Compute the factors of each step and power, (steps, powers, 4), see scan.wgsl. start: from where light counts."""
    own, far = len(mix.p), len(mix.beyond_p)
    out = np.zeros((len(u) - 1, own + far, 4))
    out[:, :own, :3] = np.stack(step_weights(mix.p, u), axis=-1).swapaxes(0, 1)
    if mix.before.any():
        out[:, :own, 3] = -(mix.before[:, None] * end_weights(mix.p, mix.ratio * u, start)).T
    if far:
        out[:, own:, 0] = step_weights(mix.beyond_p, u)[0].T
        out[:, own:, 3] = end_weights(mix.beyond_p, mix.ratio * u, 0.0).T
    return out


def _first_step(mix: Mixture, lit: bool) -> Array:
    """Compute the factors, (1, powers, 4), that give the first node its moments: all light nearer is as at the node, or none."""
    out = np.zeros((1, len(mix.p) + len(mix.beyond_p), 4))
    if lit:
        # both ends of the ray are as the node: their difference, taken here, is too small for f32 where the light is far
        out[0, : len(mix.p), 2] = (1 - mix.before) / (mix.p + 1)
        out[0, len(mix.p) :, 3] = 1 / (mix.beyond_p + 1)
    return out


def _marched(grid: Grid, q: Quadrant, apron: int, ends: list[tuple[float, float]], steps: list[Array]) -> list[Array]:
    """Lay out each run of steps of equal length, from the one to the other of its ends, (texels, 4): its head, then the factors."""
    mix, (a, b) = grid.mix, np.array(ends).T
    width = (b - a) / [len(own) for own in steps]
    positions = _positions(grid, q, np.concatenate([a + 0.25 * width, a + 1.25 * width]), q.sign, apron)
    far = _positions(grid, q, mix.ratio * (a + 0.5 * width), -q.sign if mix.opposite else q.sign, apron)
    heads = np.zeros((len(steps), 4, 4))
    heads[:, 0], heads[:, 2] = positions[: len(a)], far
    heads[:, 1] = positions[len(a) :] - positions[: len(a)]
    apart = np.maximum(mix.ratio * width, 1e-9)  # of the far ends of two steps, px
    # near the light, and where it counts much, the far end must be as fine as the rest
    most = 0.0 if mix.ratio > FAINT_RATIO or mix.opposite else 2.0 if not grid.inside else 0.5 if grid.at_edge else 0.0
    heads[:, 3, 2] = np.clip(most // apart, 1, [len(own) for own in steps])
    heads[:, 3, :2] = [(len(own), own[..., 3].any()) for own in steps]
    return [block for head, own in zip(heads, steps, strict=True) for block in (head, own.reshape(-1, 4))]


def _needed(grid: Grid, q: Quadrant, first: Array, end: Array, stride: int, lines: int) -> np.ndarray:
    """Count the steps of a zone that some of its lines [first, end) need: until the last is well out of the image. (n,) each."""
    minor = grid.light[1 - q.axis]
    other = grid.size[1 - q.axis]
    slack = 2 + 4 * grid.fine.spacing
    low, high = (q.m_lo + q.dm * stride * index for index in (first, np.minimum(end, lines) - 1))
    far = np.zeros(len(first))
    for m in (low, high):
        side = np.where(m > 0, other + slack - minor, -slack - minor)
        far = np.maximum(far, np.divide(side, m, out=np.full(len(m), np.inf), where=m != 0))
    far[(low <= 0) & (high >= 0)] = np.inf
    return np.asarray(np.searchsorted(q.u, far) + 1)


def tables(grid: Grid, apron: int, per_workgroup: int, gain: tuple[float, float, float]) -> Tables:
    """Make the table of steps, and the bundles of each zone, of a grid."""
    mix, fine = grid.mix, grid.fine
    blocks: list[Array] = []
    zones: list[list[Any]] = [[] for _ in range(fine.zones)]
    texels = states = 0
    components = 3 * (len(mix.p) + len(mix.beyond_p))
    same = np.zeros((1, len(mix.p) + len(mix.beyond_p), 4))
    same[..., 0] = 1  # a step of no length, which stores the node that two zones share
    for q in grid.quadrants:
        steps = _steps(mix, q.u, 0.0 if q.lit else q.u[0])
        inherited = (0, 0)
        for zone in range(fine.zones):
            stride = 2 ** (fine.zones - 1 - zone)
            lines = (q.lines - 1) // stride + 1
            begin, end = q.splits[zone], q.splits[zone + 1]
            record = np.zeros((), BUNDLE)
            record["lines"], record["stride"] = lines, stride
            record["run"], record["column"] = texels, q.column0
            record["row"], record["skip"] = (q.row0 + begin - q.stored + zone) % (1 << 32), max(q.stored - begin, 0)
            record["aside"] = stride * grid.aside(q)
            record["end"] = -mix.ratio if mix.opposite else mix.ratio
            record["c"][: len(mix.c)] = mix.c
            record["beyond_c"][: min(4, len(mix.beyond_c))] = mix.beyond_c[:4]
            record["gain"] = *gain, mix.beyond_c[4] if len(mix.beyond_c) > 4 else 0
            record["state_in"], record["lines_in"] = inherited
            record["state_out"] = NOWHERE
            if zone + 1 < fine.zones:
                inherited = (states, lines)
                record["state_out"] = states
                states += components * lines
            spans = q.runs[zone]
            ends = [(q.u[begin], q.u[begin]), *((q.u[a], q.u[b]) for a, b in spans)]
            marched = _marched(grid, q, apron, ends, [same if zone else _first_step(mix, q.lit), *(steps[a:b] for a, b in spans)])
            blocks += marched
            texels += sum(map(len, marched))
            line = np.arange(0, lines, per_workgroup) if grid.part != "close" else np.arange(0, lines - 1, SECTOR)
            needed = np.minimum(end, _needed(grid, q, line, line + per_workgroup, stride, lines)) - begin
            bundles = np.full(len(line), record)
            bundles["line"], bundles["steps"] = line, np.maximum(needed, 0) + 1
            bundles["sector"] = NOWHERE
            if grid.part == "close":
                bundles["sector"] = q.sector0 + np.arange(len(line))
                bundles["column"] += np.arange(len(line), dtype=np.uint32)
            zones[zone].append(bundles[needed > 0] if zone else bundles)
    return Tables(np.concatenate(blocks).astype(np.float32), [joined(z, BUNDLE) for z in zones], max(states, 4))


class GridPlan:
    """Plans the passes of one light along the lines of one grid. `record` allocates nothing.

    lit: of close lines a f32 a sector, above 0 where they are needed; None: all are.
    """

    def __init__(self, device: Device, grid: Grid, target: Target, gain: tuple[float, float, float], lit: Any, **rest: Any) -> None:
        self.grid, mix = grid, grid.mix
        shader, lines = SCANS["four" if device.is_cpu else "one"]
        data = tables(grid, target.apron, lines, gain)
        self.sums = device.texture(grid.columns, grid.rows, "rgba16float", roomy=True)
        grid.columns, grid.rows, _ = self.sums.size
        table = device.texture(TABLE_ROW_TEXELS, -(-len(data.table) // TABLE_ROW_TEXELS), "rgba32float", target=False, roomy=True)
        padded = np.zeros((TABLE_ROW_TEXELS * table.size[1], 4), np.float32)
        padded[: len(data.table)] = data.table
        device.write(table, padded, TABLE_ROW_TEXELS * 16)
        state = device.buffer(size=4 * data.states) if lit is None else lit
        constants = {"POWERS": len(mix.p), "BEYOND": len(mix.beyond_p), "FAR_END": mix.ratio > 0}
        self.pipeline = device.pipeline(shader, "scan", **constants)
        self.scans = []
        most = AT_ONCE if current() else max(map(len, data.zones))
        for bundles in (zone[i : i + most] for zone in data.zones for i in range(0, len(zone), most)):
            bind = device.bind(shader, target.source, device.sampler(), table, device.buffer(bundles.tobytes()), self.sums, state)
            self.scans.append((bind, len(bundles)))
        rest |= {"density": grid.density, "apron": target.apron, "before": target.before, "gain": gain}
        if lit is not None:
            rest |= {"wedges": wedges(grid), "lit": lit}
        self.back = EpipolarGather(device, grid, self.sums, target.source, target.layer, **rest)

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the scan and the gather."""
        for scans in [[one] for one in self.scans] if current() else [self.scans]:
            scan = encoder.begin_compute_pass(**timing(timer, "epipolar scan", encoder))
            scan.set_pipeline(self.pipeline)
            for bind, count in scans:
                scan.set_bind_group(0, bind)
                scan.dispatch_workgroups(count)
            scan.end()
            divide(encoder)
        self.back.record(encoder, timer)


class EpipolarPlan:
    """Plans the passes of one light over a source of fixed size: along one grid, or along wide lines and, over these, close ones where
    the sums of wide ones bend. `record` allocates nothing."""

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        light: tuple[float, float],
        target: Target,
        *,
        density: float,
        lam: float,
        border: str,
        quality: str | Fineness,
        gain: tuple[float, float, float] = (1, 1, 1),
        base: Any = None,
    ) -> None:
        fine = QUALITY[quality] if isinstance(quality, str) else quality
        self.mix: Mixture = mixture(density, lam, fine.tolerance)
        laid = size, light, self.mix, lam, density, fine, border, device.max_side
        self.grid = Grid(*laid)
        if self.grid.halves:
            self.grid, close = Grid(*laid, "wide"), Grid(*laid, "close")
        first = GridPlan(device, self.grid, target, gain, None, lam=lam, base=base)
        self.passes: list[Any] = [first]
        if self.grid.part == "wide":
            found = DetailedSectors(device, close, self.grid, first.sums)
            self.passes += [found, GridPlan(device, close, target, gain, found.lit, lam=lam, base=base)]

    def record(self, encoder: Any, timer: Any = None) -> None:
        """Record the passes."""
        for one in self.passes:
            one.record(encoder, timer)


def direct_taps(size: tuple[int, int], at: tuple[float, float], density: float) -> int:
    """Count the midpoint taps, four a pixel, by which the direct sum gives the converged one; 0 where lines do better."""
    width, height = size
    x, y = at
    longest = math.hypot(max(abs(x), abs(1 - x)) * width, max(abs(y), abs(1 - y)) * height)
    taps = max(64, math.ceil(4 * density * longest))
    most = 12_000_000 if min(size) > 16 else 120_000_000  # across a thin picture lines meet too few pixels to be exact
    return taps if taps <= 64 or (taps <= 8192 and taps * width * height <= most) else 0


def plan(device: Device, size: tuple[int, int], light: ImageLight, p: Parameters, target: Target) -> "EpipolarPlan | RadialPlan":
    """Plan the converged sum of one light: along lines, or for a short or cheap ray by midpoint taps."""
    (x, y), density = light.placed(*size, p.density)
    gain, base = gains(p, light)
    taps = direct_taps(size, (x, y), density)
    if not taps:
        at = (x * size[0], y * size[1])
        return EpipolarPlan(device, size, at, target, density=density, lam=p.lam, border=p.border, quality=p.quality, gain=gain, base=base)
    step = 0.5 * p.lam / taps
    share = (math.sinh(step) / step if 0 < step < 300 else 1.0) / taps  # the taps' weights are exact where I is constant
    return RadialPlan(
        device,
        size,
        (x, y),
        target,
        samples=taps,
        density=density,
        decay=math.exp(-p.lam / taps),
        jitter="midpoint",
        gain=(gain[0] * share, gain[1] * share, gain[2] * share),
        base=base or (0, 0, 0),
    )
