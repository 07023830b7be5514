"""The bright parts of a picture, and what their shape, edge and surroundings are like."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airlight.detect.signals import Signals
from airlight.planes import Array, box, label, smoothstep

LEVELS = (0.97, 0.9, 0.8, 0.7, 0.6, 0.5)  # of a signal's white
LEAST_LEVEL = 0.68  # of white: a part cut below it is only the parent of others
PARENT = 0.76  # of a part's level: at which it must not melt into a wide plain
PARTS_PER_LEVEL = 6
LEAST_RADIUS = 0.004  # of the long side: smaller parts are glints
OPENING_SHARE = 0.035  # of the picture
OPENING_TOUCH = 0.35
OPENING_EVENNESS = 0.58
TORN = 0.85  # of an opening: a smaller piece of it was torn out by noise or shading
SURROUNDINGS = 1.25  # radii round a part that its window holds


@dataclass(frozen=True)
class Part:
    """Holds a connected bright part, in a window of the picture that holds its surroundings.

    corner: the window's, (x, y) px. mask, signal, luminance: of the window. typical: the signal's median over the picture. touch:
    the share of the outline, a circle's, that lies on the frame. company: the share of what is as bright that the part is.
    """

    signals: Signals
    corner: tuple[int, int]
    mask: Array
    signal: Array
    luminance: Array
    typical: float
    level: float
    touch: float
    company: float

    @classmethod
    def of(cls, signals: Signals, mask: Array, signal: Array, typical: float, level: float, company: float) -> "Part":
        """Cut a part's window out of the picture's planes."""
        rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
        inner = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        radius = float(np.sqrt(np.count_nonzero(inner) / np.pi))
        margin = round(max(10.0, SURROUNDINGS * radius)) + 1
        top, left = max(0, int(rows[0]) - margin), max(0, int(columns[0]) - margin)
        window = (slice(top, int(rows[-1]) + margin + 1), slice(left, int(columns[-1]) + margin + 1))
        on_frame = mask[0].sum() + mask[-1].sum() + mask[:, 0].sum() + mask[:, -1].sum()
        return cls(
            signals, (left, top), mask[window], signal[window], signals.luminance[window], typical, level,
            float(on_frame / (2 * np.pi * radius)), company,
        )  # fmt: skip

    @cached_property
    def pixels(self) -> tuple[Array, Array]:
        """List the positions, x, y, of its pixels in the picture."""
        y, x = np.nonzero(self.mask)
        return x + self.corner[0], y + self.corner[1]

    @property
    def share(self) -> float:
        return len(self.pixels[0]) / (self.signals.shape[0] * self.signals.shape[1])

    @property
    def radius(self) -> float:
        """Measure the radius of the disc of its area, px."""
        return float(np.sqrt(len(self.pixels[0]) / np.pi))

    @cached_property
    def centroid(self) -> tuple[float, float]:
        height, width = self.signals.shape
        x, y = self.pixels
        return float((x.mean() + 0.5) / width), float((y.mean() + 0.5) / height)

    @cached_property
    def brightness(self) -> float:
        return float(self.signal[self.mask].mean())

    @cached_property
    def hidden(self) -> Array:
        """Measure the share of each cell of the light field that the part, a little grown, covers."""
        reach = max(2, round(0.15 * self.radius))
        y, x = np.nonzero(box(self.mask.astype(np.float32), reach) > 1e-6)
        height, width = self.signals.shape
        rows, columns = self.signals.field.shape
        cells = (y + self.corner[1]) * rows // height * columns + (x + self.corner[0]) * columns // width
        covered = np.bincount(cells, minlength=rows * columns).reshape(rows, columns)
        return np.minimum(covered * (rows * columns / (height * width)), 1.0)

    def ring(self, inner: float, outer: float) -> Array:
        """Select the pixels of the window between two distances, px, from the part."""
        grown = self.mask.astype(np.float32)
        return (box(grown, max(1, round(outer))) > 1e-6) & ~(box(grown, max(1, round(inner))) > 1e-6)

    @cached_property
    def is_sharp(self) -> bool:
        """Tell whether it ends at an edge rather than fading out."""
        edge = self.ring(max(2.0, 0.15 * self.radius), max(4.0, 0.4 * self.radius))
        return bool(edge.any() and np.median(self.signal[edge]) < 0.5 * self.brightness)

    @cached_property
    def is_opening(self) -> bool:
        """Tell whether it is wide, even and sharply bounded within the frame, as a window is."""
        wide = self.share >= OPENING_SHARE and self.touch < OPENING_TOUCH
        return wide and self.is_sharp and self.evenness(0.8, 0.55) > OPENING_EVENNESS

    @property
    def plainness(self) -> float:
        """Rate it from 0, a light, to 1, a wide sky that is cut by the frame."""
        return float(smoothstep(self.touch, 0.35, 0.6) * smoothstep(self.share, 0.06, 0.09))

    def evenness(self, high: float, low: float) -> float:
        """Measure the share above `high` of its brightness within what, round it, lies above `low`: large where it is clipped or ends at
        an edge, small where it is shaded as a lit thing is."""
        top = float(np.percentile(self.signal[self.mask], 90))
        marks, _ = label(self.signal > low * top)
        wide = marks == marks.ravel()[int(np.argmax(np.where(self.mask, self.signal, -1)))]
        return float((self.signal[wide] > high * top).mean())

    def spill(self) -> float:
        """Measure how much brighter, in perceptual steps, the surroundings are near the part than farther away."""
        near = self.ring(max(2.0, 0.1 * self.radius), max(4.0, 0.35 * self.radius))
        far = self.ring(max(5.0, 0.7 * self.radius), max(9.0, 1.2 * self.radius))
        if not near.any() or not far.any():
            return 1.0
        steps = np.cbrt(self.luminance)
        return float(steps[near].mean() / max(float(steps[far].mean()), 1e-3))

    def roundness(self) -> float:
        """Rate its shape, 1 for a disc, less if long or angular: by its axes and the fourth moment of its whitened pixels."""
        x, y = self.pixels
        if len(x) < 2:  # has no shape
            return 0.0
        spread = np.cov(np.stack([x, y])) + np.eye(2) / 12
        values, vectors = np.linalg.eigh(spread)
        white = (np.stack([x - x.mean(), y - y.mean()]).T @ vectors) / np.sqrt(values)
        squared = (white**2).sum(axis=1)
        fourth = float((squared**2).mean() / max(squared.mean() ** 2, 1e-9))  # 4/3 for a disc, 1.4 for a square
        slack = 0.12 / max(self.radius, 1.0)  # of whole pixels
        axes = float(np.sqrt(values[0] / values[1]))
        return float(smoothstep(abs(fourth - 4 / 3), 0.04 + slack, 0.012 + slack) * smoothstep(axes, 0.6, 0.85))


def bright_parts(signals: Signals) -> list[Part]:
    """Cut the bright parts of both signals; skies, and what melts into one a little lower, are left out."""
    parts = []
    for signal in (signals.whiteness, signals.value):
        if signal.max() <= 1e-6:
            continue
        white, peak, typical = float(np.percentile(signal, 99.95)), float(signal.max()), float(np.median(signal))
        above = list(np.geomspace(0.7 * peak, 1.3 * white, 5)) if peak > 1.6 * white else []  # suns of a picture of high range
        cuts = []
        for level in [*above, *(white * level for level in LEVELS)]:
            marks, count = label(signal > level)
            cuts.append((level, marks, np.bincount(marks.ravel(), minlength=count + 1)))
        parents: dict[tuple[float, int], Part] = {}
        openings: set[tuple[float, int]] = set()
        for k, (level, marks, areas) in enumerate(cuts):
            if level < LEAST_LEVEL * white:
                break
            lower_level, lower, lower_areas = next((c for c in cuts[k:] if c[0] <= PARENT * level), cuts[-1])
            for i in np.argsort(-areas[1:], kind="stable")[:PARTS_PER_LEVEL] + 1:
                if areas[i] < np.pi * (LEAST_RADIUS * signals.long_side) ** 2:
                    break
                mask = marks == i
                number = int(lower.ravel()[int(np.argmax(mask))])
                key = (lower_level, number)
                if key not in parents:
                    company = float(lower_areas[number] / lower_areas[1:].sum())
                    parents[key] = Part.of(signals, lower == number, signal, typical, lower_level, company)
                parent = parents[key]
                if parent.plainness == 1:
                    continue
                if not (parent.is_opening and areas[i] < TORN * lower_areas[number]):
                    parts.append(Part.of(signals, mask, signal, typical, level, float(areas[i] / areas[1:].sum())))
                elif key not in openings:
                    openings.add(key)
                    parts.append(parent)
    return parts
