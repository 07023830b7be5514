"""Lights beyond the frame: where gradients or beams meet, and guesses above gaps or a bright sky."""

from dataclasses import dataclass

import numpy as np

from airlight.detect.candidate import Candidate
from airlight.detect.signals import FIELD_SIDE_PX, Signals
from airlight.planes import Array, block_means, blur, box, label, shrink, smoothstep

GUESS_OFFSET = 0.12  # of the height: how far above the frame a light is guessed behind gaps
SKY_OFFSET = 0.10  # the same behind a bright sky
TOP_STRIP = 0.12  # of the height
SIDE_PX = 200  # of the copy that directions are measured on
CELL_PX = 9  # of its cells, one direction each
GRADIENT_BLUR = 0.04  # of the long side: shading is smooth, what is drawn on it is not
BEAM_BLUR = 0.01
AIM_DEG = 8.0  # deviation at which a direction no longer speaks for a point
FARTHEST_DIAGONALS = 1.6  # diagonals from the middle of the frame: beyond, directions are as good as parallel
PARALLEL_DIAGONALS = 40.0  # diagonals, where they are parallel


@dataclass(frozen=True)
class Directions:
    """x, y in widths. angle: towards the light, radians. weight: how sure each is. axial: its opposite is as good."""

    x: Array
    y: Array
    angle: Array
    weight: Array
    axial: bool

    def agreement(self, px: Array, py: Array) -> Array:
        """Weigh how many of the directions point at each of the given positions, as a share."""
        deviation = np.arctan2(py[:, None] - self.y, px[:, None] - self.x) - self.angle
        turn = np.pi if self.axial else 2 * np.pi
        deviation = (deviation + turn / 2) % turn - turn / 2
        return np.exp(-((deviation / np.radians(AIM_DEG)) ** 2)) @ self.weight / self.weight.sum()


def _directions(signals: Signals, axial: bool) -> Directions | None:
    """Measure where luminance rises, or along which axis it stays (beams), over cells of a small copy."""
    plane = np.log(shrink(np.minimum(signals.luminance, 1.0), SIDE_PX).astype(np.float64) + 0.003)
    height, width = plane.shape
    if min(height, width) < 4 * CELL_PX:
        return None
    dy, dx = np.gradient(blur(plane, (BEAM_BLUR if axial else GRADIENT_BLUR) * max(height, width)))
    y, x = (np.indices((height // CELL_PX, width // CELL_PX)) + 0.5) * CELL_PX / width
    if axial:
        xx, yy, xy = (block_means(plane, CELL_PX) for plane in (dx * dx, dy * dy, dx * dy))
        angle = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
        energy = xx + yy
        strength = np.sqrt(energy) * np.hypot(xx - yy, 2 * xy) / np.maximum(energy, 1e-12)
    else:
        gx, gy = block_means(dx, CELL_PX), block_means(dy, CELL_PX)
        angle, strength = np.arctan2(gy, gx), np.hypot(gx, gy)
    typical = float(np.median(strength))
    weight = strength / (strength + typical + 2e-4)  # one strong edge does not outvote the picture
    if weight.sum() < 0.05 * weight.size:
        return None
    return Directions(x.ravel(), y.ravel(), angle.ravel(), weight.ravel(), axial)


def _meeting(directions: Directions, aspect: float) -> tuple[tuple[float, float], float, float] | None:
    """Search the point beyond the frame where most directions meet: (x, y) normalised, the share that does, and how much
    larger that is than the share that is parallel. None where they meet within the frame, or best at infinity."""
    diagonal = float(np.hypot(1, aspect))
    turns = np.radians(np.arange(0, 360, 6.0))
    radii = diagonal * np.geomspace(0.1, FARTHEST_DIAGONALS, 12)
    a, r = (v.ravel() for v in np.meshgrid(turns, radii))
    px, py = 0.5 + r * np.cos(a), aspect / 2 + r * np.sin(a)
    share = directions.agreement(px, py)
    best = int(np.argmax(share))
    x, y, spread = float(px[best]), float(py[best]), 0.12 * float(r[best])
    for _ in range(4):
        dy, dx = (v.ravel() * spread for v in np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7)))
        near = directions.agreement(x + dx, y + dy)
        k = int(np.argmax(near))
        x, y, spread = x + float(dx[k]), y + float(dy[k]), spread / 2.5
    most = float(directions.agreement(np.array([x]), np.array([y]))[0])
    parallel = float(directions.agreement(0.5 + PARALLEL_DIAGONALS * np.cos(turns), aspect / 2 + PARALLEL_DIAGONALS * np.sin(turns)).max())
    if -0.02 < x < 1.02 and -0.02 < y / aspect < 1.02:
        return None
    return (x, y / aspect), most, most - parallel


def _converging(signals: Signals) -> list[Candidate]:
    """Find a light beyond the frame from the picture's own evidence: its shading, or its beams."""
    found = []
    for axial in (False, True):
        directions = _directions(signals, axial)
        met = directions and _meeting(directions, signals.aspect)
        if not met:
            continue
        position, share, margin = met
        fade = signals.falloff(position)
        if axial:
            score = smoothstep(share, 0.4, 0.65) * smoothstep(margin, 0.1, 0.25) * (0.5 + 0.4 * smoothstep(fade, 0.1, 0.4))
        else:
            score = 0.8 * smoothstep(share, 0.45, 0.7) * smoothstep(margin, 0.08, 0.2) * smoothstep(fade, 0.3, 0.6)
        found.append(Candidate(position, "beyond", float(score)))
    return found


def _above(signals: Signals, offset: float, column: float) -> tuple[tuple[float, float], float]:
    """Search the place above the frame, not far from a column, that the picture best fades away from; and how well it does."""
    columns = np.linspace(-0.1, 1.1, 49)
    fades = np.array([signals.falloff((float(x), -offset)) for x in columns])
    likely = np.maximum(fades, 0) * np.exp(-0.5 * ((columns - column) / 0.2) ** 2)
    best = int(np.argmax(likely))
    return (float(columns[best]), -offset), float(fades[best])


def _behind_gaps(signals: Signals) -> list[Candidate]:
    """Guess a light above the frame where nearly all that is bright are gaps along its top, as under trees."""
    value = signals.value / max(float(np.percentile(signals.value, 99.95)), 1e-6)
    height, width = value.shape
    bright = np.maximum(value - 0.3, 0)
    strip = max(1, round(TOP_STRIP * height))
    share = float(bright[:strip].sum() / max(bright.sum(), 1e-9))
    cover = float((bright[:strip] > 0).mean())
    score = smoothstep(share, 0.3, 0.55) * smoothstep(cover, 0.6, 0.35) * smoothstep(float(np.median(value)), 0.2, 0.1)
    if score <= 0:
        return []
    upper = np.cbrt(value[: round(0.5 * height)]).mean(axis=0)
    upper = np.maximum(upper - np.median(upper), 0)
    column = float((upper * (np.arange(width) + 0.5)).sum() / max(upper.sum(), 1e-9) / width)
    position, _ = _above(signals, GUESS_OFFSET, column)
    fade = signals.falloff(position, shrink((value > 0.3).astype(np.float32), FIELD_SIDE_PX))  # of what the gaps light
    return [Candidate(position, "beyond", float(0.8 * score * smoothstep(fade, 0.06, 0.16)), guess=True)]


def _behind_sky(signals: Signals) -> list[Candidate]:
    """Guess a light above the frame where a wide bright sky reaches its top and ends at a skyline."""
    whiteness = signals.whiteness
    width = whiteness.shape[1]
    marks, count = label(whiteness > 0.7 * float(np.percentile(whiteness, 99.95)))
    if not count:
        return []
    areas = np.bincount(marks.ravel(), minlength=count + 1)
    sky = marks == int(np.argmax(areas[1:])) + 1
    share, top = float(sky.mean()), float(sky[0].mean())
    grown = sky.astype(np.float32)
    edge = (box(grown, max(4, round(0.05 * width))) > 1e-6) & ~(box(grown, max(2, round(0.015 * width))) > 1e-6)
    if not edge.any():
        return []
    step = float(np.median(whiteness[edge]) / whiteness[sky].mean())
    score = smoothstep(share, 0.06, 0.12) * smoothstep(share, 0.6, 0.45) * smoothstep(top, 0.25, 0.45) * smoothstep(step, 0.72, 0.5)
    if score <= 0:
        return []
    position, fade = _above(signals, SKY_OFFSET, float((np.nonzero(sky)[1].mean() + 0.5) / width))
    return [Candidate(position, "beyond", float(0.6 * score * smoothstep(fade, 0.3, 0.55)), guess=True)]


def lights(signals: Signals) -> list[Candidate]:
    """Find lights beyond the frame."""
    return [*_converging(signals), *_behind_gaps(signals), *_behind_sky(signals)]
