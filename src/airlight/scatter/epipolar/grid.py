"""Layout of epipolar lines and their nodes: host side, float64, independent of the pixels' values.

Four quadrants (right, left, down, up) by the major axis of the direction from the light. In each, lines of equal
slope steps; on each line, nodes at the same distances u along the major axis. A node ends a step; a step takes two
samples, and one at the far end of the pixels' rays, |1 - D| times as far from the light. What the shaders need of a position is
affine in the line's index, so that it is exact in f32 even where the light lies a million image widths away.
"""

import dataclasses
import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from airlight.scatter.epipolar.moments import Array, Mixture

LONG_PX = 100  # of the weight's length at the farthest pixel, from which wide lines do where their sums do not bend
SHARP_PX = 4  # of the weight's length at the farthest pixel, below which a layer is as sharp as the picture
SECTOR = 31  # lines between two sectors' first ones, where lines are close: a workgroup's 32, of which two sectors share one
CLOSER = (0.7, 1.2)  # factors of the spacing of close lines, for a light outside and at the edge
WIDEST_PX, CLOSEST_PX = 2.5, 0.7  # most between wide and close lines at the far edge, for a light outside
CLOSE_STEPS = 2  # factor of the steps of close lines
WIDE_RADII = (120, 400)  # of wide lines, for a light outside
CLOSE_PX = 0.75  # between wide lines, with which they are close enough for anything
BESIDE_PX = 40  # of the light: lines are close there, and then pixels take the direct sum
PARALLEL = 1000  # image sizes: beyond this distance lines are parallel to a pixel's width


@dataclass(frozen=True)
class Fineness:
    """Sets how fine the grid is. radii: where steps grow from a quarter of the largest to a half, and to the largest."""

    spacing: float  # of the lines at the far edge, px, for rays to the light without decay
    radii: tuple[float, float]
    slack: tuple[float, float]  # the radii in units of the weight's length D / lambda
    largest: float  # step, px
    beside: float  # the same where much of the image is far from the light
    across: float  # the same where the light lies outside the image
    edge: float  # factor of the spacing where the light lies at the image's edge
    zones: int  # each nearer zone has half the lines
    outer: float  # share of a line's length where the last zone starts; half of it for each nearer one
    tolerance: float  # of the weight's fit
    outside: float  # factor of the spacing where the light lies outside the image
    full: tuple[int, int]  # larger side, px, of the image below which lines lie closer in proportion, and below which steps are halved
    calm: tuple[float, float] = (1, 1)  # factors of the spacing, for a light outside and at the edge, of wide lines


QUALITY = {
    "draft": Fineness(5.0, (16, 128), (2, 20), 4, 2, 2, 0.375, 2, 0.5, 1.5e-2, 1.6, (1024, 0)),
    "normal": Fineness(2.9, (80, 256), (14, 60), 4, 1, 1, 0.232, 3, 0.3, 2e-3, 1.0, (1024, 0), (2.0, 2.8)),
    "final": Fineness(1.5, (24, 256), (3, 40), 2, 1, 1, 0.28, 2, 0.5, 6e-4, 1.2, (1920, 1440)),
}


@dataclass
class Quadrant:
    axis: int  # major axis: 0 x, 1 y
    sign: int
    m_lo: float
    dm: float
    lines: int
    u_min: float
    u_max: float
    u: Array = field(init=False)  # nodes
    lit: bool = field(init=False)  # the sample at u[0] stands for all that is nearer; else nothing nearer counts
    splits: list[int] = field(init=False)  # node index where each zone starts, then the last node
    runs: list[list[tuple[int, int]]] = field(init=False)  # of each zone: steps of equal length, from node to node
    row0: int = 0  # row of the sums' texture of the first stored node
    column0: int = 0  # column of line 0
    sector0: int = 0  # of close lines, the number of the first sector
    stored: int = 0  # index of the first stored node


def _span(low: float, high: float, u0: float, u1: float) -> tuple[float, float]:
    """Bound the slopes v/u for v in [low, high], u in [u0, u1], within [-1, 1]."""
    tiny = 1e-9
    smallest = low / max(u0 if low < 0 else u1, tiny)
    largest = high / max(u0 if high > 0 else u1, tiny)
    return max(-1.0, smallest), min(1.0, largest)


class Grid:
    """Lays the lines and nodes of one light over a picture. size: (width, height); light in pixels (corner origin); border clamp or
    black. part: all lines, or those of the two grids that share the work: wide lines, and close ones in sectors of SECTOR where
    the sums of wide ones bend."""

    def __init__(
        self,
        size: tuple[int, int],
        light: tuple[float, float],
        mix: Mixture,
        lam: float,
        density: float,
        fine: Fineness,
        border: str,
        max_side: int = 16384,
        part: str = "all",
    ) -> None:
        self.part = part
        self.size, self.light, self.mix, self.border, self.density = size, light, mix, border, density
        length = max(lam, 1.5) / density
        # a small image costs little, and has as much detail in fewer pixels
        fine = dataclasses.replace(fine, spacing=fine.spacing * min(1.0, max(0.25, max(size) / fine.full[0])))
        if max(size) < fine.full[1]:
            fine = dataclasses.replace(fine, largest=fine.largest / 2, beside=fine.beside / 2, across=fine.across / 2)
        self.inside = inside = 0 <= light[0] <= size[0] and 0 <= light[1] <= size[1]
        farthest = max(abs(light[a] - end * size[a]) for a in (0, 1) for end in (0, 1))
        length_px = farthest / length
        parallel = farthest > PARALLEL * max(size)
        # a short ray, or one that decays soon, sees finer detail; a small part of the distance to a far light is no short ray
        mean = density * (farthest / (2 * max(size)) if parallel else 1.0) * (-math.expm1(-lam) / lam if lam > 0 else 1.0)
        fine = dataclasses.replace(fine, spacing=fine.spacing * min(mean, 1.0) ** 0.25)
        # what is bright lies far from a light at the edge, where its detail is as fine as near it
        self.at_edge = inside and not all(0.05 < light[a] / size[a] < 0.95 for a in (0, 1))
        if self.at_edge or farthest > 0.75 * max(size):
            fine = dataclasses.replace(fine, largest=min(fine.largest, fine.beside), outer=0.5)
        if not inside:  # and all nodes are far
            wider = fine.spacing * fine.outside
            step = min(1, fine.across) if parallel else fine.across  # samples of longer steps blur what lies along a diagonal
            if length_px < SHARP_PX:  # nodes on pixels' centres do more for it than close lines
                step, wider = min(0.5, step), 2 * wider
            fine = dataclasses.replace(fine, radii=(0, 0), slack=(0, 0), zones=1, largest=step, spacing=wider)
        # the layer is sharp where what lies before it is bright or regular; where rays are short it is so everywhere
        self.halves = max(fine.calm) > 1 and (self.at_edge or not inside) and length_px >= LONG_PX and not mix.opposite
        if part == "wide":
            radii = fine.radii if inside else WIDE_RADII
            fine = dataclasses.replace(fine, spacing=fine.calm[int(inside)] * fine.spacing, largest=4 * fine.largest, radii=radii)
        elif part == "close":
            spacing = fine.spacing * CLOSER[int(inside)]
            step = fine.largest * (1 if parallel else CLOSE_STEPS)
            fine = dataclasses.replace(fine, radii=(0, 0), slack=(0, 0), zones=1, spacing=spacing, largest=step)
        while not self._fits(fine, length, max_side):  # coarser, as an adapter's textures demand
            steps = 2 * fine.largest
            fine = dataclasses.replace(fine, spacing=1.5 * fine.spacing, largest=steps, radii=(0, 0), slack=(0, 0))

    def _fits(self, fine: Fineness, length: float, max_side: int) -> bool:
        """Make the quadrants; tell whether their sums fit into a texture."""
        self.radii = tuple(max(r, s * length) for r, s in zip(fine.radii, fine.slack, strict=True))
        self.fine = fine
        self.quadrants = [q for axis in (0, 1) for sign in (1, -1) if (q := self._quadrant(axis, sign, max_side)) is not None]
        for q in self.quadrants:
            self._march(q)
        return self._lay_out(max_side)

    def _lay_out(self, max_side: int) -> bool:
        """Place each quadrant in the texture of the sums: one below the other or side by side, whichever takes less; False: none."""
        heights = [len(q.u) - q.stored + len(q.splits) - 2 for q in self.quadrants]
        shared = [q.lines // SECTOR - 1 if self.part == "close" else 0 for q in self.quadrants]  # lines that two sectors hold
        widths = [32 * -(-(q.lines + n) // 32) for q, n in zip(self.quadrants, shared, strict=True)]  # the scan runs 32 lines at a time
        below, beside = (max(widths), sum(heights)), (sum(widths), max(heights))
        choices = [size for size in (below, beside) if max(size) <= max_side]
        if not choices:
            return False
        self.columns, self.rows = min(choices, key=lambda size: size[0] * size[1])
        for i, q in enumerate(self.quadrants):
            q.sector0 = sum(other.lines // SECTOR for other in self.quadrants[:i])
            if (self.columns, self.rows) == beside:
                q.column0 = sum(widths[:i])
            else:
                q.row0 = sum(heights[:i])
        return True

    def _quadrant(self, axis: int, sign: int, max_side: int) -> Quadrant | None:
        """Choose the lines that the image's pixel centres see in one direction, None if they see none."""
        extent, other = self.size[axis], self.size[1 - axis]
        near, far = (0.5, extent - 0.5) if sign > 0 else (extent - 0.5, 0.5)
        u_min, u_max = max(0.0, sign * (near - self.light[axis])), sign * (far - self.light[axis])
        if u_max <= 0 and not (u_max == 0 and u_min == 0):
            return None
        u_max = max(u_max, 1e-3)
        low, high = 0.5 - self.light[1 - axis], other - 0.5 - self.light[1 - axis]
        m_lo, m_hi = _span(low, high, u_min, u_max)
        if m_lo - m_hi > 0.1 / u_max:  # but for those hardly beside it: the gather's diagonals are not quite these
            return None
        m_hi = max(m_hi, m_lo)
        # lines that run far show their gaps more: the detail that they cross is finer beside their length
        part = min(1.0, 0.6 * max(self.size) / u_max)
        closer = self.fine.edge if self.at_edge else max(part**3, self.fine.edge) if self.inside else max(part**2, 0.375)
        spacing = self.fine.spacing * closer
        if self.part != "all" and not self.inside:
            spacing = min(spacing, WIDEST_PX if self.part == "wide" else CLOSEST_PX)
        if u_min > PARALLEL * max(self.size):  # lines through pixel centres: along rows or diagonals no light spreads sideways
            spacing = float(math.floor(spacing)) if spacing >= 1 else 1 / math.ceil(1 / spacing)
            spacing += 0.5 if self.part == "wide" else 0.0  # wide ones on centres and borders in turn, or they would miss every other row
            m_hi = m_lo + math.ceil((m_hi - m_lo) * u_max / spacing - 1e-3) * spacing / u_max
        count = min(math.ceil((m_hi - m_lo) * u_max / spacing - 1e-6) + 1, max_side - 1)
        factor = 2 ** (self.fine.zones - 1)
        count = max(factor * math.ceil((count - 1) / factor), factor) + 1
        if self.part == "close":
            whole = SECTOR * min(math.ceil((count - 1) / SECTOR), max_side // (SECTOR + 1)) + 1
            if u_min > PARALLEL * max(self.size):
                m_hi = m_lo + (m_hi - m_lo) * (whole - 1) / (count - 1)  # some beyond the picture, so that they keep to the pixels
            count = whole
        return Quadrant(axis, sign, m_lo, (m_hi - m_lo) / (count - 1), count, u_min, u_max)

    def _nodes(self, q: Quadrant) -> tuple[Array, bool]:
        """Place nodes from the light to the image's end, and tell whether the first sample stands for what is nearer."""
        major, minor = self.light[q.axis], self.light[1 - q.axis]
        extent, other = self.size[q.axis], self.size[1 - q.axis]
        slopes = q.m_lo, q.m_lo + q.dm * (q.lines - 1)
        steepest = max(abs(m) for m in slopes)
        reach = max(abs(0.5 - minor), abs(other - 0.5 - minor)) + 4
        enter = -major if q.sign > 0 else major - extent  # the image lies in enter < u < leave
        leave = extent - major if q.sign > 0 else major
        black, ratio = self.border == "black", self.mix.ratio

        def along(u: float) -> float:
            """Find the step from u, beside the image, in which clamped samples move along the border by 4 px."""
            return 4.0 / max(min(steepest, reach / max(u, 1.0)), 1e-12)

        def beside(u: float, until: float) -> float:
            """Bound a step from u, beside the image."""
            low, high = minor + slopes[0] * u, minor + slopes[1] * u
            if black:
                return until
            if high < 0.5 - 1e-3:  # all lines meet the corner's pixel
                return until if slopes[1] <= 0 else min(until, (0.5 - minor) / slopes[1])
            if low > other - 0.5 + 1e-3:
                return until if slopes[0] >= 0 else min(until, (other - 0.5 - minor) / slopes[0])
            return min(until, u + max(4.0, min(along(u), self.density * u / 16)))

        def inside(u: float) -> float:
            """Find the step from u, in the image, such that the ray's far end, where it is in the image, moves by at most 2 px."""
            step = self.fine.largest * (0.25 if u < self.radii[0] else 0.5 if u < self.radii[1] else 1.0)
            beyond = ratio > 1e-9 and self.mix.opposite and ratio * u >= -enter
            most = (along(ratio * u) if beyond else 2.0) / max(ratio, 1e-9)
            while step > most:
                step /= 2
            return step

        first, last = (enter - 1, leave + 1) if black else (enter, leave)
        u = beside(0.0, first) if first > 0 and (black or not 0.5 <= minor <= other - 0.5) else 0.0
        dark = black and (first > 0 or last < 0)
        if self.density < 1:  # nothing nearer is in any pixel's window
            unseen = (1 - self.density) * max(q.u_min - 1, 0)
            dark, u = dark or unseen > u, max(u, unseen)
        nodes = [u]
        marks = sorted({*self.radii, last, q.u_max})  # where the step may change
        steady = ratio <= 1e-9 or not self.mix.opposite  # and only there
        while u < q.u_max:
            more = 1
            if u < first - 1e-9:
                following = beside(u, first)
            elif u >= last - 1e-9:
                following = beside(u, max(q.u_max, u + 1.0))
            else:
                step = inside(u)
                cell = min(step, 1.0)  # other nodes lie between pixels, so that two samples of a step weigh its columns alike
                # nodes a pixel apart lie on its centre: there nothing is interpolated along the line, and the samples are exact
                position = q.sign * (major + q.sign * u) / cell - (0.5 if step == 1 else 0.0)
                edge = (math.floor(position + 1e-6) + 1 - position) * cell
                aligned = edge >= cell - 1e-6
                following = u + (step if aligned else edge + step - cell)
                if steady and aligned:
                    more = max(1, math.ceil((next((m for m in marks if m > u), u) - u) / step - 1e-9))
            following = following if following > u + 1e-9 * max(1.0, u) else u + 1.0
            nodes += [u + (following - u) * k for k in range(1, more + 1)]
            u = nodes[-1]
        if len(nodes) == 1:
            nodes.append(u + 1.0)
        return np.array(nodes), not dark

    def _march(self, q: Quadrant) -> None:
        q.u, q.lit = self._nodes(q)
        q.stored = min(max(0, int(np.searchsorted(q.u, q.u_min, side="right")) - 1), len(q.u) - 2)
        splits = [0]
        for zone in range(1, self.fine.zones):
            k = int(np.searchsorted(q.u, self.fine.outer * q.u_max / 2 ** (self.fine.zones - 1 - zone)))
            splits.append(min(max(k, splits[-1], q.stored), len(q.u) - 1))
        q.splits = [*splits, len(q.u) - 1]
        width = np.diff(q.u)
        breaks = np.flatnonzero(np.abs(np.diff(width)) > 1e-6 * width[1:] + 1e-15 * q.u[-1]) + 1
        q.runs = []
        for begin, end in itertools.pairwise(q.splits):
            cuts = [begin, *breaks[(breaks > begin) & (breaks < end)].tolist(), end]
            q.runs.append([(a, b) for a, b in itertools.pairwise(cuts) if b > a])

    def aside(self, q: Quadrant) -> float:
        """Find how far beside its line, in lines of the finest zone, a step's one sample and then its other lie.

        Lines far apart miss what lies between; bilinear samples on both sides of them reach farther.
        """
        return 0.25 * max(0.0, 1 - 2 / max(q.dm * q.u_max, 1e-9)) if self.part == "wide" else 0.0

    def near(self, q: Quadrant) -> float:
        """Find how far from the light the lines of the nearest zone lie closer than CLOSE_PX: wide lines are close enough there."""
        stride = 2 ** (len(q.splits) - 2)
        return max(min(CLOSE_PX / (stride * q.dm), float(q.u[q.splits[1]])), BESIDE_PX)

    def uv(self, q: Quadrant, s: Array, sign: int) -> Array:
        """Find the position in pixels on line 0 at distances s, and its change from line to line: (n, 4)."""
        out = np.zeros((len(s), 4))
        out[:, q.axis] = self.light[q.axis] + sign * s
        out[:, 1 - q.axis] = self.light[1 - q.axis] + sign * q.sign * q.m_lo * s
        out[:, 3 - q.axis] = sign * q.sign * q.dm * s
        return out


def joined(parts: list[np.ndarray], kind: np.dtype) -> np.ndarray:
    """Join arrays of records: np.concatenate takes ten times as long, to see that their types are one."""
    out = np.empty(sum(map(len, parts)), kind)
    at = 0
    for part in parts:
        out[at : at + len(part)] = part
        at += len(part)
    return out
